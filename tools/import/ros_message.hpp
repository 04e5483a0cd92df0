// ROS messages that are imported, parsed from their serialized bytes: as ROS 1 writes them
// (http://wiki.ros.org/msg), or as ROS 2 does (CDR: OMG DDS-RTPS 2.3, section 10; the messages have the same
// fields but for the header's number). Every parser checks lengths and that the message ends with its bytes.
// The error contains the byte offset.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/status.hpp"
#include "protocols/time.hpp"

namespace parhelion::tools::ros {

enum class Encoding : std::uint8_t { ros1, cdr };

struct MessageBytes {
  std::span<const std::uint8_t> bytes;
  Encoding encoding = Encoding::ros1;
};

struct Header {
  SensorTime stamp;
  std::string frame;  ///< without the leading '/' of tf's first version
};

struct LaserScan {  ///< sensor_msgs/LaserScan; radians, seconds, metres; the stamp is of the first ray
  Header header;
  float angle_min, angle_max, angle_increment, time_increment, scan_time, range_min, range_max;
  std::vector<float> ranges, intensities;
};

struct Image {  ///< sensor_msgs/Image
  Header header;
  std::uint32_t height, width;
  std::string encoding;
  bool big_endian;
  std::uint32_t step;
  std::vector<std::uint8_t> data;
};

struct CompressedImage {  ///< sensor_msgs/CompressedImage
  Header header;
  std::string format;
  std::vector<std::uint8_t> data;
};

struct CameraInfo {  ///< sensor_msgs/CameraInfo
  Header header;
  std::uint32_t height, width;
  std::string distortion_model;
  std::vector<double> d;
  double k[9], r[9], p[12];
  std::uint32_t binning_x, binning_y;
  std::uint32_t roi_x, roi_y, roi_height, roi_width;
  bool roi_rectify;
};

struct PoseStamped {  ///< geometry_msgs/PoseStamped
  Header header;
  Eigen::Isometry3d pose;
};

struct Odometry {  ///< nav_msgs/Odometry, without its covariances
  Header header;
  std::string child_frame;
  Eigen::Isometry3d pose;
};

struct StampedTransform {  ///< geometry_msgs/TransformStamped: pose of `child` in header.frame
  Header header;
  std::string child;
  Eigen::Isometry3d pose;
};

struct Twist {  ///< geometry_msgs/Twist; TwistStamped without its header
  Twist2 twist;
};

struct Imu {  ///< sensor_msgs/Imu, without its covariances; no orientation if the sensor has none
  Header header;
  std::optional<Eigen::Quaterniond> orientation;
  Eigen::Vector3d angular_velocity, linear_acceleration;
};

struct JointState {  ///< sensor_msgs/JointState
  Header header;
  std::vector<std::string> names;
  std::vector<double> positions, velocities, efforts;
};

Result<std::string> read_string(MessageBytes bytes);  ///< std_msgs/String
/// Of a sensor_msgs/MultiEchoLaserScan (`several`) the first echo of each beam is read; a beam without any is
/// one without a return.
enum class Echoes : std::uint8_t { one, several };
Result<LaserScan> read_laser_scan(MessageBytes bytes, Echoes echoes = Echoes::one);
Result<Image> read_image(MessageBytes bytes);
Result<CompressedImage> read_compressed_image(MessageBytes bytes);
Result<CameraInfo> read_camera_info(MessageBytes bytes);
/// Error: a quaternion whose norm is not about 1, or a pose that is not finite.
Result<PoseStamped> read_pose_stamped(MessageBytes bytes);
Result<Odometry> read_odometry(MessageBytes bytes);
Result<std::vector<StampedTransform>> read_tf(MessageBytes bytes);
Result<Twist> read_twist(MessageBytes bytes);
Result<Twist> read_twist_stamped(MessageBytes bytes);
/// A rate or acceleration that the sensor does not measure (covariance -1) is zero, as in ROS.
Result<Imu> read_imu(MessageBytes bytes);
Result<JointState> read_joint_state(MessageBytes bytes);

}  // namespace parhelion::tools::ros
