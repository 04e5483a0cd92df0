#include "server/tick/state.hpp"

#include "server/tick/agent_cameras.hpp"
#include "server/tick/check_training.hpp"
#include "server/tick/door_sight.hpp"
#include "server/tick/grading_path.hpp"
#include "server/tick/sensor_path.hpp"
#include "server/tick/tick.hpp"

namespace parhelion::tick {
namespace {

constexpr BodyId bodies_of_later_buildings = BodyId{1} << 22;  // a thousand each for four thousand versions

pose::PoseTrackOptions track_options(const Configuration& configuration) {
  pose::PoseTrackOptions options;
  options.map_id = configuration.model.map_id;
  return options;
}

std::vector<std::vector<HeadJoint>> heads(const RobotDescription& robot) {
  std::vector<std::vector<HeadJoint>> all;
  if (robot.camera) all.push_back(robot.camera->head);
  if (robot.depth) all.push_back(robot.depth->head);
  if (robot.line_laser) all.push_back(robot.line_laser->head);
  return all;
}

}  // namespace

State::State(simulation::Simulation simulation_, const Configuration& configuration,
             std::unique_ptr<Executor> executor_)
    : simulation(std::move(simulation_)),
      track(configuration.robot, track_options(configuration)),
      attitude(configuration.robot.imu),
      joints(heads(configuration.robot)),
      executor(std::move(executor_)) {
  caster.set_building(scan::BuildingTree(configuration.model, scan::BuildingTree::Doors::left_out));
  agent_laser.benches.resize(static_cast<std::size_t>(executor->size()));
}

State::~State() = default;

std::optional<pose::PoseAtInstant> robot_pose(const State& state, SensorTime t, pose::NoPose* why) {
  auto pose = state.track.at(t, why);
  if (!pose) return pose;
  if (const auto attitude = state.attitude.at(t)) {
    pose->T_map_base = pose::with_attitude(pose->T_map_base, *attitude);
    pose->attitude_known = true;
  }
  return pose;
}

Result<std::unique_ptr<State>> make_state(const Configuration& configuration, ArrivalTime start,
                                          std::unique_ptr<Executor> executor, bool solve_all) {
  simulation::SimulationOptions options;
  options.rate = configuration.scenario.physics_rate;
  options.seed = configuration.scenario.seed;
  options.solve_all = solve_all;
  options.zones = configuration.scenario.zones;
  options.hazards = configuration.scenario.hazards;
  options.radio = configuration.scenario.radio;
  options.battery = configuration.scenario.battery;
  for (const Lesson& lesson : configuration.scenario.lessons) {
    if (lesson.kind != Lesson::Kind::low_battery) continue;
    if (!options.battery) options.battery.emplace();
    options.battery->charge = lesson.amount;
  }
  options.most_agents = static_cast<std::size_t>(configuration.scenario.most_agents);
  options.level = configuration.scenario.level;
  options.doors = configuration.scenario.doors;
  options.robot_models = configuration.robot_models;
  if (configuration.scenario.mapping) options.building_bodies = bodies_of_later_buildings;
  auto simulation = simulation::Simulation::create(options, configuration.model, configuration.robot,
                                                   simulation_time(start));
  if (!simulation) return simulation.error();
  if (const Status known = check_scripts(configuration); !known) return known.error();
  if (const Status known = check_training(configuration); !known) return known.error();
  auto state = std::make_unique<State>(std::move(*simulation), configuration, std::move(executor));
  std::vector<std::string> trainees{configuration.robot.name};
  if (configuration.scenario.trainee) trainees.push_back(configuration.scenario.trainee->name);
  state->scripts = Scripts(configuration.scenario.scripts, std::move(trainees), simulation_time(start));
  state->started = simulation_time(start);
  for (const Lesson& lesson : configuration.scenario.lessons) state->lessons.push_back({lesson});
  state->grading = make_grading(configuration, start);
  find_real_doors(configuration, configuration.model, *state);
  if (const Status begun = spawn_trainee(configuration, *state); !begun) return begun.error();
  for (const AgentDefinition& agent : configuration.scenario.agents) {
    if (const Status spawned = state->simulation.spawn(agent, std::nullopt); !spawned) {
      return Error{"scenario agent '" + agent.name + "': " + spawned.error().message};
    }
    state->kinds[agent.name] = agent.kind;
    if (agent.camera_rate == 0) continue;
    if (const Status filmed = set_agent_camera(configuration, agent, *state); !filmed)
      return Error{"scenario agent '" + agent.name + "': " + filmed.error().message};
  }
  return state;
}

}  // namespace parhelion::tick
