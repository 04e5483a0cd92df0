#include "server/simulation/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string_view>
#include <utility>

#include "server/simulation/agent_lasers.hpp"
#include "server/simulation/arm_limit.hpp"
#include "server/simulation/arm_travel.hpp"
#include "server/simulation/behaviour/admission.hpp"
#include "server/simulation/clearance.hpp"
#include "server/simulation/events/robot_supply_watch.hpp"
#include "server/simulation/parts.hpp"
#include "server/simulation/robots/base_body.hpp"

namespace parhelion::simulation {
namespace {

Status check(const SimulationOptions& options) {
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
  return {};
}

Status check(const RobotDescription& robot) {
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

Status check(std::span<const RobotDescription> robots) {
  if (robots.empty()) return Error{"no robot: expected at least one description"};
  for (std::size_t i = 0; i < robots.size(); ++i) {
    if (Status status = check(robots[i]); !status) return status;
    for (std::size_t j = 0; j < i; ++j) {
      if (robots[i].name == robots[j].name)
        return Error{"two robots are called '" + robots[i].name + "': names must be unique"};
    }
  }
  return {};
}

}  // namespace

Simulation::Parts::Parts(const SimulationOptions& with, SimulationTime start)
    : options(with),
      clock(start, with.rate),
      physics(clock.dt),
      recorder(static_cast<std::size_t>(std::ceil(with.history.seconds() * with.rate)) + 1) {}

void Simulation::Parts::rebuild_scene() {
  recorder.rebuild_scene(environment, real_robots, agents);
  // Memory for the worst case, so that a growing crowd allocates nothing.
  const std::size_t movers = agents.size() + 1 + real_robots.size();
  const std::size_t obstacles = environment.building->obstacles().size();
  behaviours.reserve(movers, obstacles);
  forecast.reserve(movers, obstacles);
  contacts.reserve(obstacles);
  predictor.reserve(obstacles);
}

Result<Simulation> Simulation::create(const SimulationOptions& options, const SemanticModel& model,
                                      const RobotDescription& robot, SimulationTime start) {
  return create(options, model, std::span(&robot, 1), start);
}

Result<Simulation> Simulation::create(const SimulationOptions& options, const SemanticModel& model,
                                      std::span<const RobotDescription> robots, SimulationTime start) {
  if (Status status = check(options); !status) return status.error();
  if (Status status = check(robots); !status) return status.error();
  auto parts = std::make_unique<Parts>(options, start);
  auto building = Building::create(model);
  if (!building) return building.error();
  BuildingNumbers& numbers = parts->building_numbers;
  Environment& environment = parts->environment;
  environment.doors =
      DoorSet((*building)->enter(parts->physics, numbers.next, {options.level, options.doors}));
  environment.building = std::move(building).value();
  numbers.next += static_cast<BodyId>(model.entities.size());
  numbers.end = numbers.next + options.building_bodies;
  parts->agents.number_bodies_from(numbers.end);
  parts->hazards.emplace(options.hazards, *environment.building);
  for (const RobotDescription& robot : robots) {
    auto twin = robot.model.empty() ? nullptr : find_model(robot.model, options);
    if (!robot.model.empty() && !twin)
      return Error{"robot '" + robot.name + "': no robot model '" + robot.model + "' is in this session"};
    const BodyId first = parts->agents.take_body_numbers(count_bodies(twin.get()));
    parts->real_robots.push_back(
        make_real_robot(robot, std::move(twin), parts->real_robots.size(), first, parts->physics));
  }
  for (const ModelObject& object : options.objects) {
    if (Status status = parts->add_object(object); !status) return status.error();
  }
  parts->rebuild_scene();
  parts->recorder.record(parts->clock, environment, parts->real_robots, parts->agents);
  return Simulation(std::move(parts));
}

Simulation::Simulation(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;
Simulation::~Simulation() = default;

SimulationTime Simulation::now() const { return parts_->clock.now(); }
SimulationTime Simulation::next_step() const { return after(1); }
SimulationTime Simulation::after(std::uint64_t steps) const {
  return parts_->clock.stamp_of(parts_->clock.step + steps);
}
std::shared_ptr<const Scene> Simulation::scene() const { return parts_->recorder.scene(); }

std::uint64_t Simulation::steps_due(SimulationTime until) const {
  if (until < next_step()) return 0;
  auto steps = static_cast<std::uint64_t>((until - now()).seconds() * parts_->clock.rate);
  // The product is rounded; the exact instants of the steps decide.
  while (after(steps + 1) <= until) ++steps;
  while (after(steps) > until) --steps;
  return steps;
}

const AgentDefinition* Simulation::find_agent(const std::string& name) const {
  const Agent* agent = parts_->agents.find(name);
  return agent ? &agent->definition : nullptr;
}

std::optional<Transform<Map, Base>> Simulation::pose_of(const std::string& name) const {
  const Agent* agent = parts_->agents.find(name);
  if (!agent) return std::nullopt;
  if (agent->robot) return agent->robot->motion().T_map_base;
  return base_of(agent->rigid.T_map_body);
}

const RobotMotion* Simulation::robot_motion(const std::string& name) const {
  const Agent* agent = parts_->agents.find(name);
  return agent && agent->robot ? &agent->robot->motion() : nullptr;
}

SupplyState Simulation::supply_of(const std::string& name) const {
  return supply_state(parts_->agents.find(name), parts_->options.battery);
}

void Simulation::show(const std::string& agent, AgentShown shown, std::size_t robot) {
  Agent* found = parts_->agents.find(agent);
  if (found == nullptr || found->seen_by[robot].shown == shown) return;
  found->seen_by[robot] = {shown, false};  // not clear until a step has checked it
}

bool Simulation::clear_of_real(const std::string& agent, std::size_t robot) const {
  const Agent* found = parts_->agents.find(agent);
  return found == nullptr || found->seen_by[robot].clear_of_real;
}

std::size_t Simulation::unconstrained_agents() const {
  return static_cast<std::size_t>(std::count_if(parts_->agents.begin(), parts_->agents.end(),
                                                [](const Agent& agent) { return agent.unconstrained; }));
}

std::vector<DoorState> Simulation::doors() const {
  std::vector<DoorState> states;
  for (const Door& door : parts_->environment.doors.all()) {
    states.push_back(
        {door.in_model.name, door.opening(), door.known, door.dynamic, door.unhinged, door.rigid.T_map_body});
  }
  return states;
}

void Simulation::observe_door(const std::string& name, std::optional<double> opening) {
  parts_->environment.doors.observe(name, opening);
}

const std::vector<Relation>& Simulation::relations_of(const std::string& entity) const {
  return parts_->environment.building->net().relations(entity);
}

void Simulation::set_real_obstacles(const std::vector<RealObstacle>& obstacles, std::size_t sensor) {
  Environment& environment = parts_->environment;
  if (environment.unmodelled_by_sensor.size() <= sensor) environment.unmodelled_by_sensor.resize(sensor + 1);
  std::vector<Footprint>& own = environment.unmodelled_by_sensor[sensor];
  own.clear();
  for (const RealObstacle& obstacle : obstacles) own.push_back(make_disc(obstacle.center, obstacle.radius));
  environment.unmodelled.clear();
  for (const std::vector<Footprint>& each : environment.unmodelled_by_sensor)
    environment.unmodelled.insert(environment.unmodelled.end(), each.begin(), each.end());
}

void Simulation::set_real_people(const std::vector<RealPerson>& people) {
  if (parts_->environment.people.set(people)) parts_->rebuild_scene();
}

const std::vector<RealPerson>& Simulation::real_people() const { return parts_->environment.people.all(); }

std::vector<Event> Simulation::take_events() {
  std::vector<Event> events;
  events.swap(parts_->events);
  return events;
}

bool Simulation::hazard_reading(HazardReading& reading, std::size_t robot) {
  return parts_->hazards->read(parts_->surroundings(), robot, reading);
}

Simulation::Clearance Simulation::clearance(const Transform<Map, Base>& T_map_base, const Twist2& twist,
                                            double limit, std::size_t robot) const {
  const RealRobot& real = parts_->real_robots[robot];
  Clearance result = simulation::clearance(real.footprint, parts_->agents, real.grip.held(), T_map_base,
                                           twist, limit, parts_->swept);
  const double speed = fastest_point_speed(real.footprint, twist);
  if (!real.twin || !real.present || !(speed > 0)) return result;
  const ArmTravel arm = base_travel(real, parts_->agents, parts_->physics, T_map_base, twist, limit / speed);
  result.arm_distance = arm.time * speed;
  return result;
}

void Simulation::set_encoders(const JointPosture& posture, bool fresh, std::size_t robot) {
  RealRobot& real = parts_->real_robots[robot];
  if (!real.twin) return;
  real.twin->set_posture(posture);
  real.encoders_fresh = fresh;
}

const std::string& Simulation::held_by(std::size_t robot) const {
  return parts_->real_robots[robot].grip.held();
}

std::vector<Simulation::LimitedJoint> Simulation::limit_joints(Joints& command, double reaction, double holds,
                                                               std::size_t robot) const {
  const RealRobot& real = parts_->real_robots[robot];
  if (!real.twin || !real.present) return {};
  return simulation::limit_joints(real, parts_->agents, parts_->physics, reaction, holds, command);
}

bool Simulation::at(SimulationTime t, WorldSnapshot& snapshot) const {
  return parts_->recorder.at(t, next_step() - now(), snapshot);
}

void Simulation::give_scan(const std::string& agent_name, const Scan& scan) {
  Agent* agent = parts_->agents.find(agent_name);
  if (agent && agent->laser) handle_scan(*agent->laser, scan);
}

Result<std::shared_ptr<Building>> Simulation::prepare_building(const SemanticModel& model) {
  return Building::create(model);
}

Status Simulation::set_building(const SemanticModel& model) {
  auto building = prepare_building(model);
  return building ? set_building(model, std::move(*building)) : building.error();
}

Status Simulation::set_building(const SemanticModel& model, std::shared_ptr<Building> next) {
  Parts& parts = *parts_;
  BuildingNumbers& numbers = parts.building_numbers;
  Environment& environment = parts.environment;
  for (const ModelEntity& entity : model.entities) {
    if (parts.agents.find(entity.name))
      return Error{"model entity '" + entity.name + "': an agent has this name"};
  }
  if (model.entities.size() > numbers.end - numbers.next) {
    return Error{"a model of " + std::to_string(model.entities.size()) +
                 " entities: the ids reserved for later buildings are used up; start a new session"};
  }
  constrain_all(parts.agents, parts.physics);
  const DoorRules rules{parts.options.level, parts.options.doors};
  const DoorSet old_doors =
      std::exchange(environment.doors, DoorSet(next->enter(parts.physics, numbers.next, rules)));
  const std::shared_ptr<const Building> old = std::exchange(environment.building, std::move(next));
  environment.doors.keep(old_doors.all(), *environment.building, parts.agents, parts.physics);
  for (const Door& door : old_doors.all()) unhang_door(parts.physics, door);
  old->leave(parts.physics);
  parts.hazards->forget_fields();
  numbers.next += static_cast<BodyId>(model.entities.size());
  std::set<std::string_view> standing;
  for (const FixedObstacle& obstacle : environment.building->obstacles()) standing.insert(obstacle.name);
  for (const FixedObstacle& gone : old->obstacles()) {
    if (!standing.contains(gone.name)) parts.contacts.forget(gone.name, now(), parts.events);
  }
  for (Agent& agent : parts.agents) {
    agent.floor = environment.building->floor_height(agent.pose.position());
    parts.behaviours.forget_route(agent);
  }
  parts.rebuild_scene();
  return {};
}

}  // namespace parhelion::simulation
