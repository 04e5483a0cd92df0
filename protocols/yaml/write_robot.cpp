// Robot descriptions as YAML; protocols/robot.cpp reads them.
#include "protocols/robot.hpp"
#include "protocols/yaml/head.hpp"
#include "protocols/yaml/laser.hpp"
#include "protocols/yaml/parts.hpp"
#include "protocols/yaml/robot_names.hpp"
#include "protocols/yaml/schema.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion {
namespace {

using yaml::Quantity;

void write_intrinsics(yaml::Writer& writer, const CameraIntrinsics& camera) {
  writer.integer("width", camera.width);
  writer.integer("height", camera.height);
  writer.quantity("fx", camera.fx, Quantity::pixels);
  writer.quantity("fy", camera.fy, Quantity::pixels);
  writer.quantity("cx", camera.cx, Quantity::pixels);
  writer.quantity("cy", camera.cy, Quantity::pixels);
  writer.word("lens", kLensNames.at(static_cast<std::size_t>(camera.lens)));
  const std::size_t count =
      camera.lens == CameraIntrinsics::Lens::fisheye && camera.distortion[4] == 0 ? 4 : 5;
  std::string list;
  for (std::size_t i = 0; i < count; ++i)
    list += (i > 0 ? ", " : "") + yaml::format_number(camera.distortion.at(i));
  writer.line("distortion", "[" + list + "]");
}

void write_odometry(yaml::Writer& writer, const OdometryCorrection& correction) {
  if (correction == OdometryCorrection{}) return;
  writer.open("odometry");
  writer.number("translation_scale", correction.translation_scale);
  writer.number("rotation_scale", correction.rotation_scale);
  writer.quantity("curvature", correction.curvature, Quantity::curvature);
  writer.quantity("time_offset", correction.time_offset, Quantity::time);
  writer.close();
}

void write_attitude(yaml::Writer& writer, const AttitudeLimits& limits) {
  writer.open("attitude");
  writer.quantity("pitch_warning", limits.pitch_warning, Quantity::angle);
  writer.quantity("pitch_limit", limits.pitch_limit, Quantity::angle);
  writer.quantity("roll_warning", limits.roll_warning, Quantity::angle);
  writer.quantity("roll_limit", limits.roll_limit, Quantity::angle);
  writer.quantity("yaw_rate_warning", limits.yaw_rate_warning, Quantity::angular_speed);
  writer.quantity("yaw_rate_limit", limits.yaw_rate_limit, Quantity::angular_speed);
  writer.close();
}

void write_further_lasers(yaml::Writer& writer, const std::vector<NamedLaser>& lasers) {
  if (lasers.empty()) return;
  writer.open("lasers");
  for (const NamedLaser& each : lasers) {
    writer.begin_item();
    writer.text("name", each.name);
    yaml::write_laser(writer, each.laser);
    writer.end_item();
  }
  writer.close();
}

void write_lasers(yaml::Writer& writer, const RobotDescription& robot) {
  if (robot.laser) {
    writer.open("laser");
    yaml::write_laser(writer, *robot.laser);
    writer.close();
  }
  write_further_lasers(writer, robot.further_lasers);
  if (robot.line_laser) {
    writer.open("line_laser");
    yaml::write_laser(writer, robot.line_laser->laser);
    yaml::write_head(writer, robot.line_laser->head);
    writer.close();
  }
}

/// Where the camera is and how it projects.
void write_any_camera(yaml::Writer& writer, const auto& camera) {
  writer.line("pose", yaml::format_camera_isometry(camera.T_base_optical.isometry()));
  yaml::write_head(writer, camera.head);
  write_intrinsics(writer, camera.intrinsics);
}

void write_camera(yaml::Writer& writer, const CameraDescription& camera) {
  writer.open("camera");
  write_any_camera(writer, camera);
  writer.quantity("readout", camera.readout, Quantity::time);
  if (camera.time_offset != 0) writer.quantity("time_offset", camera.time_offset, Quantity::time);
  writer.quantity("rate", camera.rate, Quantity::rate);
  writer.quantity("noise", camera.noise, Quantity::digital_number);
  writer.text("source", camera.source);
  writer.close();
}

void write_depth(yaml::Writer& writer, const DepthCameraDescription& depth) {
  writer.open("depth");
  write_any_camera(writer, depth);
  writer.quantity("range_min", depth.range_min, Quantity::length);
  writer.quantity("range_max", depth.range_max, Quantity::length);
  writer.quantity("rate", depth.rate, Quantity::rate);
  writer.quantity("noise", depth.noise, Quantity::length);
  writer.quantity("baseline", depth.baseline, Quantity::length);
  writer.quantity("disparity_noise", depth.disparity_noise, Quantity::pixels);
  writer.quantity("disparity_step", depth.disparity_step, Quantity::pixels);
  writer.text("source", depth.source);
  writer.close();
}

void write_cameras(yaml::Writer& writer, const RobotDescription& robot) {
  if (robot.camera) write_camera(writer, *robot.camera);
  if (robot.depth) write_depth(writer, *robot.depth);
  if (robot.further_cameras.empty()) return;
  writer.open("cameras");
  for (const NamedCameras& each : robot.further_cameras) {
    writer.begin_item();
    writer.text("name", each.name);
    if (each.camera) write_camera(writer, *each.camera);
    if (each.depth) write_depth(writer, *each.depth);
    writer.end_item();
  }
  writer.close();
}

}  // namespace

std::string to_yaml(const RobotDescription& robot) {
  yaml::Writer writer;
  writer.text("name", robot.name);
  write_lasers(writer, robot);
  write_cameras(writer, robot);
  if (robot.imu) {
    writer.open("imu");
    writer.line("pose", yaml::format_isometry(robot.imu->T_base_imu.isometry()));
    if (robot.imu->time_offset != 0) writer.quantity("time_offset", robot.imu->time_offset, Quantity::time);
    writer.close();
  }
  if (!robot.footprint.empty()) {
    writer.open("footprint");
    for (const Eigen::Vector2d& corner : robot.footprint) writer.item(yaml::format_lengths(corner.data(), 2));
    writer.close();
  }
  writer.quantity("height", robot.height, Quantity::length);
  writer.quantity("mass", robot.mass, Quantity::mass);
  if (!robot.model.empty()) writer.text("model", robot.model);
  if (robot.payload > 0) writer.quantity("payload", robot.payload, Quantity::mass);
  writer.open("limits");
  writer.quantity("speed", robot.limits.speed, Quantity::speed);
  writer.quantity("yaw_rate", robot.limits.yaw_rate, Quantity::angular_speed);
  writer.quantity("deceleration", robot.limits.deceleration, Quantity::acceleration);
  writer.quantity("reaction_time", robot.limits.reaction_time, Quantity::time);
  writer.close();
  if (robot.attitude) write_attitude(writer, *robot.attitude);
  writer.word("velocity_frame", kVelocityFrameNames.at(static_cast<std::size_t>(robot.velocity_frame)));
  writer.word("command_type", kCommandTypeNames.at(static_cast<std::size_t>(robot.command_type)));
  writer.quantity("odometry_error_translation", robot.odometry_error_translation, Quantity::length_ratio);
  writer.quantity("odometry_error_rotation", robot.odometry_error_rotation, Quantity::angle_ratio);
  write_odometry(writer, robot.odometry);
  if (!robot.source.empty()) writer.text("source", robot.source);
  return writer.take();
}

}  // namespace parhelion
