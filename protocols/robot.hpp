// The robot description: properties that the messages do not contain (channel ROBOT, `--robot FILE`).
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "protocols/image.hpp"
#include "protocols/scan.hpp"
#include "protocols/status.hpp"
#include "protocols/twist_command.hpp"

namespace parhelion {

struct RobotLimits {
  double speed = 1.0;          ///< m/s
  double yaw_rate = 1.5;       ///< rad/s
  double deceleration = 1.0;   ///< m/s^2, for planning a stop
  double reaction_time = 0.2;  ///< s, from command to motion
};

/// Limits whose violation gives a warning, or a failure (paper 4.1).
struct AttitudeLimits {
  double pitch_warning = 0.35, pitch_limit = 0.6;       ///< rad
  double roll_warning = 0.3, roll_limit = 0.5;          ///< rad
  double yaw_rate_warning = 1.5, yaw_rate_limit = 2.5;  ///< rad/s
};

struct ImuDescription {
  Transform<Base, Imu> T_base_imu;
  double time_offset = 0;  ///< s, to add to a stamp of IMU: then it is on the clock of the scans
};

/// A laser on LINES whose scan lines are swept over the site for mapping: by the joints of its head, or,
/// where it is mounted on its side, by driving.
struct LineLaserDescription {
  LaserDescription laser;       ///< its pose with all joints of `head` at zero
  std::vector<HeadJoint> head;  ///< from the base outwards; none: fixed to the base
};

/// Systematic errors of ODOMETRY, as `parhelion calibrate` measures them. The defaults change nothing.
struct OdometryCorrection {
  double translation_scale = 1;  ///< true metres per metre of odometry
  double rotation_scale = 1;     ///< true radians per radian of odometry
  double curvature = 0;          ///< rad/m, turned per true metre driven, of which odometry knows nothing
  double time_offset = 0;        ///< s, to add to a stamp of odometry: then it is on the clock of the scans

  bool operator==(const OdometryCorrection&) const = default;
};

/// A planar laser after the first, with its own channels: SCAN_<name>, MR_SCAN_<name>, MR_SCAN_INFO_<name>.
struct NamedLaser {
  std::string name;  ///< see sensor_name_fault()
  LaserDescription laser;
};

/// A camera after the first, a depth camera, or one of each whose images belong together, with channels of
/// their own: CAMERA_<name>, DEPTH_<name>, MR_CAMERA_<name>, MR_DEPTH_<name>.
struct NamedCameras {
  std::string name;  ///< see sensor_name_fault()
  std::optional<CameraDescription> camera;
  std::optional<DepthCameraDescription> depth;
};

struct RobotDescription {
  enum class VelocityFrame { body, local };  ///< frame of pose_t.vel

  std::string name = "robot";
  std::optional<LaserDescription> laser;
  std::vector<NamedLaser> further_lasers;  ///< empty where there is no `laser`
  std::optional<LineLaserDescription> line_laser;
  std::optional<CameraDescription> camera;
  std::optional<DepthCameraDescription> depth;
  std::vector<NamedCameras> further_cameras;
  std::optional<ImuDescription> imu;       ///< none: no attitude, and IMU is ignored
  std::vector<Eigen::Vector2d> footprint;  ///< convex, counter-clockwise, m, in base_link
  double height = 0.5;                     ///< m, top of the body over the floor
  double mass = 50;                        ///< kg
  /// Robot model (name, or path of its YAML) whose links are this robot's, moved by JOINT_STATE; empty: the
  /// robot is a prism of footprint and height.
  std::string model;
  double payload = 0;  ///< kg that its gripper holds; 0: no limit
  RobotLimits limits;
  std::optional<AttitudeLimits> attitude;  ///< none: no warnings
  VelocityFrame velocity_frame = VelocityFrame::body;
  CommandType command_type = CommandType::twist;  ///< of MR_CMD
  /// 1 sigma of odometry per metre driven and per radian turned: m/m and rad/rad.
  double odometry_error_translation = 0.05;
  double odometry_error_rotation = 0.05;
  OdometryCorrection odometry;
  std::string source;  ///< origin of an imported description

  /// Planar lasers, counted from the first: 0 is `laser`, which must be there, the others are further ones.
  const LaserDescription& laser_at(std::size_t index) const {
    return index == 0 ? *laser : further_lasers[index - 1].laser;
  }
  /// Cameras, counted in the same way: 0 is `camera`, the others are of further_cameras.
  const std::optional<CameraDescription>& camera_at(std::size_t index) const {
    return index == 0 ? camera : further_cameras[index - 1].camera;
  }
  const std::optional<DepthCameraDescription>& depth_at(std::size_t index) const {
    return index == 0 ? depth : further_cameras[index - 1].depth;
  }
};

/// Reads YAML (schema robot.schema.json). `origin` names the file or channel in errors.
Result<RobotDescription> parse_robot_description(const std::string& yaml, const std::string& origin);
/// From a file: its `model`, where that is a path, is taken from the file's folder.
Result<RobotDescription> load_robot_description(const std::string& path);
/// RobotDescription::model as written in the folder of file `beside`: a name and an absolute path stay.
std::string resolved_model(const std::string& model, const std::string& beside);
/// Writes YAML that parse_robot_description reads back to the same values, units included.
std::string to_yaml(const RobotDescription& robot);

/// Reads a laser preset by name ("lms-200", "s3000", "utm-30lx", "urg-04lx"), from fusion/scan/presets.
Result<LaserDescription> load_laser_preset(const std::string& name);
/// The same from any file (schema laser.schema.json); `preset` is the file's name without folder and ending.
Result<LaserDescription> load_laser_preset_file(const std::string& path);

}  // namespace parhelion
