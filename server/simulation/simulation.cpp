#include "server/simulation/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>
#include <utility>

#include "server/simulation/state.hpp"

namespace parhelion::simulation {
namespace {

Status check(const SimulationOptions& options, const RobotDescription& robot) {
  if (!(options.rate >= 10 && options.rate <= 10'000)) {
    return Error{"physics rate " + std::to_string(options.rate) + " Hz; expected 10 to 10000 Hz"};
  }
  if (!(options.history.ns > 0 && options.history.seconds() <= 60)) {
    return Error{"history of " + std::to_string(options.history.seconds()) +
                 " s; expected more than 0 and at most 60 s"};
  }
  for (const Zone& zone : options.zones) {
    if (Status status = check_zone(zone); !status) return status;
  }
  for (const Hazard& hazard : options.hazards) {
    if (Status status = check(hazard); !status) return status;
  }
  if (options.radio) {
    if (Status status = check(*options.radio); !status) return status;
  }
  if (options.battery) {
    if (Status status = check(*options.battery); !status) return status;
  }
  const bool finite = std::all_of(robot.footprint.begin(), robot.footprint.end(),
                                  [](const auto& v) { return v.allFinite(); });
  if (!finite || convex_hull(robot.footprint).size() < 3) {
    return Error{"robot '" + robot.name + "': its footprint of " + std::to_string(robot.footprint.size()) +
                 " points has no area; expected at least three finite corners"};
  }
  if (!(robot.height > 0) || !std::isfinite(robot.height)) {
    return Error{"robot '" + robot.name + "': height " + std::to_string(robot.height) +
                 " m; expected more than 0"};
  }
  if (!(robot.limits.deceleration > 0) || !(robot.limits.reaction_time >= 0)) {
    return Error{"robot '" + robot.name +
                 "': expected a deceleration above 0 and a reaction time of at least 0"};
  }
  return {};
}

/// What stands covers its footprint; what leans or lies covers the outline of its box.
void place_footprint(Agent& agent) {
  const Eigen::Isometry3d& T_map_body = agent.rigid.T_map_body.isometry();
  if (T_map_body(2, 2) > 0.9999) {
    place(agent.form.footprint, agent.pose, agent.placed);
    return;
  }
  std::vector<Eigen::Vector2d> corners;
  const Eigen::Vector3d& size = agent.form.size;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p(corner & 1 ? 0.5 : -0.5, corner & 2 ? 0.5 : -0.5, corner & 4 ? 1 : 0);
    corners.emplace_back((T_map_body * Eigen::Vector3d(p.cwiseProduct(size))).head<2>());
  }
  agent.placed = make_polygon(convex_hull(std::move(corners)));
}

}  // namespace

Simulation::State::State(const SimulationOptions& with, SimulationTime at_start)
    : options(with),
      dt(1 / with.rate),
      start(at_start),
      physics(1 / with.rate),
      history(static_cast<std::size_t>(std::ceil(with.history.seconds() * with.rate)) + 1) {}

Agent* Simulation::State::find(const std::string& name) {
  const auto at =
      std::find_if(agents.begin(), agents.end(), [&](const auto& a) { return a->definition.name == name; });
  return at == agents.end() ? nullptr : at->get();
}

void Simulation::State::observe_robot(Agent& agent) {
  agent.robot->observe(physics, stamp_of(step), dt, incidents);
  for (const JointIncident& incident : incidents) {
    say(incident.kind, agent, 0, {});
    events.back().object = incident.joint;
    events.back().value = incident.value;
    events.back().position = incident.position;
  }
  incidents.clear();
  agent.pose = planar_pose(agent.robot->motion().T_map_base);
  agent.floor = agent.rigid.T_map_body.translation().z();
  place_footprint(agent);
}

Result<Simulation> Simulation::create(const SimulationOptions& options, const SemanticModel& model,
                                      const RobotDescription& robot, SimulationTime start) {
  if (Status status = check(options, robot); !status) return status.error();
  auto state = std::make_unique<State>(options, start);
  auto building = Building::create(model);
  if (!building) return building.error();
  state->doors = (*building)->enter(state->physics, state->next_building, state->door_rules());
  state->building = std::move(building).value();
  state->next_building += static_cast<BodyId>(model.entities.size());
  state->end_of_buildings = state->next_building + options.building_bodies;
  state->next_body = state->end_of_buildings;

  state->hazards.resize(options.hazards.size());
  for (std::size_t i = 0; i < options.hazards.size(); ++i) {
    const Hazard& hazard = options.hazards[i];
    // A wide field takes milliseconds: before the session begins.
    if (hazard.kind == HazardKind::gas && hazard.agent.empty())
      state->hazards[i].gas.place(*state->building, hazard.position, hazard.reach);
  }
  RealBody& real = state->real;
  real.name = robot.name;
  real.id = state->next_body++;
  real.mass = robot.mass;
  real.height = robot.height;
  real.limits = robot.limits;
  real.footprint = make_polygon(convex_hull(robot.footprint));
  real.watch = BodyWatch(supervised(robot));
  real.handle = state->physics.add_kinematic(real.footprint.vertices, robot.height);
  state->real_definition = std::make_shared<const BodyDefinition>(
      BodyDefinition{real.id, robot.name, "base", BodyOwner::real_robot, false,
                     outline_shapes(real.footprint.vertices, robot.height)});
  state->rebuild_scene();
  state->record();
  return Simulation(std::move(state));
}

Simulation::Simulation(std::unique_ptr<State> state) : state_(std::move(state)) {}
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;
Simulation::~Simulation() = default;

SimulationTime Simulation::now() const { return state_->stamp_of(state_->step); }
SimulationTime Simulation::next_step() const { return state_->stamp_of(state_->step + 1); }
SimulationTime Simulation::after(std::uint64_t steps) const { return state_->stamp_of(state_->step + steps); }
std::shared_ptr<const Scene> Simulation::scene() const { return state_->scene; }

std::uint64_t Simulation::steps_due(SimulationTime until) const {
  if (until < next_step()) return 0;
  auto steps = static_cast<std::uint64_t>((until - now()).seconds() * state_->options.rate);
  // The product is rounded; the instants of the steps decide.
  while (after(steps + 1) <= until) ++steps;
  while (after(steps) > until) --steps;
  return steps;
}

const AgentDefinition* Simulation::find_agent(const std::string& name) const {
  const Agent* agent = state_->find(name);
  return agent ? &agent->definition : nullptr;
}

std::optional<Transform<Map, Base>> Simulation::pose_of(const std::string& name) const {
  const Agent* agent = state_->find(name);
  if (!agent) return std::nullopt;
  if (agent->robot) return agent->robot->motion().T_map_base;
  return Transform<Map, Base>(agent->rigid.T_map_body.isometry());
}

std::vector<Event> Simulation::take_events() {
  std::vector<Event> events;
  events.swap(state_->events);
  return events;
}

void Simulation::show(const std::string& agent, AgentShown shown) {
  Agent* found = state_->find(agent);
  if (found == nullptr || found->shown == shown) return;
  found->shown = shown;
  found->clear_of_real = false;  // until a step has looked
}

bool Simulation::clear_of_real(const std::string& agent) const {
  const Agent* found = state_->find(agent);
  return found == nullptr || found->clear_of_real;
}

Result<std::shared_ptr<Building>> Simulation::prepare_building(const SemanticModel& model) {
  return Building::create(model);
}

Status Simulation::set_building(const SemanticModel& model) {
  auto building = prepare_building(model);
  return building ? set_building(model, std::move(*building)) : building.error();
}

Status Simulation::set_building(const SemanticModel& model, std::shared_ptr<Building> next) {
  State& state = *state_;
  for (const ModelEntity& entity : model.entities) {
    if (state.find(entity.name)) return Error{"model entity '" + entity.name + "': an agent has this name"};
  }
  if (model.entities.size() > state.end_of_buildings - state.next_building) {
    return Error{
        "a model of " + std::to_string(model.entities.size()) +
        " entities: the numbers that were kept for later buildings are used up; start a new session"};
  }
  state.wake_all();
  const std::vector<Door> old_doors =
      std::exchange(state.doors, next->enter(state.physics, state.next_building, state.door_rules()));
  const std::shared_ptr<const Building> old = std::exchange(state.building, std::move(next));
  state.keep_doors(old_doors);
  for (const Door& door : old_doors) unhang_door(state.physics, door);
  old->leave(state.physics);
  for (HazardState& hazard : state.hazards) hazard.gas = GasField();
  state.next_building += static_cast<BodyId>(model.entities.size());
  std::set<std::string_view> standing;
  for (const FixedObstacle& obstacle : state.building->obstacles()) standing.insert(obstacle.name);
  for (const FixedObstacle& gone : old->obstacles()) {
    if (!standing.contains(gone.name)) state.contacts.forget(gone.name, now(), state.events);
  }
  for (const auto& agent : state.agents) {
    agent->floor = state.building->floor_height(agent->pose.position());
    state.forget_route(*agent);
  }
  state.rebuild_scene();
  return {};
}

void Simulation::set_real_obstacles(const std::vector<RealObstacle>& obstacles) {
  state_->real_obstacles = obstacles;
  state_->real_discs.resize(obstacles.size());
  for (std::size_t i = 0; i < obstacles.size(); ++i) {
    state_->real_discs[i] = make_disc(obstacles[i].center, obstacles[i].radius);
  }
}

void Simulation::skip(std::uint64_t steps) {
  state_->step += steps;
  state_->record();
}

void Simulation::step(const std::optional<RealRobotState>& real, std::vector<LaserRequest>& requests) {
  State& state = *state_;
  ++state.step;
  state.move_real(real);
  state.drive_agents();
  state.move_doors();
  state.physics.step();
  state.read_doors();
  for (const auto& agent : state.agents) {
    if (agent->coasts) {
      state.coast(*agent);
      place(agent->form.footprint, agent->pose, agent->placed);
      state.move_parts(*agent);
      continue;
    }
    const RigidState rigid = state.physics.state(agent->handle);
    const bool moved = !rigid.T_map_body.isometry().isApprox(agent->rigid.T_map_body.isometry(), 0);
    agent->rigid = rigid;
    if (agent->robot) {
      state.observe_robot(*agent);
      continue;
    }
    if (agent->cable) {
      state.observe_cable(*agent);
      continue;
    }
    if (!moved && !agent->form.upright) continue;
    agent->pose = planar_pose(Transform<Map, Base>(agent->rigid.T_map_body.isometry()));
    place_footprint(*agent);
    state.move_parts(*agent);
  }
  state.track_contacts();
  state.watch_grippers();
  state.watch_doors();
  state.supervise();
  state.record();
  state.ask_lasers(requests);
}

}  // namespace parhelion::simulation
