// `parhelion slam --log`: SLAM over a recorded log with SCAN and ODOMETRY, which adds POSE_COV and POSE to
// it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fusion/pose/slam.hpp"
#include "protocols/channel_map.hpp"
#include "protocols/status.hpp"
#include "protocols/time.hpp"

namespace parhelion::tools {

/// One ServerStatus before the first estimate: seed, map id, and whether the trajectory is causal.
inline constexpr const char* kSlamStatusChannel = "SLAM_STATUS";

struct SlamLogOptions {
  std::filesystem::path input;
  std::filesystem::path output;    ///< empty: no log is written (a map may still be saved)
  bool overwrite = false;          ///< output and map
  std::filesystem::path robot;     ///< overrides the log's ROBOT, in OUT too; empty: the log's own
  std::filesystem::path map;       ///< localize_log: .simplemap or ROS map YAML
  std::filesystem::path save_map;  ///< map_log: PREFIX of .simplemap, .yaml, .pgm, .png; empty: none
  bool causal = false;             ///< map_log: the estimates of a live run instead of the final trajectory
  pose::SlamOptions slam;
  Duration pose_delay = milliseconds(20);  ///< from the scan to the arrival of its pose
  std::string scan_channel = "SCAN";
  std::string odometry_channel = "ODOMETRY";
  std::string robot_name;  ///< of several robots the one whose channels are used; empty: there is one

  /// The robot's channel of this canonical name.
  std::string own(const char* canonical) const { return robot_channel(canonical, robot_name); }
};

struct StepPercentiles {
  double p50 = 0, p90 = 0, p99 = 0, max = 0;  ///< us
};
StepPercentiles percentiles(std::vector<double> microseconds);

struct SlamLogReport {
  std::uint64_t scans = 0, answered = 0, tracking = 0, unsure = 0, lost = 0, initializing = 0;
  std::uint64_t odometry = 0;
  std::uint64_t refused = 0;   ///< events of the two channels that could not be decoded, damaged places
  std::uint64_t replaced = 0;  ///< POSE_COV and POSE events of IN that OUT does not hold
  StepPercentiles step;        ///< measured, per scan, causal part
  double loop_seconds = 0;     ///< loop closure at the end
  double seconds = 0;          ///< total
  double log_seconds = 0;      ///< from the first scan to the last, by arrival
  std::string map_id;
  pose::GridMap map;    ///< built, or localized in
  std::string summary;  ///< for people, one line
  bool causal = true;
  std::vector<std::string> findings;  ///< the first twenty
  SensorTime first_scan;              ///< its stamp
  std::optional<pose::ClockOffset> odometry_offset;
  std::vector<pose::OdometryFinding> odometry_findings;
};

/// In percent: `total` is 100.
using SlamProgress = std::function<void(double done, double total)>;

/// Builds a map. Poses in OUT are the final trajectory unless options.causal. Deterministic: OUT's step times
/// are 0.
Result<SlamLogReport> map_log(const SlamLogOptions& options, const SlamProgress& progress = {});
/// Localizes in options.map.
Result<SlamLogReport> localize_log(const SlamLogOptions& options, const SlamProgress& progress = {});

/// PREFIX.simplemap, .yaml, .pgm and .png: writes all four or, on an error, none. The caller closes loops
/// with Slam::finish() before.
Status save_map_files(const pose::Slam& slam, const std::filesystem::path& prefix, bool overwrite);
/// Their names, in one line.
std::string joined_map_files(const std::filesystem::path& prefix);
/// Error: one of them exists and may not be overwritten, or their folder does not exist.
Status check_map_files(const std::filesystem::path& prefix, bool overwrite);

/// Error: the channel contains injected returns. SLAM gets raw scans only.
Status check_raw_channel(const std::string& channel);

/// One line: from when to when, seconds after `first_scan`, and what.
std::string dated(const pose::OdometryFinding& finding, SensorTime first_scan);

/// What to say of odometry's clock; empty: nothing that matters. Below 80 ms, and below five sigmas, it
/// costs a map less than other errors do.
std::string offset_note(const std::optional<pose::ClockOffset>& offset);

/// The summary as JSON (`--summary`).
std::string to_json(const SlamLogReport& report);

}  // namespace parhelion::tools
