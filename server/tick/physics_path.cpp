// Fixed steps up to an instant, and what they say: MR_WORLD, MR_EVENTS, HAZARD, the agents' own laser scans,
// a stop on silence.
#include <Eigen/Eigenvalues>
#include <cmath>
#include <exception>

#include "server/tick/agent_cameras.hpp"
#include "server/tick/grading_path.hpp"
#include "server/tick/sensor_path.hpp"
#include "server/tick/tick.hpp"

namespace parhelion::tick {
namespace {

constexpr double world_rate = 30;                 // Hz of MR_WORLD: what a page draws and a grader needs
constexpr double hazard_rate = 10;                // Hz of HAZARD
constexpr Duration obstacle_life = seconds(1.0);  // people walk on: what no scan has shown for longer is gone

/// The real robot as the simulation is to have it at an instant; none where the pose is not known.
std::optional<simulation::RealRobotState> real_robot_at(SimulationTime t, State& state) {
  if (!state.robot_clock.known()) return std::nullopt;
  const auto pose = robot_pose(state, state.robot_clock.to_sensor(t));
  if (!pose) return std::nullopt;
  simulation::RealRobotState real;
  real.T_map_base = pose->T_map_base;
  real.attitude_known = pose->attitude_known;
  real.twist = pose->twist;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> position(pose->covariance.topLeftCorner<2, 2>());
  real.sigma = std::sqrt(std::max(0.0, position.eigenvalues()(1)));
  real.relocalized = state.relocalized;
  real.sensed = injection_is_live(state, t);
  return real;
}

void note_pose(const Configuration& configuration, SimulationTime t, State& state, Outputs& outputs) {
  const bool known = state.real.has_value();
  if (known == state.pose_known) return;
  state.pose_known = known;
  Event event;
  event.stamp = t;
  event.kind = known ? EventKind::pose_recovered : EventKind::pose_lost;
  event.subject = configuration.robot.name;
  if (known) event.position = state.real->T_map_base.translation();
  publish_event(configuration, event, state, outputs);
}

/// Of what goes out `rate` times a second.
bool due(const Configuration& configuration, const State& state, double rate) {
  const double steps = configuration.scenario.physics_rate / rate;
  return state.step % static_cast<std::uint64_t>(std::max(1.0, std::round(steps))) == 0;
}

void publish_hazards(const Configuration& configuration, State& state, Outputs& outputs) {
  HazardReading reading;
  if (!state.simulation.hazard_reading(reading)) return;
  const Scenario& scenario = configuration.scenario;
  const double steps = std::max(1.0, std::round(scenario.physics_rate / hazard_rate));
  state.hazard_sensor.measure(scenario.hazard_sensor, scenario.seed, steps / scenario.physics_rate, reading);
  const SimulationTime now = state.simulation.now();
  reading.stamp = state.robot_clock.known() ? state.robot_clock.to_sensor(now) : SensorTime{now.ns};
  encode(reading, outputs.add(configuration.channels.bus(channel::hazard)));
}

/// For MR_STATUS.
void note_supply(const Configuration& configuration, State& state) {
  if (!simulates_trainee(configuration.scenario)) return;
  const simulation::SupplyState supply = state.simulation.supply_of(configuration.robot.name);
  state.tally.radio_power = supply.radio_power;
  state.tally.battery_left = supply.battery_left;
}

bool world_due(const Configuration& configuration, const State& state) {
  return due(configuration, state, world_rate) || state.simulation.scene()->version != state.scene_published;
}

void publish_world(const Configuration& configuration, State& state, Outputs& outputs) {
  WorldSnapshot& world = state.agent_laser.world_end;
  if (!state.simulation.at(state.simulation.now(), world)) return;
  WorldMessage& message = state.world_message;
  message.stamp = {world.stamp.ns};
  message.step = world.step;
  message.attitude_known = world.attitude_known;
  message.bodies.clear();
  auto definition = world.scene->bodies.begin();
  for (const BodyState& body : world.bodies) {
    while ((*definition)->id < body.id) ++definition;
    // In the model, which MR_SESSION embeds, but for doors that need not stand as it draws them.
    if ((*definition)->owner == BodyOwner::building && !((*definition)->moves && body.known)) continue;
    const auto kind = state.kinds.find((*definition)->entity);
    message.bodies.push_back({(*definition)->entity, (*definition)->part,
                              kind != state.kinds.end() ? kind->second : AgentKind::robot,
                              (*definition)->owner, body.epoch, body.T_map_body, body.velocity,
                              body.rotation_rate});
  }
  state.scene_published = world.scene->version;
  std::vector<std::uint8_t>& payload = outputs.add(configuration.channels.bus(channel::mr_world));
  encode(message, payload);
  grade_world(configuration, payload, state, outputs);
}

void step_once(const Configuration& configuration, State& state, Outputs& outputs, StageObserver& observer) {
  const SimulationTime next = state.simulation.next_step();
  const bool simulated = simulates_trainee(configuration.scenario);
  const bool exact = simulated && !configuration.scenario.trainee->slam;
  state.real = exact ? trainee_state(configuration, state) : real_robot_at(next, state);
  note_pose(configuration, next, state, outputs);
  if (!state.obstacles.empty() && next - state.obstacles_seen > obstacle_life) {
    state.obstacles.clear();
    state.simulation.set_real_obstacles(state.obstacles);
  }
  state.laser_requests.clear();
  state.simulation.step(simulated ? std::nullopt : state.real, state.laser_requests);
  state.relocalized = false;
  ++state.step;
  observer.ended(Stage::physics_step);
  publish_simulation_events(configuration, state, outputs);
  run_scripts(configuration, next, state, outputs);
  watch_lessons(configuration, next, state, outputs);
  answer_lasers(configuration, state, outputs);
  publish_sensors(configuration, next, state, outputs);
  take_agent_picture(configuration, next, state, outputs);
  watch_silence(configuration, next, state, outputs);
  watch_injection(configuration, next, state, outputs);
  watch_operators(configuration, next, state, outputs);
  watch_waiting_image(configuration, next, state, outputs);
  if (world_due(configuration, state)) publish_world(configuration, state, outputs);
  if (due(configuration, state, hazard_rate)) {
    publish_hazards(configuration, state, outputs);
    note_supply(configuration, state);
  }
  observer.ended(Stage::agents);
}

}  // namespace

void publish_event(const Configuration& configuration, const Event& event, State& state, Outputs& outputs) {
  ++state.tally.events[static_cast<std::size_t>(event.kind) % state.tally.events.size()];
  state.scripts.hear(event);
  std::vector<std::uint8_t>& payload = outputs.add(configuration.channels.bus(channel::mr_events));
  encode(event, payload);
  grade_event(configuration, payload, state, outputs);
}

void publish_simulation_events(const Configuration& configuration, State& state, Outputs& outputs) {
  for (const Event& event : state.simulation.take_events())
    publish_event(configuration, event, state, outputs);
}

void advance(const Configuration& configuration, ArrivalTime until, State& state, Outputs& outputs,
             StageObserver& observer) {
  while (state.simulation.next_step() <= simulation_time(until)) {
    const SimulationTime due = state.simulation.next_step();
    try {
      step_once(configuration, state, outputs, observer);
    } catch (const std::exception& fault) {
      // The server goes on, and with the next step at once: how often it is called must make no difference.
      refuse({std::string("physics: ") + fault.what()}, state);
      if (state.simulation.next_step() == due) state.simulation.skip(1);
    }
  }
}

}  // namespace parhelion::tick
