#include "server/tick/camera_path.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "protocols/codec.hpp"

namespace parhelion::tick {
namespace {

constexpr Duration kDepthPartner = milliseconds(50);       // a depth image further off in time is not used
constexpr Duration kSameMoment = milliseconds(5);          // shorter than the interval of any camera
constexpr Duration kLongestWait = milliseconds(50);        // for the depth image of the same moment
constexpr Duration kLongestDepthWait = milliseconds(110);  // for an image: its own wait included

const std::optional<CameraDescription>& camera_of(const TickContext& context, const CameraPath& path) {
  return context.robot().camera_at(path.camera.index);
}

const std::optional<DepthCameraDescription>& depth_of(const TickContext& context, const CameraPath& path) {
  return context.robot().depth_at(path.camera.index);
}

/// Only the first camera helps to find the robot's clock: another whose stamps are wrong harms itself alone.
bool is_on_robots_clock(const Message& input, SensorTime stamp, const CameraPath& path) {
  return path.camera.index == 0 ? path.pose.clock.add(input.arrival, stamp)
                                : path.pose.clock.agrees(input.arrival, stamp);
}

/// A job of this camera.
Outputs::Frame frame_of(const TickContext& context, const CameraPath& path, render::RenderJob job,
                        std::uint64_t sequence) {
  Outputs::Frame frame;
  frame.job = std::move(job);
  frame.sequence = record_number(context.robot_index, sequence, path.camera.index);
  frame.robot = context.robot_index;
  frame.camera = path.camera.index;
  return frame;
}

/// Passed through the render thread like all images, so that no original overtakes an earlier image in
/// rendering.
Outputs::Frame original(const TickContext& context, const CameraPath& path, Image image,
                        std::uint64_t sequence, const std::string& reason) {
  render::RenderJob job;
  job.image = std::move(image);
  Outputs::Frame frame = frame_of(context, path, std::move(job), sequence);
  frame.reason = reason;
  return frame;
}

/// Adds the depth image at its sensor's pose. False: the pose is not known.
bool add_depth(const DepthCameraDescription& camera, const CameraPath& path, render::RenderJob& job) {
  const Image& depth = *path.camera.depth;
  // By the stamps as they are: one driver gives both.
  const auto pose = robot_pose(path.pose, depth.stamp);
  const auto turn = pose::head_turn(camera.head, path.pose.joints, depth.stamp);
  if (!pose || !turn) return false;
  job.depth = depth;
  job.depth_camera = camera;
  job.T_map_depth = pose->T_map_base * *turn * camera.T_base_optical;
  job.depth_answered = std::exchange(path.camera.depth_answered, true);
  return true;
}

/// Adds the occluders: depth image and current scan, each at its own sensor pose.
void add_occluders(const TickContext& context, const CameraPath& path, render::RenderJob& job) {
  const RobotDescription& robot = context.robot();
  const std::optional<Image>& depth = path.camera.depth;
  const auto& depth_camera = depth_of(context, path);
  if (depth && depth_camera && std::abs((job.image.stamp - depth->stamp).ns) <= kDepthPartner.ns)
    (void)add_depth(*depth_camera, path, job);
  if (!path.scan.have_real || !robot.laser) return;
  const auto pose = robot_pose(path.pose, path.scan.real.stamp);
  if (!pose) return;
  job.scan = path.scan.real;
  job.laser = *robot.laser;
  job.T_map_laser = pose->T_map_base * robot.laser->T_base_laser;
}

/// A scan of about the same instant, whose pose is better known than that of an image between two scans.
bool has_recent_scan(const ScanState& scan, SensorTime t) {
  constexpr Duration recent = milliseconds(500);
  return scan.have_real && t - scan.real.stamp < recent && scan.real.stamp - t < recent;
}

/// Leaves out agents that are withheld from the scans. Without a recent scan, and beyond the laser's range,
/// those whose position in the image is too uncertain. Otherwise an agent in sight would flicker between
/// scans.
void leave_out_uncertain(const TickContext& context, const pose::PoseAtInstant& pose, SensorTime t,
                         const CameraPath& path, WorldSnapshot& world) {
  const double followed =
      has_recent_scan(path.scan, t) ? static_cast<double>(context.robot().laser->convention.range_max) : 0;
  std::vector<BodyState>& bodies = world.bodies;
  std::vector<const BodyDefinition*> definitions;
  for_each_body(world, [&](const BodyDefinition& body, const BodyState&) { definitions.push_back(&body); });
  std::size_t kept = 0;
  for (std::size_t begin = 0, end = 0; begin < bodies.size(); begin = end) {
    double worst = 0, nearest = std::numeric_limits<double>::infinity();
    for (end = begin; end < bodies.size() && definitions[end]->entity == definitions[begin]->entity; ++end) {
      const double error = pose::predicted_error(pose, bodies[end].T_map_body.translation());
      if (!(error <= worst)) worst = error;
      const Eigen::Vector3d offset = bodies[end].T_map_body.translation() - pose.T_map_base.translation();
      nearest = std::min(nearest, offset.norm());
    }
    const std::string& entity = definitions[begin]->entity;
    const bool shown =
        !definitions[begin]->injectable ||
        (nearest <= followed ? path.gate.shows(entity)
                             : path.gate.admit(entity, worst, world.stamp,
                                               context.configuration.scenario.injection, path.simulation));
    for (std::size_t i = begin; shown && i < end; ++i) bodies[kept++] = bodies[i];
  }
  bodies.resize(kept);
}

std::optional<Transform<Map, CameraOptical>> camera_at(const CameraDescription& camera, const PoseState& pose,
                                                       SensorTime t) {
  const auto at_t = robot_pose(pose, t);
  const auto turn = pose::head_turn(camera.head, pose.joints, t);
  if (!at_t || !turn) return std::nullopt;
  return at_t->T_map_base * *turn * camera.T_base_optical;
}

/// Exposure time of the row that shows a point, relative to the stamp of the middle row; none behind the
/// camera. Lens distortion is neglected: it moves a point by few rows.
std::optional<Duration> row_instant(const CameraDescription& camera, const Eigen::Vector3d& p_optical) {
  constexpr double nearest = 0.05;  // m
  if (p_optical.z() < nearest) return std::nullopt;
  const double row = camera.intrinsics.fy * p_optical.y() / p_optical.z() + camera.intrinsics.cy;
  const double place = std::clamp(row / std::max(camera.intrinsics.height - 1, 1), 0.0, 1.0);
  return seconds((place - 0.5) * camera.readout);
}

/// A rolling shutter shows each body at its pose relative to the camera when its row was read. The image is
/// rendered from the camera's pose at the middle row, so the body is moved to where it looks the same from
/// there. `middle`: the instant of that row.
void show_at_their_rows(const CameraDescription& camera, const CameraPath& path, SensorTime middle,
                        render::RenderJob& job) {
  if (!(camera.readout > 0)) return;
  WorldSnapshot then;
  for_each_body(job.world, [&](const BodyDefinition& definition, BodyState& body) {
    if (!definition.injectable || definition.shapes.empty()) return;
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    for (const Shape& shape : definition.shapes) center += shape.T_body_shape.translation();
    center /= static_cast<double>(definition.shapes.size());
    const auto after = row_instant(camera, job.T_map_optical.inverse() * (body.T_map_body * center));
    if (!after) return;
    const SensorTime t = middle + *after;
    const auto T_map_optical = camera_at(camera, path.pose, t);
    if (!T_map_optical || !path.simulation.at(path.pose.clock.to_server(t), then)) return;
    const auto same = std::lower_bound(then.bodies.begin(), then.bodies.end(), body.id,
                                       [](const BodyState& each, BodyId id) { return each.id < id; });
    if (same == then.bodies.end() || same->id != body.id || same->epoch != body.epoch) return;
    body.T_map_body = job.T_map_optical * T_map_optical->inverse() * same->T_map_body;
  });
}

/// Creates the render job for the image.
Outputs::Frame make_frame(const TickContext& context, WaitingImage waiting, const CameraPath& path) {
  render::RenderJob job;
  job.image = std::move(waiting.image);
  const auto unchanged = [&](const std::string& reason) {
    return original(context, path, std::move(job.image), waiting.sequence, reason);
  };
  job.camera = *camera_of(context, path);
  const SensorTime taken = job.image.stamp + seconds(job.camera.time_offset);
  pose::NoPose why{};
  const auto pose = robot_pose(path.pose, taken, &why);
  if (!pose) return unchanged(std::string("no pose: ") + to_string(why));
  const auto turn = pose::head_turn(job.camera.head, path.pose.joints, taken);
  if (!turn) return unchanged("camera head: " + turn.error().message);
  if (!path.simulation.at(path.pose.clock.to_server(taken), job.world))
    return unchanged("the world at the image's stamp is not known");
  leave_out_uncertain(context, *pose, taken, path, job.world);
  job.T_map_optical = pose->T_map_base * *turn * job.camera.T_base_optical;
  show_at_their_rows(job.camera, path, taken, job);
  job.floor_z = 0;
  add_occluders(context, path, job);
  Outputs::Frame frame = frame_of(context, path, std::move(job), waiting.sequence);
  frame.model = path.site.model;
  return frame;
}

/// A job for a depth image alone: one that no image of the camera was answered with.
Outputs::Frame make_depth_frame(const TickContext& context, std::uint64_t sequence, const CameraPath& path) {
  const auto& camera = depth_of(context, path);
  render::RenderJob job;
  job.image.stamp = path.camera.depth->stamp;
  const auto unchanged = [&](const std::string& reason) {
    render::RenderJob raw;
    raw.depth = *path.camera.depth;
    path.camera.depth_answered = true;
    Outputs::Frame frame = frame_of(context, path, std::move(raw), sequence);
    frame.reason = reason;
    return frame;
  };
  if (!camera) return unchanged("the robot description has no depth camera");
  pose::NoPose why{};
  const auto pose = robot_pose(path.pose, job.image.stamp, &why);
  if (!pose) return unchanged(std::string("no pose: ") + to_string(why));
  if (!path.simulation.at(path.pose.clock.to_server(job.image.stamp), job.world))
    return unchanged("the world at the depth image's stamp is not known");
  leave_out_uncertain(context, *pose, job.image.stamp, path, job.world);
  if (!add_depth(*camera, path, job)) return unchanged("the joints of the depth camera's head are not known");
  Outputs::Frame frame = frame_of(context, path, std::move(job), sequence);
  frame.model = path.site.model;
  return frame;
}

/// The depth image of the image's own instant, or a later one, has arrived.
bool depth_is_there(const CameraState& camera) {
  return camera.depth && camera.depth->stamp - camera.waiting->image.stamp >= -kSameMoment;
}

void answer_waiting_image(const TickContext& context, const CameraPath& path) {
  if (!path.camera.waiting) return;
  WaitingImage waiting = std::move(*path.camera.waiting);
  path.camera.waiting.reset();
  context.outputs.add_frame(make_frame(context, std::move(waiting), path));
}

void answer_waiting_depth(const TickContext& context, const CameraPath& path) {
  if (path.camera.depth_answered) return;
  ++context.tally.frames_in;
  context.outputs.add_frame(make_depth_frame(context, ++path.camera.sequence, path));
}

}  // namespace

void answer_waiting_images(const TickContext& context, const CameraPath& path) {
  answer_waiting_image(context, path);
  answer_waiting_depth(context, path);
}

void answer_overdue_images(const TickContext& context, const CameraPath& path) {
  const std::optional<WaitingImage>& waiting = path.camera.waiting;
  if (waiting && context.now - waiting->arrival >= kLongestWait) answer_waiting_image(context, path);
  if (context.now - path.camera.depth_arrival >= kLongestDepthWait) answer_waiting_depth(context, path);
}

void handle_image(const TickContext& context, const Message& input, const CameraPath& path) {
  Image image;
  if (const Status read = decode(input.channel, input.payload, image); !read)
    return refuse(context, read.error());
  ++context.tally.frames_in;
  const std::uint64_t sequence = ++path.camera.sequence;
  answer_waiting_image(context, path);
  const auto pass = [&](const std::string& reason) {
    context.outputs.add_frame(original(context, path, std::move(image), sequence, reason));
  };
  if (!camera_of(context, path)) return pass("the robot description has no camera calibration");
  if (!is_on_robots_clock(input, image.stamp, path)) return pass("the stamp is off the robot's clock");
  path.camera.waiting = WaitingImage{std::move(image), sequence, context.now};
  if (!depth_of(context, path) || depth_is_there(path.camera)) answer_waiting_image(context, path);
}

void handle_depth(const TickContext& context, const Message& input, const CameraPath& path) {
  CameraState& camera = path.camera;
  Image depth;
  if (const Status read = decode(input.channel, input.payload, depth); !read)
    return refuse(context, read.error());
  answer_waiting_depth(context, path);  // the one before
  camera.depth = std::move(depth);
  camera.depth_arrival = context.now;
  camera.depth_answered = false;
  if (camera.waiting && depth_is_there(camera)) answer_waiting_image(context, path);
  if (!camera_of(context, path)) answer_waiting_depth(context, path);
}

}  // namespace parhelion::tick
