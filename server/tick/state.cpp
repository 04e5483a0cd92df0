#include "server/tick/state.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include "server/tick/check_names.hpp"
#include "server/tick/check_training.hpp"

namespace parhelion::tick {
namespace {

constexpr BodyId kBodiesOfLaterBuildings = BodyId{1} << 22;  // a thousand each for four thousand versions

simulation::SimulationOptions simulation_options(const Configuration& configuration, bool solve_all) {
  const Scenario& scenario = configuration.scenario;
  simulation::SimulationOptions options;
  options.rate = scenario.physics_rate;
  options.seed = scenario.seed;
  options.solve_all = solve_all;
  options.zones = scenario.zones;
  options.hazards = scenario.hazards;
  options.radio = scenario.radio;
  options.battery = scenario.battery;
  for (const Fault& fault : scenario.faults) {
    if (fault.kind != Fault::Kind::low_battery) continue;
    if (!options.battery) options.battery.emplace();
    options.battery->charge = fault.amount;
  }
  options.max_agents = static_cast<std::size_t>(scenario.max_agents);
  options.level = scenario.level;
  options.doors = scenario.doors;
  options.objects = configuration.objects;
  options.robot_models = configuration.robot_models;
  if (scenario.mapping) options.building_bodies = kBodiesOfLaterBuildings;
  return options;
}

Status spawn_agents(const Configuration& configuration, State& state) {
  for (const AgentDefinition& agent : configuration.scenario.agents) {
    Status spawned = state.simulation.spawn_among_robots(agent, state.real);
    if (spawned) {
      state.world.kinds[agent.name] = agent.kind;
      if (agent.camera_rate != 0)
        spawned = set_agent_camera(configuration, agent, state.simulation.now(), state.agent_cameras);
    }
    if (!spawned) {
      const std::string who = "agent '" + agent.name + "': ", &why = spawned.error().message;
      return Error{"scenario " + who + (why.starts_with(who) ? why.substr(who.size()) : why)};
    }
  }
  return {};
}

/// Each laser, and each slice through the images of a depth camera.
void number_sensors(std::vector<RobotState>& robots) {
  std::size_t next = 0;
  const auto number_laser = [&](ScanState& scan, PeopleState& people) {
    scan.sensor = people.sensor = next++;
  };
  const auto number_camera = [&](CameraState& camera) {
    for (PeopleState& people : camera.people.people) people.sensor = next++;
  };
  for (RobotState& robot : robots) {
    number_laser(robot.scan, robot.people);
    for (FurtherLaser& laser : robot.further_lasers) number_laser(laser.scan, laser.people);
    number_camera(robot.camera);
    for (CameraState& camera : robot.further_cameras) number_camera(camera);
  }
}

}  // namespace

RobotState::RobotState(const Configuration& configuration, std::size_t index_)
    : name(configuration.robot_at(index_).name),
      index(index_),
      pose(configuration, configuration.robot_at(index_)),
      encoders(configuration, configuration.robot_at(index_)),
      scan_silence(configuration.robot_at(index_)) {
  injection.gate = InjectionGate(index);
  for (const NamedLaser& laser : configuration.robot_at(index).further_lasers) {
    FurtherLaser& further = further_lasers.emplace_back();
    further.scan.laser = further_lasers.size();
    further.injection.laser = laser.name;
  }
  further_cameras.resize(configuration.robot_at(index).further_cameras.size());
  for (std::size_t i = 0; i < further_cameras.size(); ++i) further_cameras[i].index = i + 1;
  const auto prepare = [&](CameraState& each) {
    const auto& depth = configuration.robot_at(index).depth_at(each.index);
    if (depth && configuration.scenario.level == 3) each.people.set_directions(depth->intrinsics);
  };
  prepare(camera);
  for (CameraState& further : further_cameras) prepare(further);
}

State::State(simulation::Simulation simulation_, const Configuration& configuration,
             std::unique_ptr<Executor> executor)
    : simulation(std::move(simulation_)), site(configuration), lasers(std::move(executor)) {
  for (std::size_t i = 0; i < configuration.robot_count(); ++i) robots.emplace_back(configuration, i);
  real.resize(robots.size());
  number_sensors(robots);
}

RobotState& State::robot(std::string_view name) {
  const auto found =
      std::find_if(robots.begin(), robots.end(), [&](const RobotState& each) { return each.name == name; });
  assert(found != robots.end());
  return *found;
}

TickContext State::context(const Configuration& configuration, SimulationTime now, Outputs& outputs,
                           std::size_t robot) {
  return {configuration, now, outputs, {scripts, grading.get()}, tally, robot};
}

ScanPath State::scan_path(RobotState& robot, std::size_t laser) {
  const bool first = laser == 0;
  return {robot.pose,
          first ? robot.scan : robot.further_lasers[laser - 1].scan,
          first ? robot.injection : robot.further_lasers[laser - 1].injection,
          robot.injection.gate,
          site,
          people_path(robot, laser),
          doors,
          simulation,
          real};
}

PeoplePath State::people_path(RobotState& robot, std::size_t laser) {
  PeopleState& people = laser == 0 ? robot.people : robot.further_lasers[laser - 1].people;
  return {people, bystanders, simulation};
}

DepthPeoplePath State::depth_people_path(RobotState& robot, std::size_t camera) {
  CameraState& state = camera == 0 ? robot.camera : robot.further_cameras[camera - 1];
  return {state.people, robot.pose, site, bystanders, simulation, real};
}

CameraPath State::camera_path(RobotState& robot, std::size_t camera) {
  CameraState& state = camera == 0 ? robot.camera : robot.further_cameras[camera - 1];
  return {robot.pose, robot.scan, robot.injection.gate, state, site, simulation};
}

CommandPath State::command_path(RobotState& robot) {
  return {robot.command, robot.pose, robot.encoders, robot.scan_silence, simulation};
}

AgentPath State::agent_path() { return {real, world.kinds, agent_cameras, simulation}; }

InstructorPath State::instructor_path() {
  std::vector<CommandPath> commands;
  for (RobotState& robot : robots) commands.push_back(command_path(robot));
  return {agent_path(), std::move(commands), scripts, faults, site, start_path()};
}

ScriptPath State::script_path() { return {scripts, agent_path()}; }

StartPath State::start_path() { return {waiting, simulation, scripts, faults}; }

OperatorPath State::operator_path(const TickContext& context) {
  return {operators,
          operator_admission,
          operator_refused,
          simulation,
          [this, &context](const std::string& name) {
            const auto robot = context.configuration.find_robot(name);
            if (!robot) return simulation.teleop(name, {});
            stop_robot(context.of_robot(*robot), command_path(robots[*robot]));
          },
          [this, &context](const std::string& name) {
            const auto robot = context.configuration.find_robot(name);
            return robot ? robots[*robot].command.dead_man.pressed : simulation.is_driven(name);
          },
          [this, &context](const std::string& name) {
            if (const auto robot = context.configuration.find_robot(name))
              robots[*robot].command.drivers.contest(context.now);
          }};
}

SensorPath State::sensor_path(RobotState& robot) {
  return {*robot.sensors,
          robot.pose,
          robot.scan,
          robot.injection,
          robot.further_lasers,
          robot.camera,
          robot.further_cameras,
          lasers,
          faults,
          site,
          simulation};
}

Result<std::unique_ptr<State>> make_state(const Configuration& configuration, ArrivalTime start,
                                          std::unique_ptr<Executor> executor, bool solve_all) {
  const Scenario& scenario = configuration.scenario;
  std::vector<RobotDescription> robots;
  for (std::size_t i = 0; i < configuration.robot_count(); ++i) robots.push_back(configuration.robot_at(i));
  auto simulation = simulation::Simulation::create(simulation_options(configuration, solve_all),
                                                   configuration.model, robots, simulation_time(start));
  if (!simulation) return simulation.error();
  if (const Status known = check_names(configuration); !known) return known.error();
  if (const Status known = check_scripts(configuration); !known) return known.error();
  if (const Status known = check_training(configuration); !known) return known.error();
  auto state = std::make_unique<State>(std::move(*simulation), configuration, std::move(executor));
  std::vector<std::string> trainees;
  for (const RobotDescription& robot : robots) trainees.push_back(robot.name);
  if (scenario.trainee) trainees.push_back(scenario.trainee->name);
  state->scripts = Scripts(scenario.scripts, std::move(trainees), simulation_time(start));
  state->faults.started = simulation_time(start);
  for (const Fault& fault : scenario.faults) state->faults.faults.push_back({fault});
  state->grading = make_grading(configuration, start);
  find_real_doors(configuration, configuration.model, state->simulation, state->doors);
  auto sensors = spawn_trainee(configuration, state->simulation);
  if (!sensors) return sensors.error();
  RobotState& robot = state->robots.front();
  robot.sensors = std::move(*sensors);
  if (robot.sensors) state->world.kinds[scenario.trainee->name] = AgentKind::robot;
  for (const ModelObject& object : configuration.objects) state->world.kinds[object.name] = AgentKind::box;
  if (const Status spawned = spawn_agents(configuration, *state); !spawned) return spawned.error();
  for (RobotState& each : state->robots) each.command.begin(start, !simulates_trainee(scenario));
  state->waiting = waits_for_start(scenario);
  if (state->waiting) state->simulation.wait();
  return state;
}

}  // namespace parhelion::tick
