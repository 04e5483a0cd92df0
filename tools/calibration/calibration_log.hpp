// `parhelion calibrate`: calibration from a recorded log, checked on a part of it that was kept for
// validation.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "fusion/pose/calibration/motion_calibration.hpp"
#include "fusion/pose/slam.hpp"
#include "fusion/scan/laser_learning.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"
#include "protocols/status.hpp"
#include "tools/calibration/calibration_level.hpp"
#include "tools/calibration/calibration_turns.hpp"

namespace parhelion::tools {

struct CalibrationOptions {
  std::filesystem::path input;
  std::filesystem::path robot;  ///< overrides the log's ROBOT; empty: the log's own
  std::filesystem::path map;    ///< localizes in it; empty: a map is built from the drive itself
  std::string scan_channel = "SCAN";
  std::string odometry_channel = "ODOMETRY";
  std::string imu_channel = "IMU";
  std::string camera_channel = "CAMERA";
  std::string depth_channel = "DEPTH";
  std::string reference_channel;     ///< poses of the base (pose_t); empty: none
  double validation_fraction = 0.3;  ///< fraction of the drive, its end, that only checks the result
  bool validate_on_start = false;    ///< its start instead
  double track_width = 0;            ///< m, assumed by a two-wheeled robot's odometry; 0: not two-wheeled
};

/// Whether a calibration may be used.
enum class CalibrationVerdict : std::uint8_t {
  better,       ///< odometry agrees better with the scans than before where the result was not fitted
  as_good,      ///< no better than before, within the noise of the drive
  not_checked,  ///< no part was kept for validation, as was asked for
  refused,      ///< must not be used, see refusals
};
/// As in JSON: "not_checked".
const char* to_string(CalibrationVerdict verdict);

struct CalibrationReport {
  CalibrationVerdict verdict = CalibrationVerdict::not_checked;
  std::vector<std::string> refusals;          ///< why it must not be used, and what to do
  std::vector<std::string> warnings;          ///< to look at, though it may be used
  std::vector<pose::OdometryFinding> faults;  ///< that are among them
  RobotDescription before, after;
  pose::MotionCalibration motion;
  pose::MotionCheck check_fitted;               ///< on the part that it was fitted to
  pose::MotionCheck check_before, check_after;  ///< on the validation part
  std::optional<scan::LearnedLaser> laser;      ///< nullopt: too few flat walls, see laser_note
  std::string laser_note;
  TurnSensor imu, camera;
  FoundLevel level;
  Deskew deskew = Deskew::live;  ///< as scans and odometry agree better
  bool reversed_beams = false;   ///< `after` has the beams of a message in the other order than `before`
  double sweep_sigma = 0;        ///< s, what the sweep of a scan adds to the sigma of each time offset
  SensorTime first_scan;         ///< of the log
  std::size_t odometry_samples = 0;
  std::size_t scans = 0, validation_scans = 0;
  std::uint64_t refused = 0;          ///< events that could not be decoded
  std::vector<std::string> findings;  ///< of each kind, with the number of times
  pose::GridMap map;                  ///< of the validation part
  pose::ReckonedPath path_before, path_after;
};

/// Errors name the file and the channel: no such channel, too short, a robot that hardly moves.
/// Deterministic.
Result<CalibrationReport> calibrate_log(const CalibrationOptions& options,
                                        const CalibrationProgress& progress = {});

/// For people, several lines.
std::string to_text(const CalibrationReport& report, const CalibrationOptions& options);
std::string to_json(const CalibrationReport& report, const CalibrationOptions& options);
/// A PNG of the validation part: the path by scan matching, by odometry before and after.
Status draw_calibration(const CalibrationReport& report, const std::string& path);

}  // namespace parhelion::tools
