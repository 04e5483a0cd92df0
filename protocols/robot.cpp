#include "protocols/robot.hpp"

#include <algorithm>
#include <filesystem>
#include <map>

#include "protocols/channel_map.hpp"
#include "protocols/nearest_name.hpp"
#include "protocols/share.hpp"
#include "protocols/yaml/head.hpp"
#include "protocols/yaml/laser.hpp"
#include "protocols/yaml/parts.hpp"
#include "protocols/yaml/robot.hpp"
#include "protocols/yaml/robot_names.hpp"
#include "protocols/yaml/schema.hpp"
#include "protocols/yaml/utf8.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion {
namespace {

using yaml::Node;
using yaml::Quantity;

CameraIntrinsics read_intrinsics(const Node& node, yaml::Problems& problems) {
  CameraIntrinsics camera;
  yaml::read(node, "width", camera.width);
  yaml::read(node, "height", camera.height);
  yaml::read(node, "fx", camera.fx);
  yaml::read(node, "fy", camera.fy);
  yaml::read(node, "cx", camera.cx);
  yaml::read(node, "cy", camera.cy);
  yaml::read(node, "lens", kLensNames, camera.lens);
  if (const Node* list = node.find("distortion")) {
    const std::size_t max_coefficients = camera.lens == CameraIntrinsics::Lens::fisheye ? 4 : 5;
    for (std::size_t i = 0; i < list->items.size(); ++i) camera.distortion.at(i) = list->items[i].number;
    if (list->items.size() > max_coefficients && camera.distortion[4] != 0) {
      problems.add(list->line, "'distortion': a fisheye lens has four coefficients, k1 k2 k3 k4, found five");
    }
  }
  return camera;
}

/// What cameras and depth cameras have in common.
template <class Camera>
Camera read_any_camera(const Node& node, yaml::Problems& problems) {
  Camera camera;
  camera.intrinsics = read_intrinsics(node, problems);
  camera.T_base_optical =
      decltype(camera.T_base_optical)(yaml::read_camera_isometry(*node.find("pose"), problems));
  camera.head = yaml::read_head(node, problems);
  yaml::read(node, "rate", camera.rate);
  yaml::read(node, "noise", camera.noise);
  yaml::read(node, "source", camera.source);
  return camera;
}

CameraDescription read_camera(const Node& node, yaml::Problems& problems) {
  auto camera = read_any_camera<CameraDescription>(node, problems);
  yaml::read(node, "readout", camera.readout);
  yaml::read(node, "time_offset", camera.time_offset);
  return camera;
}

DepthCameraDescription read_depth(const Node& node, yaml::Problems& problems) {
  auto depth = read_any_camera<DepthCameraDescription>(node, problems);
  yaml::read(node, "range_min", depth.range_min);
  yaml::read(node, "range_max", depth.range_max);
  yaml::read(node, "baseline", depth.baseline);
  yaml::read(node, "disparity_noise", depth.disparity_noise);
  yaml::read(node, "disparity_step", depth.disparity_step);
  if (depth.baseline == 0 && (depth.disparity_noise > 0 || depth.disparity_step > 0))
    problems.add(node.line, "'disparity_noise' and 'disparity_step' need a 'baseline' of more than 0 m");
  if (depth.range_max != 0 && !(depth.range_min < depth.range_max)) {
    problems.add(node.line, "expected range_min < range_max, found " +
                                yaml::format_quantity(depth.range_min, Quantity::length) + " and " +
                                yaml::format_quantity(depth.range_max, Quantity::length));
  }
  return depth;
}

/// Every corner turns left, and together they make one full turn.
void check_footprint(const std::vector<Eigen::Vector2d>& corners, const Node& list,
                     yaml::Problems& problems) {
  const std::size_t n = corners.size();
  double turned = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::Vector2d a = corners[(i + 1) % n] - corners[i];
    const Eigen::Vector2d b = corners[(i + 2) % n] - corners[(i + 1) % n];
    const double cross = a.x() * b.y() - a.y() * b.x();
    if (cross < 0 || a.isZero(0)) {
      problems.add(list.items[(i + 1) % n].line,
                   "'footprint': expected a convex outline, counter-clockwise, each corner once");
      return;
    }
    turned += std::atan2(cross, a.dot(b));
  }
  if (!(std::abs(turned - 2 * std::numbers::pi) < 1e-6)) {
    problems.add(list.line, "'footprint': expected an outline that makes one turn");
  }
}

