// What a recorded log shows of a robot's sensors, whatever its description says.
#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "protocols/pose.hpp"
#include "protocols/scan.hpp"
#include "protocols/status.hpp"
#include "tools/arrivals.hpp"

namespace parhelion::tools {

struct LaserSurvey {
  std::vector<Scan> scans;                   ///< at most 2,000, those with the usual number of beams
  std::size_t beams = 0;                     ///< of most scans
  std::size_t odd_scans = 0;                 ///< with another number of beams, or other angles
  float angle_min = 0, angle_increment = 0;  ///< rad
  bool own_angles = false;                   ///< each scan has the angles of its beams, which may differ
  double period = 0;                         ///< s, median between two stamps
  double stamp_rate = 1;                     ///< s by which stamps advance in a second of the log
  std::size_t backward_stamps = 0;
  ScanArrival arrival;
  float min_range = 0, max_range = 0;      ///< m, of ranges > 0 that are finite and not `repeated`
  double zero = 0, nan = 0, infinite = 0;  ///< fractions of all ranges
  /// A greatest finite range that many beams report exactly: what the sensor writes without a return.
  std::optional<float> repeated;
  double repeated_fraction = 0;
  bool intensities = false;
};

struct ImageSurvey {
  std::size_t images = 0;
  int width = 0, height = 0;  ///< of the first
  double period = 0;          ///< s, median between two stamps
};

struct OdometrySurvey {
  std::vector<Odometry> samples;  ///< stamps ascending
  double speed = 0;               ///< m/s, 99th percentile over 0.5 s
  double yaw_rate = 0;            ///< rad/s, likewise
  double stamp_rate = 1;          ///< s by which stamps advance in a second of the log
};

struct LogSurvey {
  std::string path;
  std::optional<LaserSurvey> laser;
  std::optional<OdometrySurvey> odometry;
  std::optional<ImageSurvey> camera, depth;
  std::optional<double> odometry_lag;  ///< s by which stamps of ODOMETRY are older than SCAN's, median
  bool imu = false;
  std::map<std::string, LaserSurvey> further_lasers;  ///< by channel, as SCAN_rear
  std::set<std::string> further;      ///< channels of sensors after the first of their kind, as SCAN_rear
  std::vector<std::string> joints;    ///< names in JOINT_STATE
  std::string robot_yaml;             ///< the last ROBOT; empty: none
  std::vector<std::string> findings;  ///< messages that could not be decoded: the first of each channel
};

/// Channels as in protocols/channels.hpp. Error: the file cannot be read, or it has no message of a sensor.
Result<LogSurvey> survey_log(const std::string& path);

/// What the ranges say about the sensor's convention; poses and times keep their defaults but for the period,
/// and the interval of beams, which is that of a mirror or head that turns once a scan; negative where turns
/// show that the last beam is measured first.
LaserDescription laser_seen(const LaserSurvey& survey);

/// +1: scans turn as odometry does while the robot turns; -1: the other way, as when beams are in reverse
/// order or T_base_laser has the laser upside down though it is not; 0: the log does not show it (the robot
/// turns less than 0.5 rad, scans do not match, or the scan plane is steeper than 45 degrees). Scans are
/// matched by shifting their beams.
int turn_agreement(const LaserSurvey& laser, const OdometrySurvey& odometry,
                   const Transform<Base, Laser>& T_base_laser);

}  // namespace parhelion::tools
