#include "server/tick/sensor_path.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/tick/fault_path.hpp"
#include "server/tick/laser_path.hpp"
#include "server/tick/simulated_camera.hpp"

namespace parhelion::tick {
namespace {

constexpr double kRobotRate = 1;  // Hz, so that a late receiver soon gets the description
constexpr double kImuRate = 100;
constexpr double kJointRate = 30;
constexpr double kBumperRate = 10;  // and at each change
constexpr double kOdometryRate = 50;
constexpr double kPoseRate = 50;
constexpr double kScanRate = 10;    // of a laser whose description gives none
constexpr double kCameraRate = 15;  // of a camera whose description gives none
// Covariances of exact values: small, but never singular.
constexpr double kExactPosition = 1e-3;  // m
constexpr double kExactAngle = 1e-4;     // rad

/// Also publishes the payload of sensors.message on channel `name`.
const Message& publish_again(const TickContext& context, const char* name, SimulatedSensors& sensors,
                             std::size_t laser = 0) {
  Message& message = sensors.message;
  message.channel = context.channel(name, laser);
  context.outputs.add(message.channel).assign(message.payload.begin(), message.payload.end());
  return message;
}

/// Encodes and publishes a message; the result is to be handled as if a real robot had sent it, if the server
/// takes such messages as input.
template <class T>
const Message& publish(const TickContext& context, const char* name, const T& item, SimulatedSensors& sensors,
                       std::size_t laser = 0) {
  encode(item, sensors.message.payload);
  return publish_again(context, name, sensors, laser);
}

void publish_imu(const TickContext& context, const simulation::RobotMotion& motion, const SensorPath& path) {
  SimulatedSensors& sensors = path.sensors;
  const bool restart = std::exchange(sensors.imu_epoch, motion.epoch) != motion.epoch;
  const BaseMotion base{motion.T_map_base, motion.velocity, motion.rotation_rate};
  const ImuSample sample = sensors.imu->add({context.now.ns}, base, restart);
  handle_imu(context, publish(context, channel::kImu, sample, sensors), path.pose);
}

void publish_joints(const TickContext& context, const simulation::RobotMotion& motion,
                    const SensorPath& path) {
  if (motion.joints.names.empty()) return;
  Joints& joints = path.sensors.joints;
  joints = motion.joints;
  joints.stamp = {context.now.ns};
  (void)handle_joint_state(context, publish(context, channel::kJointState, joints, path.sensors), path.pose);
}

/// Positions: 1 for a bumper in contact, else 0.
void publish_bumpers(const TickContext& context, const simulation::RobotMotion& motion,
                     SimulatedSensors& sensors) {
  sensors.touching = motion.touching;
  Joints& bumpers = sensors.joints;
  bumpers = {{context.now.ns}, sensors.bumpers, {}, {}, {}};
  for (const std::string& link : sensors.bumpers) {
    const bool touches =
        std::find(motion.touching.begin(), motion.touching.end(), link) != motion.touching.end();
    bumpers.positions.push_back(touches ? 1 : 0);
  }
  publish(context, channel::kBumper, bumpers, sensors);
}

void publish_odometry(const TickContext& context, const simulation::RobotMotion& motion,
                      const SensorPath& path) {
  const Odometry odometry =
      path.sensors.odometry.add({context.now.ns}, motion.left, motion.right, motion.epoch);
  handle_odometry(context, publish(context, channel::kOdometry, odometry, path.sensors), path.pose);
}

/// Publishes POSE_COV for the server, like a localization, and POSE for others.
void publish_pose(const TickContext& context, const simulation::RobotMotion& motion, const SensorPath& path) {
  PoseEstimate estimate;
  estimate.stamp = {context.now.ns};
  estimate.T_map_base = motion.T_map_base;
  estimate.covariance.diagonal().head<3>().setConstant(kExactPosition * kExactPosition);
  estimate.covariance.diagonal().tail<3>().setConstant(kExactAngle * kExactAngle);
  estimate.map_id = current_model(context.configuration, path.site).map_id;
  estimate.state = SlamState::tracking;
  handle_pose_estimate(context, publish(context, channel::kPoseCov, estimate, path.sensors), path.site,
                       path.simulation, &path.sensors, path.pose);

  const Eigen::Matrix3d R_base_map = motion.T_map_base.rotation().transpose();
  const bool in_map = context.configuration.robot.velocity_frame == RobotDescription::VelocityFrame::local;
  PoseStamped pose;
  pose.stamp = estimate.stamp;
  pose.T_map_base = motion.T_map_base;
  pose.velocity = in_map ? motion.velocity : R_base_map * motion.velocity;
  pose.rotation_rate = R_base_map * motion.rotation_rate;
  pose.acceleration = R_base_map * motion.acceleration;
  publish(context, channel::kPose, pose, path.sensors);
}

/// MR_SCAN_INFO: the drawn body hit by each beam, as in an injected scan.
void name_hits(const LaserState& lasers, ScanInfo& info) {
  const LaserScratch& laser = lasers.scratch.front();
  const SweptWorld& sweep = lasers.sweeps[lasers.jobs.front().sweep];
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

/// A simulated laser measures the agents directly: nothing is injected, and MR_SCAN is SCAN.
void publish_scan(const TickContext& context, const simulation::RobotMotion& motion, SimulatedLaser& laser,
                  ScanState& state, ScanInjection& injection, const SensorPath& path) {
  simulation::LaserRequest& request = laser.request;
  request.stamp = context.now;
  request.T_map_laser = motion.T_map_base * request.laser.T_base_laser;
  Scan& scan = state.real;
  if (!simulate_laser(context.configuration, request, path.simulation, path.site.caster, path.lasers, scan))
    return;
  drop_beams(context.configuration, path.faults, request.laser,
             record_number(context.robot_index, state.sequence, state.laser), scan,
             path.lasers.scratch.front().body_hits);
  publish(context, channel::kScan, scan, path.sensors, state.laser);
  publish_again(context, channel::kMrScan, path.sensors, state.laser);
  state.have_real = true;
  injection.last_scan = context.now;
  ++state.sequence;
  ++context.tally.scans_in;
  ++context.tally.scans_out;
  context.tally.beams_total += scan.ranges.size();
  ScanInfo& info = state.info;
  info.stamp = scan.stamp;
  info.live = true;
  info.reason.clear();
  info.predicted_error = 0;
  name_hits(path.lasers, info);
  encode(info, context.outputs.add(context.channel(channel::kMrScanInfo, state.laser)));
  report_injection(context, {}, injection);
}

void publish_scans(const TickContext& context, const simulation::RobotMotion& motion, Duration running,
                   const SensorPath& path) {
  for (std::size_t i = 0; i < path.sensors.lasers.size(); ++i) {
    SimulatedLaser& laser = path.sensors.lasers[i];
    if (!laser.clock.due(running)) continue;
    if (i == 0) {
      publish_scan(context, motion, laser, path.scan, path.injection, path);
    } else {
      FurtherLaser& further = path.further_lasers[i - 1];
      publish_scan(context, motion, laser, further.scan, further.injection, path);
    }
  }
}

double rate_of(const LaserDescription& laser) {
  return laser.scan_period > 0 ? 1 / laser.scan_period : kScanRate;
}

SimulatedCameras clocks_of(const std::optional<CameraDescription>& camera,
                           const std::optional<DepthCameraDescription>& depth) {
  SimulatedCameras clocks;
  const auto set = [](const auto& described, std::optional<Cadence>& clock) {
    if (described) clock.emplace(described->rate > 0 ? described->rate : kCameraRate);
  };
  set(depth, clocks.depth_clock);
  set(depth, clocks.camera_clock);
  set(camera, clocks.camera_clock);
  return clocks;
}

void capture_due_images(const TickContext& context, const simulation::RobotMotion& motion, Duration running,
                        const SensorPath& path) {
  for (std::size_t i = 0; i < path.sensors.cameras.size(); ++i) {
    SimulatedCameras& cameras = path.sensors.cameras[i];
    if (cameras.camera_clock && cameras.camera_clock->due(running))
      capture_images(context, motion, path.simulation, path.site, path.sensors,
                     i == 0 ? path.camera : path.further_cameras[i - 1]);
  }
}

}  // namespace

SimulatedSensors::SimulatedSensors(const Configuration& configuration, const simulation::RobotModel& model,
                                   SimulationTime begin)
    : start(begin),
      robot(kRobotRate),
      imu_clock(kImuRate),
      joints_clock(kJointRate),
      bumper_clock(kBumperRate),
      odometry_clock(kOdometryRate),
      pose_clock(kPoseRate),
      odometry(model.drive.track,
               draw_wheel_errors(configuration.scenario.seed, configuration.robot.odometry_error_translation,
                                 configuration.robot.odometry_error_rotation, model.drive.track),
               configuration.scenario.seed),
      bumpers(model.bumpers) {
  if (configuration.robot.imu)
    imu.emplace(*configuration.robot.imu, ImuErrors{}, configuration.scenario.seed);
  for (std::size_t i = 0; i <= configuration.robot.further_cameras.size(); ++i)
    cameras.push_back(clocks_of(configuration.robot.camera_at(i), configuration.robot.depth_at(i)));
  for (std::size_t i = 0; i <= configuration.robot.further_lasers.size(); ++i) {
    const LaserDescription& laser = configuration.robot.laser_at(i);
    lasers.push_back({Cadence(rate_of(laser)), {}});
    lasers.back().request.agent = configuration.robot.name;
    lasers.back().request.laser = laser;
  }
}

Result<std::unique_ptr<SimulatedSensors>> spawn_trainee(const Configuration& configuration,
                                                        simulation::Simulation& simulation) {
  if (!simulates_trainee(configuration.scenario)) return std::unique_ptr<SimulatedSensors>();
  const Trainee& trainee = *configuration.scenario.trainee;
  AgentDefinition definition;
  definition.name = trainee.name;
  definition.kind = AgentKind::robot;
  definition.T_map_base = trainee.T_map_base;
  definition.model = trainee.model;
  const BodyId others = simulation.scene()->bodies.back()->id;
  if (const Status spawned = simulation.spawn_trainee(definition); !spawned)
    return Error{"scenario trainee '" + trainee.name + "': " + spawned.error().message};
  const auto model = std::find_if(configuration.robot_models.begin(), configuration.robot_models.end(),
                                  [&](const auto& each) { return each->name == trainee.model; });
  auto sensors = std::make_unique<SimulatedSensors>(configuration, **model, simulation.now());
  for (const auto& body : simulation.scene()->bodies) {
    if (body->id <= others) continue;
    for (SimulatedLaser& laser : sensors->lasers) laser.request.own_bodies.push_back(body->id);
  }
  return sensors;
}

std::optional<simulation::RealRobotState> trainee_state(const Configuration& configuration,
                                                        const simulation::Simulation& simulation) {
  if (!simulates_trainee(configuration.scenario)) return std::nullopt;
  const simulation::RobotMotion* motion = simulation.robot_motion(configuration.robot.name);
  if (motion == nullptr) return std::nullopt;
  simulation::RealRobotState robot;
  robot.T_map_base = motion->T_map_base;
  robot.attitude_known = true;
  const Eigen::Vector3d velocity = motion->T_map_base.rotation().transpose() * motion->velocity;
  robot.twist = {velocity.x(), velocity.y(), motion->rotation_rate.z()};
  return robot;
}

void check_slam_estimate(const Configuration& configuration, const SiteState& site,
                         const simulation::Simulation& simulation, SimulatedSensors& sensors,
                         PoseEstimate& estimate) {
  if (estimate.map_id.empty()) estimate.map_id = current_model(configuration, site).map_id;
  if (!simulation.at(SimulationTime{estimate.stamp.ns}, sensors.truth)) return;
  const BodyId base = sensors.lasers.front().request.own_bodies.front();
  for (const BodyState& body : sensors.truth.bodies) {
    if (body.id != base) continue;
    const Eigen::Vector3d off = estimate.T_map_base.translation() - body.T_map_body.translation();
    sensors.slam_error_um.add(off.head<2>().norm() * 1e6);
  }
}

std::string slam_note(const SimulatedSensors* sensors) {
  if (sensors == nullptr || sensors->slam_error_um.count() == 0) return {};
  const Percentiles& error = sensors->slam_error_um;
  char text[128];
  std::snprintf(text, sizeof text, "%llu poses, off by p50 %.3f m, p99 %.3f m, at most %.3f m",
                static_cast<unsigned long long>(error.count()), error.at(0.5) / 1e6, error.at(0.99) / 1e6,
                error.max() / 1e6);
  return text;
}

void publish_sensors(const TickContext& context, const SensorPath& path) {
  const Configuration& configuration = context.configuration;
  SimulatedSensors& sensors = path.sensors;
  const simulation::RobotMotion* motion = path.simulation.robot_motion(configuration.robot.name);
  if (motion == nullptr) return;
  const Duration running = context.now - sensors.start;
  sensors.message.arrival = {context.now.ns};
  if (sensors.robot.due(running))
    publish(context, channel::kRobot, RobotMessage{{context.now.ns}, to_yaml(configuration.robot)}, sensors);
  if (sensors.imu && sensors.imu_clock.due(running)) publish_imu(context, *motion, path);
  if (sensors.joints_clock.due(running)) publish_joints(context, *motion, path);
  const bool bumped = sensors.touching != motion->touching;
  if (!sensors.bumpers.empty() && (sensors.bumper_clock.due(running) || bumped))
    publish_bumpers(context, *motion, sensors);
  if (sensors.odometry_clock.due(running)) publish_odometry(context, *motion, path);
  if (!configuration.scenario.trainee->slam && sensors.pose_clock.due(running))
    publish_pose(context, *motion, path);
  publish_scans(context, *motion, running, path);
  capture_due_images(context, *motion, running, path);
}

}  // namespace parhelion::tick
