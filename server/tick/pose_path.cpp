#include "server/tick/pose_path.hpp"

#include <cmath>
#include <cstdio>

#include "protocols/codec.hpp"
#include "server/tick/sensor_path.hpp"

namespace parhelion::tick {
namespace {

pose::PoseTrackOptions track_options(const Configuration& configuration) {
  pose::PoseTrackOptions options;
  options.map_id = configuration.model.map_id;
  if (options.map_id.empty() && configuration.map) options.map_id = configuration.map->id;
  return options;
}

std::vector<std::vector<HeadJoint>> heads(const RobotDescription& robot) {
  std::vector<std::vector<HeadJoint>> all;
  if (robot.camera) all.push_back(robot.camera->head);
  if (robot.depth) all.push_back(robot.depth->head);
  for (const NamedCameras& each : robot.further_cameras) {
    if (each.camera) all.push_back(each.camera->head);
    if (each.depth) all.push_back(each.depth->head);
  }
  if (robot.line_laser) all.push_back(robot.line_laser->head);
  return all;
}

void apply_estimate(const TickContext& context, const Message& input, const PoseEstimate& estimate,
                    PoseState& pose) {
  if (!pose.clock.known()) pose.clock.add(input.arrival, estimate.stamp);
  if (pose.track.add(estimate) != pose::PoseTrack::Correction::relocalization) return;
  // A simulated robot that tips over is still localized.
  if (is_exact(context.configuration.scenario)) return;
  pose.relocalized = true;
  Event event;
  event.stamp = context.now;
  event.kind = EventKind::relocalized;
  event.subject = context.robot().name;
  event.position = estimate.T_map_base.translation();
  publish_event(context, event);
}

/// Whether `now` is another estimate than `before`, and known well enough to say so.
bool has_changed(const OdometryCorrection& before, const OdometryCorrection& now,
                 const Eigen::Vector3d& sigma) {
  constexpr double offset = 0.05, scale = 0.03;  // s; an odometry that is wrong by this shows in a prediction
  constexpr double sure = 3;                     // sigma
  const auto beyond = [](double change, double limit, double one_sigma) {
    return std::abs(change) > limit && sure * one_sigma < limit;
  };
  return beyond(now.time_offset - before.time_offset, offset, sigma[0]) ||
         beyond(now.translation_scale - before.translation_scale, scale, sigma[1]) ||
         beyond(now.rotation_scale - before.rotation_scale, scale, sigma[2]);
}

void report_odometry(const TickContext& context, PoseState& pose) {
  const OdometryCorrection now = pose.track.calibration().estimate();
  if (!has_changed(pose.reported_odometry, now, pose.track.calibration().sigma())) return;
  pose.reported_odometry = now;
  char text[120];
  std::snprintf(text, sizeof text, "time offset %+.3f s, translation times %.3f, rotation times %.3f",
                now.time_offset, now.translation_scale, now.rotation_scale);
  Event event;
  event.stamp = context.now;
  event.kind = EventKind::odometry_changed;
  event.subject = context.robot().name;
  event.value = now.time_offset;
  event.text = text;
  publish_event(context, event);
}

}  // namespace

bool is_exact(const Scenario& scenario) { return simulates_trainee(scenario) && !scenario.trainee->slam; }

PoseState::PoseState(const Configuration& configuration, const RobotDescription& robot)
    : track(robot, track_options(configuration)), attitude(robot.imu), joints(heads(robot)) {
  if (configuration.map) refiner.emplace(*robot.laser, configuration.map);
}

std::optional<pose::PoseAtInstant> robot_pose(const PoseState& pose, SensorTime t, pose::NoPose* why) {
  auto at_t = pose.track.at(t, why);
  if (!at_t) return at_t;
  if (const auto attitude = pose.attitude.at(t)) {
    at_t->T_map_base = pose::with_attitude(at_t->T_map_base, *attitude);
    at_t->attitude_known = true;
  }
  return at_t;
}

pose::RefinedPose match_scan(const Scan& scan, PoseState& pose) {
  pose::RefinedPose refined;
  if (!pose.refiner) return refined;
  auto prior = pose.track.match_prior(scan.stamp);
  if (!prior) {
    refined.match = pose::ScanMatch::no_prior;
    return refined;
  }
  prior->attitude = pose.attitude.at(scan.stamp);
  refined = pose.refiner->refine(scan, *prior);
  if (refined.match == pose::ScanMatch::matched)
    pose.track.refine(scan.stamp, refined.T_map_base, refined.covariance, refined.twist);
  return refined;
}

void handle_odometry(const TickContext& context, const Message& input, PoseState& pose) {
  Odometry odometry;
  if (const Status read = decode(input.channel, input.payload, odometry); !read)
    return refuse(context, read.error());
  if (!pose.clock.add(input.arrival, odometry.stamp)) return;
  pose.track.add(odometry);
  report_odometry(context, pose);
}

void handle_imu(const TickContext& context, const Message& input, PoseState& pose) {
  ImuSample sample;
  if (const Status read = decode(input.channel, input.payload, sample); !read)
    return refuse(context, read.error());
  if (pose.clock.add(input.arrival, sample.stamp)) pose.attitude.add(sample);
}

Status handle_joint_state(const TickContext& context, const Message& input, PoseState& pose) {
  constexpr std::size_t max_joints = 256;
  Joints& joints = pose.joint_state;
  if (const Status read = decode(input.channel, input.payload, joints); !read) {
    refuse(context, read.error());
    joints = {};
    return read;
  }
  if (!pose.clock.add(input.arrival, joints.stamp)) {
    joints = {};
    return {};
  }
  pose.joints.add(joints);
  for (std::size_t i = 0; i < joints.positions.size(); ++i) {
    auto known = pose.joint_positions.find(joints.names[i]);
    if (known == pose.joint_positions.end()) {
      if (pose.joint_positions.size() == max_joints) continue;
      known = pose.joint_positions.try_emplace(joints.names[i]).first;
    }
    known->second = {joints.positions[i], context.now};
  }
  return {};
}

/// POSE has no quality: it counts as valid while it arrives.
void handle_pose(const TickContext& context, const Message& input, PoseState& pose) {
  PoseStamped stamped;
  if (const Status read = decode(input.channel, input.payload, stamped); !read)
    return refuse(context, read.error());
  const PoseInput& known = *context.configuration.scenario.pose;
  PoseEstimate estimate;
  estimate.stamp = stamped.stamp;
  estimate.T_map_base = stamped.T_map_base;
  estimate.covariance.diagonal().head<3>().setConstant(known.position_sigma * known.position_sigma);
  estimate.covariance.diagonal().tail<3>().setConstant(known.yaw_sigma * known.yaw_sigma);
  estimate.map_id = known.map_id.empty() ? context.configuration.model.map_id : known.map_id;
  estimate.state = SlamState::tracking;
  apply_estimate(context, input, estimate, pose);
}

void handle_pose_estimate(const TickContext& context, const Message& input, const SiteState& site,
                          const simulation::Simulation& simulation, SimulatedSensors* sensors,
                          PoseState& pose) {
  PoseEstimate estimate;
  if (const Status read = decode(input.channel, input.payload, estimate); !read)
    return refuse(context, read.error());
  if (estimate.step_time.ns > 0)
    context.tally.slam_us.add(estimate.step_time.microseconds());  // 0: not measured
  if (!estimate.causal)
    return refuse(context,
                  {input.channel + ": a pose computed with later data cannot be used for injection"});
  if (sensors != nullptr && !is_exact(context.configuration.scenario))
    check_slam_estimate(context.configuration, site, simulation, *sensors, estimate);
  apply_estimate(context, input, estimate, pose);
}

}  // namespace parhelion::tick
