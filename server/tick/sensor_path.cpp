#include "server/tick/sensor_path.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "server/tick/tick.hpp"

namespace parhelion::tick {
namespace {

constexpr double robot_rate = 1;  // Hz; whoever starts later waits no longer for the description
constexpr double imu_rate = 100;
constexpr double joint_rate = 30;
constexpr double bumper_rate = 10;  // and at each change
constexpr double odometry_rate = 50;
constexpr double pose_rate = 50;
constexpr double scan_rate = 10;    // of a laser whose description says none
constexpr double camera_rate = 15;  // of a camera, the same
// What is known exactly is said to be known to a millimetre: no covariance may be singular.
constexpr double exact_position = 1e-3;  // m
constexpr double exact_angle = 1e-4;     // rad

/// A sensor's word is an output, and then an input of the same instant.
void send(const Configuration& configuration, const char* name, InputKind kind, State& state,
          Outputs& outputs) {
  StageObserver unmeasured;
  Message& message = state.sensors->message;
  message.channel = configuration.channels.bus(name);
  std::vector<std::uint8_t>& out = outputs.add(message.channel);
  out.assign(message.payload.begin(), message.payload.end());
  if (kind != InputKind::none) take_input(configuration, kind, {}, message, state, outputs, unmeasured);
}

template <class T>
void send(const Configuration& configuration, const char* name, InputKind kind, const T& word, State& state,
          Outputs& outputs) {
  encode(word, state.sensors->message.payload);
  send(configuration, name, kind, state, outputs);
}

void send_imu(const Configuration& configuration, SensorTime stamp, const simulation::RobotMotion& motion,
              State& state, Outputs& outputs) {
  SimulatedSensors& sensors = *state.sensors;
  const bool restart = std::exchange(sensors.imu_epoch, motion.epoch) != motion.epoch;
  const BaseMotion base{motion.T_map_base, motion.velocity, motion.rotation_rate};
  send(configuration, channel::imu, InputKind::imu, sensors.imu->add(stamp, base, restart), state, outputs);
}

void send_joints(const Configuration& configuration, SensorTime stamp, const simulation::RobotMotion& motion,
                 State& state, Outputs& outputs) {
  if (motion.joints.names.empty()) return;
  Joints& joints = state.sensors->joints;
  joints = motion.joints;
  joints.stamp = stamp;
  send(configuration, channel::joint_state, InputKind::joint_state, joints, state, outputs);
}

/// Positions: 1 of a bumper that touches something, else 0.
void send_bumpers(const Configuration& configuration, SensorTime stamp, const simulation::RobotMotion& motion,
                  State& state, Outputs& outputs) {
  SimulatedSensors& sensors = *state.sensors;
  sensors.touching = motion.touching;
  Joints& bumpers = sensors.joints;
  bumpers = {stamp, sensors.bumpers, {}, {}, {}};
  for (const std::string& link : sensors.bumpers) {
    const bool touches =
        std::find(motion.touching.begin(), motion.touching.end(), link) != motion.touching.end();
    bumpers.positions.push_back(touches ? 1 : 0);
  }
  send(configuration, channel::bumper, InputKind::none, bumpers, state, outputs);
}

/// POSE_COV for the server, as a localization would give it, and POSE for others.
void send_pose(const Configuration& configuration, SensorTime stamp, const simulation::RobotMotion& motion,
               State& state, Outputs& outputs) {
  PoseEstimate estimate;
  estimate.stamp = stamp;
  estimate.T_map_base = motion.T_map_base;
  estimate.covariance.diagonal().head<3>().setConstant(exact_position * exact_position);
  estimate.covariance.diagonal().tail<3>().setConstant(exact_angle * exact_angle);
  estimate.map_id = (state.model ? *state.model : configuration.model).map_id;
  estimate.state = SlamState::tracking;
  send(configuration, channel::pose_cov, InputKind::pose_cov, estimate, state, outputs);

  const Eigen::Matrix3d R_base_map = motion.T_map_base.rotation().transpose();
  const bool in_map = configuration.robot.velocity_frame == RobotDescription::VelocityFrame::local;
  PoseStamped pose;
  pose.stamp = stamp;
  pose.T_map_base = motion.T_map_base;
  pose.velocity = in_map ? motion.velocity : R_base_map * motion.velocity;
  pose.rotation_rate = R_base_map * motion.rotation_rate;
  pose.acceleration = R_base_map * motion.acceleration;
  send(configuration, channel::pose, InputKind::none, pose, state, outputs);
}

/// Whose body each beam hit: of what was drawn into the site, as in a scan that was injected into.
void name_hits(State& state) {
  const AgentScanPath& path = state.agent_laser;
  const LaserBench& laser = path.benches.front();
  const SweptWorld& sweep = path.sweeps[path.jobs.front().sweep];
  ScanInfo& info = state.scan.info;
  info.agents.clear();
  info.beam_agent.assign(laser.body_hits.size(), -1);
  for (std::size_t i = 0; i < laser.body_hits.size(); ++i) {
    const scan::RangeHit& hit = laser.body_hits[i];
    if (hit.body < 0 || hit.range > laser.building_hits[i].range) continue;
    const BodyDefinition& body = *sweep.motions[static_cast<std::size_t>(hit.body)].body;
    if (!body.injectable) continue;
    auto found = std::find(info.agents.begin(), info.agents.end(), body.entity);
    if (found == info.agents.end()) found = info.agents.insert(found, body.entity);
    info.beam_agent[i] = static_cast<std::int16_t>(found - info.agents.begin());
  }
}

/// A simulated laser sees the agents itself: there is nothing to inject, and MR_SCAN is SCAN.
void send_scan(const Configuration& configuration, const simulation::RobotMotion& motion, SimulationTime now,
               State& state, Outputs& outputs) {
  SimulatedSensors& sensors = *state.sensors;
  sensors.laser.stamp = now;
  sensors.laser.T_map_laser = motion.T_map_base * sensors.laser.laser.T_base_laser;
  ScanPath& path = state.scan;
  Scan& scan = path.real;
  if (!simulate_laser(configuration, sensors.laser, state, scan)) return;
  drop_beams(configuration, state, scan);
  send(configuration, channel::scan, InputKind::none, scan, state, outputs);
  send(configuration, channel::mr_scan, InputKind::none, state, outputs);
  path.have_real = true;
  path.last_scan = now;
  ++path.sequence;
  ++state.tally.scans_in;
  ++state.tally.scans_out;
  state.tally.beams_total += scan.ranges.size();
  path.info.stamp = scan.stamp;
  path.info.live = true;
  path.info.reason.clear();
  path.info.predicted_error = 0;
  name_hits(state);
  encode(path.info, outputs.add(configuration.channels.bus(channel::mr_scan_info)));
  note_injection(configuration, now, {}, state, outputs);
}

double rate_of(const LaserDescription& laser) {
  return laser.scan_period > 0 ? 1 / laser.scan_period : scan_rate;
}

}  // namespace

bool Cadence::due(Duration since_start) {
  // A step is a rounded number of nanoseconds after the start: half a microsecond decides nothing.
  const auto periods = static_cast<std::int64_t>(std::floor((since_start.seconds() + 5e-7) * rate_));
  if (periods == last_) return false;
  last_ = periods;
  return true;
}

SimulatedSensors::SimulatedSensors(const Configuration& configuration, const simulation::RobotModel& model,
                                   SimulationTime begin)
    : start(begin),
      robot(robot_rate),
      imu_clock(imu_rate),
      joints_clock(joint_rate),
      bumper_clock(bumper_rate),
      odometry_clock(odometry_rate),
      pose_clock(pose_rate),
      scan_clock(rate_of(*configuration.robot.laser)),
      odometry(model.drive.track,
               draw_wheel_errors(configuration.scenario.seed, configuration.robot.odometry_error_translation,
                                 configuration.robot.odometry_error_rotation, model.drive.track),
               configuration.scenario.seed),
      bumpers(model.bumpers) {
  if (configuration.robot.imu)
    imu.emplace(*configuration.robot.imu, ImuErrors{}, configuration.scenario.seed);
  const auto set = [](const auto& camera, std::optional<Cadence>& clock) {
    if (camera) clock.emplace(camera->rate > 0 ? camera->rate : camera_rate);
  };
  set(configuration.robot.depth, depth_clock);
  set(configuration.robot.depth, camera_clock);
  set(configuration.robot.camera, camera_clock);
  laser.agent = configuration.robot.name;
  laser.laser = *configuration.robot.laser;
}

Status spawn_trainee(const Configuration& configuration, State& state) {
  if (!simulates_trainee(configuration.scenario)) return {};
  const Trainee& trainee = *configuration.scenario.trainee;
  AgentDefinition definition;
  definition.name = trainee.name;
  definition.kind = AgentKind::robot;
  definition.T_map_base = trainee.T_map_base;
  definition.model = trainee.model;
  const BodyId others = state.simulation.scene()->bodies.back()->id;
  if (const Status spawned = state.simulation.spawn_trainee(definition); !spawned)
    return Error{"scenario trainee '" + trainee.name + "': " + spawned.error().message};
  state.kinds[trainee.name] = AgentKind::robot;
  const auto model = std::find_if(configuration.robot_models.begin(), configuration.robot_models.end(),
                                  [&](const auto& each) { return each->name == trainee.model; });
  state.sensors = std::make_unique<SimulatedSensors>(configuration, **model, state.simulation.now());
  for (const auto& body : state.simulation.scene()->bodies) {
    if (body->id > others) state.sensors->laser.own_bodies.push_back(body->id);
  }
  return {};
}

std::optional<simulation::RealRobotState> trainee_state(const Configuration& configuration,
                                                        const State& state) {
  if (!simulates_trainee(configuration.scenario)) return std::nullopt;
  const simulation::RobotMotion* motion = state.simulation.robot_motion(configuration.robot.name);
  if (motion == nullptr) return std::nullopt;
  simulation::RealRobotState robot;
  robot.T_map_base = motion->T_map_base;
  robot.attitude_known = true;
  const Eigen::Vector3d velocity = motion->T_map_base.rotation().transpose() * motion->velocity;
  robot.twist = {velocity.x(), velocity.y(), motion->rotation_rate.z()};
  return robot;
}

void take_slam_word(const Configuration& configuration, PoseEstimate& estimate, State& state) {
  if (!state.sensors) return;
  if (estimate.map_id.empty()) estimate.map_id = (state.model ? *state.model : configuration.model).map_id;
  SimulatedSensors& sensors = *state.sensors;
  if (!state.simulation.at(SimulationTime{estimate.stamp.ns}, sensors.truth)) return;
  const BodyId base = sensors.laser.own_bodies.front();
  for (const BodyState& body : sensors.truth.bodies) {
    if (body.id != base) continue;
    const Eigen::Vector3d off = estimate.T_map_base.translation() - body.T_map_body.translation();
    sensors.slam_error_um.add(off.head<2>().norm() * 1e6);
  }
}

std::string slam_note(const State& state) {
  if (!state.sensors || state.sensors->slam_error_um.count() == 0) return {};
  const Percentiles& error = state.sensors->slam_error_um;
  char text[128];
  std::snprintf(text, sizeof text, "%llu poses, off by p50 %.3f m, p99 %.3f m, at most %.3f m",
                static_cast<unsigned long long>(error.count()), error.at(0.5) / 1e6, error.at(0.99) / 1e6,
                error.max() / 1e6);
  return text;
}

void publish_sensors(const Configuration& configuration, SimulationTime now, State& state, Outputs& outputs) {
  if (!state.sensors) return;
  SimulatedSensors& sensors = *state.sensors;
  const simulation::RobotMotion* motion = state.simulation.robot_motion(configuration.robot.name);
  if (motion == nullptr) return;
  const Duration running = now - sensors.start;
  const SensorTime stamp{now.ns};
  sensors.message.arrival = {now.ns};
  if (sensors.robot.due(running))
    send(configuration, channel::robot, InputKind::none, RobotMessage{stamp, to_yaml(configuration.robot)},
         state, outputs);
  if (sensors.imu && sensors.imu_clock.due(running)) send_imu(configuration, stamp, *motion, state, outputs);
  if (sensors.joints_clock.due(running)) send_joints(configuration, stamp, *motion, state, outputs);
  const bool bumped = sensors.touching != motion->touching;
  if (!sensors.bumpers.empty() && (sensors.bumper_clock.due(running) || bumped))
    send_bumpers(configuration, stamp, *motion, state, outputs);
  if (sensors.odometry_clock.due(running)) {
    const Odometry odometry = sensors.odometry.add(stamp, motion->left, motion->right, motion->epoch);
    send(configuration, channel::odometry, InputKind::odometry, odometry, state, outputs);
  }
  if (!configuration.scenario.trainee->slam && sensors.pose_clock.due(running))
    send_pose(configuration, stamp, *motion, state, outputs);
  if (sensors.scan_clock.due(running)) send_scan(configuration, *motion, now, state, outputs);
  if (sensors.camera_clock && sensors.camera_clock->due(running))
    take_picture(configuration, *motion, now, state, outputs);
}

}  // namespace parhelion::tick
