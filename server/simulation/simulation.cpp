#include "server/simulation/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>
#include <utility>

#include "server/simulation/state.hpp"

namespace parhelion {
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

/// The outline as thin boxes, their outer sides on the footprint's edges: exact for a laser, whatever the
/// polygon.
std::vector<Shape> outline(const std::vector<Eigen::Vector2d>& footprint, double height) {
  constexpr double thickness = 0.004;  // m
  std::vector<Shape> shapes;
  for (std::size_t i = 0; i < footprint.size(); ++i) {
    const Eigen::Vector2d a = footprint[i], b = footprint[(i + 1) % footprint.size()];
    const Eigen::Vector2d along = (b - a).normalized();
    const Eigen::Vector2d middle = (a + b) / 2 + Eigen::Vector2d(-along.y(), along.x()) * thickness / 2;
    const Eigen::Quaterniond turned(
        Eigen::AngleAxisd(std::atan2(along.y(), along.x()), Eigen::Vector3d::UnitZ()));
    shapes.push_back({ShapeKind::box,
                      {(b - a).norm(), thickness, height},
                      Transform<Body, ShapeFrame>(turned, {middle.x(), middle.y(), height / 2}),
                      {}});
  }
  return shapes;
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

/// rad from a to b; all parts of an agent turn about its y axis (part_poses).
double turned_about_y(const Transform<Base, Body>& a, const Transform<Base, Body>& b) {
  const auto &from = a.isometry().linear(), &to = b.isometry().linear();
  const double sine = to(0, 2) * from(0, 0) - to(0, 0) * from(0, 2);
  const double cosine = to(0, 0) * from(0, 0) + to(0, 2) * from(0, 2);
  return sine == 0 && cosine > 0 ? 0 : std::atan2(sine, cosine);
}

BodyState body_state(BodyId id, std::uint32_t epoch, const RigidState& rigid) {
  return {id, epoch, rigid.T_map_body, rigid.velocity, rigid.rotation_rate, true};
}

/// Doors have numbers of the building: they come before all else in a record, and among its bodies here.
void place_doors(const std::vector<BodyState>& fixed, std::vector<BodyState>& bodies) {
  const auto first = bodies.begin() + static_cast<std::ptrdiff_t>(fixed.size());
  auto door = first;
  for (; !fixed.empty() && door != bodies.end() && door->id <= fixed.back().id; ++door) {
    const auto at = std::lower_bound(fixed.begin(), fixed.end(), door->id,
                                     [](const BodyState& body, BodyId id) { return body.id < id; });
    bodies[static_cast<std::size_t>(at - fixed.begin())] = *door;
  }
  bodies.erase(first, door);
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

void Simulation::State::rebuild_scene() {
  auto next = std::make_shared<Scene>();
  next->version = scene ? scene->version + 1 : 1;
  next->bodies = building->definitions();
  next->bodies.push_back(real_definition);
  next->bodies.insert(next->bodies.end(), agent_definitions.begin(), agent_definitions.end());
  scene = std::move(next);

  // Scratch for the worst case, so that a crowd that gathers later allocates nothing.
  const std::size_t movers = agents.size() + 2;
  near.reserve(4 * building->obstacles().size());
  nearby.reserve(4 * movers + 64);
  steering.obstacles.reserve(building->obstacles().size() + movers + 512);
  while (steering.predicted.size() < movers) steering.predicted.push_back(make_segment({0, 0}, {0, 0}, 0));
}

/// A part's own velocity is the difference of its last two poses in the agent's frame, on top of the agent's
/// motion.
void Simulation::State::append_states(Agent& agent, std::vector<BodyState>& bodies) {
  if (agent.robot) {
    agent.robot->append_states(agent.first_body, agent.epoch, bodies);
    return;
  }
  if (agent.cable) {
    agent.cable->append_states(agent.first_body, agent.epoch, bodies);
    return;
  }
  bodies.push_back(body_state(agent.first_body, agent.epoch, agent.rigid));
  if (agent.body_count == 1) return;
  poses.clear();
  part_poses(agent.definition, agent.parts, poses);
  const Transform<Map, Base> T_map_base(agent.rigid.T_map_body.isometry());
  const bool first = agent.part_epoch != agent.epoch || agent.part_poses.size() != poses.size();
  const Eigen::Matrix3d R = T_map_base.rotation();
  bodies.pop_back();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    BodyState state;
    state.id = agent.first_body + static_cast<BodyId>(i);
    state.epoch = agent.epoch;
    state.T_map_body = T_map_base * poses[i];
    const Eigen::Vector3d arm = R * poses[i].translation();
    state.velocity = agent.rigid.velocity + agent.rigid.rotation_rate.cross(arm);
    state.rotation_rate = agent.rigid.rotation_rate;
    if (!first) {
      const Transform<Base, Body>& before = agent.part_poses[i];
      state.velocity += R * (poses[i].translation() - before.translation()) / dt;
      state.rotation_rate += R.col(1) * (turned_about_y(before, poses[i]) / dt);
    }
    bodies.push_back(state);
  }
  agent.part_epoch = agent.epoch;
  agent.part_poses.swap(poses);
}

void Simulation::State::observe_cable(Agent& agent) {
  if (!agent.cable->observe(physics)) return;
  agent.pose = planar_pose(Transform<Map, Base>(agent.rigid.T_map_body.isometry()));
  std::vector<Eigen::Vector2d> corners;
  const double r = agent.cable->form().radius;
  for (const Eigen::Vector3d& p : agent.cable->points()) {
    for (int corner = 0; corner < 4; ++corner)
      corners.emplace_back(p.x() + (corner & 1 ? r : -r), p.y() + (corner & 2 ? r : -r));
  }
  agent.placed = make_polygon(convex_hull(std::move(corners)));
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

void Simulation::State::record() {
  HistoryRecord& record = history.push();
  record.stamp = stamp_of(step);
  record.step = step;
  record.scene = scene;
  record.attitude_known = real.present && real.last.attitude_known;
  record.building = building;
  record.bodies.reserve(doors.size() + 1 + agent_definitions.size());
  record_doors(record.bodies);
  if (real.present) {
    const Eigen::Isometry3d& base = real.last.T_map_base.isometry();
    const Eigen::Vector3d velocity =
        base.linear() * Eigen::Vector3d(real.last.twist.vx, real.last.twist.vy, 0);
    record.bodies.push_back({real.id, real.epoch, Transform<Map, Body>(base), velocity,
                             base.linear() * Eigen::Vector3d(0, 0, real.last.twist.wz), true});
  }
  for (const auto& agent : agents) append_states(*agent, record.bodies);
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
                     outline(real.footprint.vertices, robot.height)});
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

bool Simulation::at(SimulationTime t, WorldSnapshot& snapshot) const {
  const Duration ahead = next_step() - now();
  const HistoryRecord* record = state_->history.record_at(t, ahead);
  if (!record) return false;
  // Of the building only doors move: what an earlier call wrote for this scene is still right.
  const std::vector<BodyState>& fixed = record->building->states();
  if (snapshot.scene != record->scene || snapshot.bodies.size() < fixed.size()) {
    snapshot.bodies.assign(fixed.begin(), fixed.end());
  } else {
    snapshot.bodies.resize(fixed.size());
    for (const std::size_t door : record->building->door_bodies()) snapshot.bodies[door] = fixed[door];
  }
  state_->history.find(t, ahead, snapshot.bodies);
  place_doors(fixed, snapshot.bodies);
  snapshot.stamp = t;
  snapshot.step = record->step;
  snapshot.scene = record->scene;
  snapshot.attitude_known = record->attitude_known;
  return true;
}

}  // namespace parhelion