void read_limits(const Node& node, RobotLimits& limits) {
  yaml::read(node, "speed", limits.speed);
  yaml::read(node, "yaw_rate", limits.yaw_rate);
  yaml::read(node, "deceleration", limits.deceleration);
  yaml::read(node, "reaction_time", limits.reaction_time);
}

OdometryCorrection read_odometry(const Node& node) {
  OdometryCorrection correction;
  yaml::read(node, "translation_scale", correction.translation_scale);
  yaml::read(node, "rotation_scale", correction.rotation_scale);
  yaml::read(node, "curvature", correction.curvature);
  yaml::read(node, "time_offset", correction.time_offset);
  return correction;
}

AttitudeLimits read_attitude(const Node& node, yaml::Problems& problems) {
  AttitudeLimits limits;
  yaml::read_attitude_limits(node, limits);
  const auto check = [&](const char* what, double warning, double limit, Quantity quantity) {
    if (warning <= limit) return;
    problems.add(node.line, std::string("'attitude': expected ") + what + "_warning <= " + what +
                                "_limit, found " + yaml::format_quantity(warning, quantity) + " and " +
                                yaml::format_quantity(limit, quantity));
  };
  check("pitch", limits.pitch_warning, limits.pitch_limit, Quantity::angle);
  check("roll", limits.roll_warning, limits.roll_limit, Quantity::angle);
  check("yaw_rate", limits.yaw_rate_warning, limits.yaw_rate_limit, Quantity::angular_speed);
  return limits;
}

/// Of a laser that is fixed to the base.
LaserDescription read_fixed_laser(const Node& node, yaml::Problems& problems) {
  if (const Node* head = node.find("head"))
    problems.add(head->line, "the lasers of SCAN are fixed to the base; joints turn 'line_laser' only");
  return yaml::read_laser(node, problems);
}

void refuse_name(const Node& laser, yaml::Problems& problems) {
  if (const Node* name = laser.find("name"))
    problems.add(name->line, "only the further lasers in 'lasers' have names");
}

/// Of a sensor after the first of its `kind`, "laser" or "camera".
void read_sensor_name(const Node& node, const Node& list, const std::string& kind, std::string& name,
                      yaml::Problems& problems) {
  const Node* text = node.find("name");
  if (text == nullptr)
    return problems.add(node.line, "key 'name' is missing in a " + kind + " of '" + kind + "s'");
  name = text->text;
  if (const std::string fault = sensor_name_fault(name); !fault.empty())
    problems.add(text->line, "'name' of a " + kind + ", part of channel names: " + fault);
  for (const Node& other : list.items) {
    if (&other == &node) return;
    const Node* taken = other.find("name");
    if (taken == nullptr || taken->text != name) continue;
    return problems.add(text->line, "name '" + yaml::printable(name) + "' is taken by the " + kind +
                                        " in line " + std::to_string(taken->line) + ": names must be unique");
  }
}

void read_further_cameras(const Node& list, RobotDescription& robot, yaml::Problems& problems) {
  for (const Node& item : list.items) {
    NamedCameras& cameras = robot.further_cameras.emplace_back();
    read_sensor_name(item, list, "camera", cameras.name, problems);
    if (const Node* camera = item.find("camera")) cameras.camera = read_camera(*camera, problems);
    if (const Node* depth = item.find("depth")) cameras.depth = read_depth(*depth, problems);
    if (!cameras.camera && !cameras.depth)
      problems.add(item.line, "expected 'camera', 'depth' or both in an entry of 'cameras'");
  }
}

void read_further_lasers(const Node& list, RobotDescription& robot, yaml::Problems& problems) {
  if (!robot.laser && !list.items.empty())
    problems.add(list.line, "'lasers' are further ones: the first, whose scans are on SCAN, is 'laser'");
  for (const Node& item : list.items) {
    NamedLaser& laser = robot.further_lasers.emplace_back();
    read_sensor_name(item, list, "laser", laser.name, problems);
    laser.laser = read_fixed_laser(item, problems);
  }
}

void read_lasers(const Node& node, RobotDescription& robot, yaml::Problems& problems) {
  if (const Node* laser = node.find("laser")) {
    robot.laser = read_fixed_laser(*laser, problems);
    refuse_name(*laser, problems);
  }
  if (const Node* lasers = node.find("lasers")) read_further_lasers(*lasers, robot, problems);
  if (const Node* laser = node.find("line_laser")) {
    robot.line_laser = {yaml::read_laser(*laser, problems), yaml::read_head(*laser, problems)};
    refuse_name(*laser, problems);
  }
}

}  // namespace

