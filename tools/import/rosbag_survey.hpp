// Content of a bag, collected in a first pass before anything is written.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/import/bag_source.hpp"
#include "tools/import/first_stamp.hpp"
#include "tools/import/laser_evidence.hpp"
#include "tools/import/ros_frames.hpp"
#include "tools/import/ros_message.hpp"

namespace parhelion::tools {

struct BagTopic {
  std::string type;
  std::string frame;
  std::uint64_t count = 0;
  std::string encoding;  ///< of images
  int width = 0, height = 0;
};

struct BagSurvey {
  std::map<std::string, BagTopic> topics;
  std::map<std::string, LaserEvidence> lasers;
  std::map<std::string, ros::CameraInfo> cameras;
  std::map<std::string, std::string> odometry_child;  ///< topic to child frame
  RosFrames frames;
  std::string urdf;  ///< the first text on .../robot_description
  FirstStamp first_stamp;

  void take(const BagMessage& message);
  std::vector<std::string> of_type(const std::string& type) const;
};

/// Topics to import, after --topics; empty: none.
struct BagChoice {
  std::optional<std::string> scan, lines, odometry, camera, camera_info, depth, depth_info, reference, teleop,
      imu, joints;
  std::optional<RosFrames::Key> odometry_edge;  ///< if odometry comes from tf
  /// Lasers after the first, by topic: the names in their channels, SCAN_<name>. Only those asked for.
  std::map<std::string, std::string> further_scans;
  std::vector<std::string> unreadable_odometry;  ///< topics that are not ODOMETRY for that reason
};

Result<BagChoice> choose_topics(const ImportOptions& options, const BagSurvey& survey);
/// The base frame: odometry's child, or base_footprint if that is below it.
std::string base_frame(const BagSurvey& survey, const BagChoice& choice);
Result<RobotDescription> describe(const ImportOptions& options, const BagSurvey& survey,
                                  const BagChoice& choice, std::vector<std::string>& notes);

/// Beams in the order of time: reversed if time_increment is negative. Intensities are dropped unless there
/// is one per beam.
Scan to_scan(const ros::LaserScan& message);

bool is_tf(const std::string& type);
bool is_scan(const std::string& type);
/// Of a message whose type is a scan's.
Result<ros::LaserScan> read_scan(const BagMessage& message);

}  // namespace parhelion::tools
