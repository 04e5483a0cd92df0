// A recorded drive for `parhelion calibrate`: read, split into parts, and followed by SLAM.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "fusion/pose/calibration/drive_motion.hpp"
#include "fusion/pose/slam.hpp"
#include "protocols/joints.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"
#include "protocols/status.hpp"
#include "tools/arrivals.hpp"

namespace parhelion::tools {

struct CalibrationOptions;
using CalibrationProgress = std::function<void(double done, double total)>;

/// A part of a log, decoded.
struct RecordedDrive {
  struct Event {
    enum class Kind { scan, odometry, inertial } kind = Kind::scan;
    std::size_t index = 0;  ///< into the samples of its kind
  };
  std::vector<Event> events;  ///< in the order of arrival
  std::vector<Scan> scans;
  std::vector<Odometry> odometry;
  std::vector<ImuSample> inertial;
  std::vector<PoseStamped> reference;

  std::size_t scan_events() const;
};

struct ReadDrive {
  RecordedDrive drive;
  Arrivals scan_arrivals, odometry_arrivals;
  RobotDescription robot;
  std::size_t images = 0;             ///< on the camera's channel
  std::size_t depth_images = 0;       ///< on that of the depth camera
  std::uint64_t refused = 0;          ///< events that could not be decoded
  std::vector<std::string> findings;  ///< of each kind, with the number of times
};

/// The whole log. Errors name the file and the channel.
Result<ReadDrive> read_drive(const CalibrationOptions& options, const CalibrationProgress& progress);

/// The parts of the drive that calibrate and that check. All samples stay in both, as they are looked up by
/// stamp; the events are divided.
struct DriveParts {
  RecordedDrive calibrating, validation;
};
DriveParts split_drive(const RecordedDrive& drive, const CalibrationOptions& options);

struct TrackedDrive {
  pose::DriveMotion motion;
  pose::GridMap map;
  std::vector<pose::OdometryFinding> findings;  ///< what SLAM found wrong with odometry or the laser
  SensorTime first_scan, last_scan;
  std::size_t scans = 0;  ///< that SLAM was given; those with a pose are in `motion`
};

/// How scans are corrected for their sweep: as live, with the odometry that has arrived, or with all odometry
/// from before and after.
enum class Deskew { live, recorded };

/// SLAM over a part of a drive. As the drive is recorded, odometry that is late need not be waited for: by
/// the time offset in `robot` it is added before the scan of its instant.
Result<TrackedDrive> track_drive(const RecordedDrive& drive, const RobotDescription& robot, Deskew deskew,
                                 const CalibrationOptions& options, const CalibrationProgress& progress);

}  // namespace parhelion::tools