void yaml::read_attitude_limits(const Node& node, AttitudeLimits& limits) {
  yaml::read(node, "pitch_warning", limits.pitch_warning);
  yaml::read(node, "pitch_limit", limits.pitch_limit);
  yaml::read(node, "roll_warning", limits.roll_warning);
  yaml::read(node, "roll_limit", limits.roll_limit);
  yaml::read(node, "yaw_rate_warning", limits.yaw_rate_warning);
  yaml::read(node, "yaw_rate_limit", limits.yaw_rate_limit);
}

RobotDescription yaml::read_robot(const Node& node, Problems& problems) {
  RobotDescription robot;
  yaml::read(node, "name", robot.name);
  if (const std::string fault = robot_name_fault(robot.name); !fault.empty())
    problems.add(node.find("name")->line, "'name' of a robot, part of channel names: " + fault);
  read_lasers(node, robot, problems);
  if (const Node* camera = node.find("camera")) robot.camera = read_camera(*camera, problems);
  if (const Node* depth = node.find("depth")) robot.depth = read_depth(*depth, problems);
  if (const Node* cameras = node.find("cameras")) read_further_cameras(*cameras, robot, problems);
  if (const Node* imu = node.find("imu")) {
    yaml::read(*imu, "pose", robot.imu.emplace().T_base_imu, problems);
    yaml::read(*imu, "time_offset", robot.imu->time_offset);
  }
  if (const Node* footprint = node.find("footprint")) {
    for (const Node& corner : footprint->items) robot.footprint.push_back(yaml::vector2(corner));
    check_footprint(robot.footprint, *footprint, problems);
  }
  yaml::read(node, "height", robot.height);
  yaml::read(node, "mass", robot.mass);
  yaml::read(node, "model", robot.model);
  yaml::read(node, "payload", robot.payload);
  if (const Node* limits = node.find("limits")) read_limits(*limits, robot.limits);
  if (const Node* attitude = node.find("attitude")) robot.attitude = read_attitude(*attitude, problems);
  yaml::read(node, "velocity_frame", kVelocityFrameNames, robot.velocity_frame);
  yaml::read(node, "command_type", kCommandTypeNames, robot.command_type);
  yaml::read(node, "odometry_error_translation", robot.odometry_error_translation);
  yaml::read(node, "odometry_error_rotation", robot.odometry_error_rotation);
  if (const Node* odometry = node.find("odometry")) robot.odometry = read_odometry(*odometry);
  yaml::read(node, "source", robot.source);
  return robot;
}

namespace {

std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  std::error_code code;
  for (const auto& entry : std::filesystem::directory_iterator(share_path("fusion/scan/presets"), code)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

Result<RobotDescription> parse_robot_description(const std::string& yaml, const std::string& origin) {
  const auto document = yaml::read_checked(yaml, origin, "robot");
  if (!document) return document.error();
  yaml::Problems problems(origin);
  RobotDescription robot = yaml::read_robot(*document, problems);
  if (!problems.empty()) return problems.error();
  return robot;
}

std::string resolved_model(const std::string& model, const std::string& beside) {
  const std::filesystem::path path(model);
  if (path.extension() != ".yaml" || path.is_absolute()) return model;
  return (std::filesystem::path(beside).parent_path() / path).string();
}

Result<RobotDescription> load_robot_description(const std::string& path) {
  const auto text = yaml::read_text(path);
  if (!text) return text.error();
  auto robot = parse_robot_description(*text, path);
  if (robot) robot->model = resolved_model(robot->model, path);
  return robot;
}

Result<LaserDescription> load_laser_preset(const std::string& name) {
  const auto known = preset_names();
  if (std::find(known.begin(), known.end(), name) == known.end()) {
    std::string list;
    for (const std::string& each : known) list += (list.empty() ? "" : ", ") + each;
    const std::string near = suggestion(name, known);
    return Error{
        "no laser preset is called '" + yaml::printable(name) + "'" + (near.empty() ? "." : near) +
        " Known: " + (list.empty() ? "none found in " + share_path("fusion/scan/presets").string() : list)};
  }
  return load_laser_preset_file(share_path("fusion/scan/presets/" + name + ".yaml").string());
}

Result<LaserDescription> load_laser_preset_file(const std::string& path) {
  const auto text = yaml::read_text(path);
  if (!text) return text.error();
  const auto document = yaml::read_checked(*text, path, "laser");
  if (!document) return document.error();
  yaml::Problems problems(path);
  LaserDescription laser = yaml::read_preset(*document, problems);
  if (!problems.empty()) return problems.error();
  laser.preset = std::filesystem::path(path).stem().string();
  return laser;
}

}  // namespace parhelion
