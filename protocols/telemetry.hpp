// Messages of the server other than scans and images.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "protocols/time.hpp"

namespace parhelion {

/// The texts of a robot model's files, so that replay needs no files.
struct RobotModelTexts {
  std::string name, urdf, yaml;
};

/// MR_SESSION, the first event of a session log: everything that replay needs besides the inputs.
struct SessionHeader {
  SensorTime stamp;  ///< server's start
  std::string scenario_yaml;
  std::string model_yaml;
  std::string robot_yaml;
  std::uint64_t seed = 0;
  std::string version;                      ///< of parhelion and of the libraries that affect results
  std::vector<std::string> input_channels;  ///< names on the bus of the inputs
  std::vector<RobotModelTexts> robot_models;
  std::vector<std::uint8_t> map = {};  ///< packed surfaces of the map; empty: scans are not matched
};

/// MR_SCAN_INFO: which agent each beam of the MR_SCAN with the same utime hit.
struct ScanInfo {
  SensorTime stamp;                      ///< of the scan that it describes
  bool live = false;                     ///< false: degraded, MR_SCAN equals SCAN
  std::string reason;                    ///< why degraded, else empty
  double predicted_error = 0;            ///< m, 1 sigma of a return at the nearest agent; infinity: no pose
  std::vector<std::string> agents;       ///< names that beam_agent refers to
  std::vector<std::int16_t> beam_agent;  ///< per beam: index into agents, -1: none
  std::string pose = {};                 ///< "matched" to the map, or why the pose was carried by odometry
  /// x, y, yaw of the robot in the map at the stamp; infinite: no pose.
  Eigen::Matrix3d pose_covariance = Eigen::Matrix3d::Constant(std::numeric_limits<double>::infinity());
  double residual =
      std::numeric_limits<double>::infinity();  ///< m, RMS distance of the explained returns from the map's
                                                ///< surfaces; infinity: not matched
  double explained = 0;                         ///< fraction of the returns that lie on the map's surfaces
};

/// LOOP: decisions that depend on wall time; replay repeats them.
struct LoopDecision {
  enum class Kind : std::int8_t {
    guard_fired = 0,
    steps_skipped = 1,
    frame_dropped = 2,
    scans_left_out = 3,   ///< they were passed on unchanged, and the session log lacks them
    ended = 4,            ///< no more input; the physics has reached this time
    foreign_message = 5,  ///< another publisher on one of the server's own channels
    stale_command = 6,    ///< TELEOP or JOINT_CMD that was too old when the server took it: not in the log
    refused_message = 7,  ///< by its signature: the first of its kind on its channel
    late_command = 8      ///< an instructor's, refused because the server is behind: not in the log
  };
  SensorTime stamp;  ///< of the input that it is about, or the server's time
  Kind kind = Kind::guard_fired;
  /// Steps skipped (all before the newest that is due at the arrival), scans left out, 0 at the end; for
  /// foreign_message and refused_message see server/tick/foreign_publisher.hpp; for stale_command its age in
  /// ms; for late_command the bits of its request number; else the sequence number of the scan or frame, from
  /// 1.
  std::int64_t count = 0;
};

/// MR_MODEL: a version of the semantic model that replaces the previous one at the next physics step.
/// Produced by the server and logged as an input, so that replay applies it.
struct ModelVersion {
  SensorTime stamp;           ///< of the newest 3D scan in it
  std::uint64_t version = 1;  ///< from 1; MR_SESSION embeds version 0
  std::string yaml;           ///< the model
};

/// MR_STATUS: measured figures, excluded from promise 4.
struct ServerStatus {
  SensorTime stamp;
  std::vector<std::pair<std::string, double>> values;
  std::vector<std::pair<std::string, std::string>> notes;
};

}  // namespace parhelion
