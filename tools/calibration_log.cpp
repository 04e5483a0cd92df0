#include "tools/calibration_log.hpp"

#include <algorithm>
#include <cmath>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "tools/slam_log.hpp"

namespace parhelion::tools {
namespace {

constexpr double kWindow = 2;  ///< s, over which odometry is checked

/// The whole log, decoded.
class DriveReader {
 public:
  DriveReader(const CalibrationOptions& options, CalibrationReport& report)
      : options_(options), report_(report) {}

  Status read(const CalibrationProgress& progress) {
    for (const std::string& channel :
         {options_.scan_channel, options_.odometry_channel, options_.reference_channel}) {
      if (Status raw = check_raw_channel(channel); !raw) return raw;
    }
    auto reader = LogReader::open(options_.input.string());
    if (!reader) return reader.error();
    for (;;) {
      auto event = reader->next();
      if (!event) {
        find(event.error().message);
        continue;
      }
      if (!event->has_value()) break;
      take(**event);
      if (progress) progress(static_cast<double>(reader->offset()), static_cast<double>(reader->size()));
    }
    return check();
  }

  RecordedDrive drive;

 private:
  void find(std::string what) {
    ++report_.refused;
    if (report_.findings.size() < 20) report_.findings.push_back(std::move(what));
  }

  template <class T>
  bool decoded(const Message& event, std::vector<T>& items) {
    T item;
    if (const Status read = decode(event.channel, event.payload, item); !read) {
      find(options_.input.string() + ": " + read.error().message);
      return false;
    }
    items.push_back(std::move(item));
    return true;
  }

  void take(const Message& event) {
    if (event.channel == channel::kRobot && yaml_.empty()) {
      RobotMessage message;
      if (decode(event.channel, event.payload, message).ok()) yaml_ = message.yaml;
    } else if (event.channel == options_.scan_channel) {
      if (decoded(event, drive.scans)) drive.events.push_back({true, drive.scans.size() - 1});
    } else if (event.channel == options_.odometry_channel) {
      if (decoded(event, drive.odometry)) drive.events.push_back({false, drive.odometry.size() - 1});
    } else if (!options_.reference_channel.empty() && event.channel == options_.reference_channel) {
      decoded(event, drive.reference);
    }
  }

  Error missing(const std::string& channel) const {
    return {options_.input.string() + ": holds no event on " + channel +
            " that can be read; is it the right channel?"};
  }

  Status check() {
    if (drive.scans.empty()) return missing(options_.scan_channel);
    if (drive.odometry.empty()) return missing(options_.odometry_channel);
    if (!options_.reference_channel.empty() && drive.reference.empty())
      return missing(options_.reference_channel);
    if (options_.robot.empty() && yaml_.empty()) {
      return Error{options_.input.string() + ": has no " + channel::kRobot +
                   " event; describe the robot with --robot FILE"};
    }
    auto robot = options_.robot.empty()
                     ? parse_robot_description(yaml_, options_.input.string() + ", channel ROBOT")
                     : load_robot_description(options_.robot.string());
    if (!robot) return robot.error();
    if (!robot->laser)
      return Error{options_.input.string() + ": the robot description has no laser: nothing to calibrate"};
    report_.before = std::move(*robot);
    return {};
  }

  const CalibrationOptions& options_;
  CalibrationReport& report_;
  std::string yaml_;
};

/// Events [first, last) of a drive. All of its odometry and reference stays: they are looked up by stamp.
RecordedDrive part_of(const RecordedDrive& whole, std::size_t first, std::size_t last) {
  RecordedDrive part = whole;
  part.events.assign(whole.events.begin() + static_cast<std::ptrdiff_t>(first),
                     whole.events.begin() + static_cast<std::ptrdiff_t>(last));
  return part;
}

struct TrackedDrive {
  pose::DriveMotion motion;
  pose::GridMap map;
};

/// SLAM over a part of a drive.
Result<TrackedDrive> tracked(const RecordedDrive& drive, const RobotDescription& robot,
                             const CalibrationOptions& options, const CalibrationProgress& progress) {
  const RobotDescription weak = pose::with_weak_odometry(robot);
  auto slam = options.map.empty() ? pose::make_mapper(weak, {})
                                  : pose::make_localizer(weak, options.map.string(), {});
  if (!slam) return slam.error();
  std::vector<PoseEstimate> estimates;
  std::size_t done = 0;
  for (const RecordedDrive::Event& event : drive.events) {
    if (progress) progress(static_cast<double>(++done), static_cast<double>(drive.events.size()));
    if (!event.scan) {
      (*slam)->add(drive.odometry[event.index]);
    } else if (auto estimate = (*slam)->add(drive.scans[event.index])) {
      estimates.push_back(std::move(*estimate));
    }
  }
  if (options.map.empty()) estimates = (*slam)->finish();
  TrackedDrive result{{drive.odometry, {}, drive.reference}, (*slam)->grid_map()};
  bool linked = true;
  for (const PoseEstimate& estimate : estimates) {
    const bool known = estimate.state == SlamState::tracking;
    if (known)
      result.motion.laser.push_back(
          {estimate.stamp, planar(estimate.T_map_base * robot.laser->T_base_laser), linked});
    linked = known;
  }
  return result;
}

/// The parts of the drive that calibrate and that check.
struct Parts {
  RecordedDrive calibrating, validation;
};

Parts split(const RecordedDrive& drive, const CalibrationOptions& options) {
  const auto events = static_cast<double>(drive.events.size());
  const double kept =
      options.validate_on_start ? options.validation_fraction : 1 - options.validation_fraction;
  const auto at = static_cast<std::size_t>(std::lround(kept * events));
  RecordedDrive first = part_of(drive, 0, at), second = part_of(drive, at, drive.events.size());
  if (options.validate_on_start) std::swap(first, second);
  return {std::move(first), std::move(second)};
}

std::size_t scans_of(const RecordedDrive& drive) {
  return static_cast<std::size_t>(std::count_if(drive.events.begin(), drive.events.end(),
                                                [](const RecordedDrive::Event& e) { return e.scan; }));
}

CalibrationProgress share(const CalibrationProgress& progress, double from, double to) {
  if (!progress) return {};
  return [&progress, from, to](double done, double total) {
    progress(from + (to - from) * done / std::max(total, 1.0), 100);
  };
}

Error in_file(const CalibrationOptions& options, const Error& error) {
  return {options.input.string() + ", " + options.scan_channel + " and " + options.odometry_channel + ": " +
          error.message};
}

Status check_on(const RecordedDrive& validation, const CalibrationOptions& options, CalibrationReport& report,
                const CalibrationProgress& progress) {
  const auto other = tracked(validation, report.after, options, progress);
  if (!other) return other.error();
  const pose::MotionParameters old = pose::motion_parameters(report.before);
  report.check_before = pose::check_motion(other->motion, old, kWindow);
  report.check_after = pose::check_motion(other->motion, report.motion.parameters, kWindow);
  report.path_before = pose::reckoned_path(other->motion, old);
  report.path_after = pose::reckoned_path(other->motion, report.motion.parameters);
  report.map = other->map;
  return {};
}

/// Walls do not need motion: a laser is learned where they suffice, and keeps its preset elsewhere.
void learn_noise(const RecordedDrive& drive, CalibrationReport& report) {
  std::vector<Scan> scans;
  for (const RecordedDrive::Event& event : drive.events) {
    if (event.scan) scans.push_back(drive.scans[event.index]);
  }
  auto learned = scan::learn_laser(scans, *report.after.laser);
  if (!learned) {
    report.laser_note = learned.error().message;
    return;
  }
  report.laser = std::move(*learned);
  report.after.laser = scan::with_learned(*report.after.laser, *report.laser);
}

/// A scan that is not corrected for its sweep stands for any instant of it.
void add_sweep(const LaserDescription& laser, std::size_t beams, pose::MotionCalibration& motion) {
  if (beams == 0) return;
  const double sweep = (laser.beam_time(beams - 1, beams) - laser.beam_time(0, beams)).seconds();
  auto& offset = motion.measured[static_cast<std::size_t>(pose::MotionParameter::time_offset)];
  offset.sigma = std::hypot(offset.sigma, sweep / std::sqrt(12.0));
}

}  // namespace

Result<CalibrationReport> calibrate_log(const CalibrationOptions& options,
                                        const CalibrationProgress& progress) {
  CalibrationReport report;
  DriveReader reader(options, report);
  if (const Status read = reader.read(share(progress, 0, 5)); !read) return read.error();
  const Parts parts = split(reader.drive, options);
  report.scans = scans_of(parts.calibrating);
  report.validation_scans = scans_of(parts.validation);
  report.after = report.before;
  // Repeated, as SLAM corrects scans for the motion during a sweep with what the round before found, and its
  // poses still lean towards that a little.
  constexpr double kFractions[] = {5, 28, 52, 75};
  for (int round = 0; round < 3; ++round) {
    const auto drive = tracked(parts.calibrating, report.after, options,
                               share(progress, kFractions[round], kFractions[round + 1]));
    if (!drive) return in_file(options, drive.error());
    auto motion = pose::calibrate_motion(drive->motion, pose::motion_parameters(report.before));
    if (!motion) return in_file(options, motion.error());
    report.motion = std::move(*motion);
    report.after = pose::with_motion_parameters(report.before, report.motion.parameters);
  }
  add_sweep(*report.before.laser, reader.drive.scans.front().ranges.size(), report.motion);
  learn_noise(parts.calibrating, report);
  if (report.validation_scans == 0) return report;
  if (const Status checked = check_on(parts.validation, options, report, share(progress, 75, 100)); !checked)
    return in_file(options, checked.error());
  return report;
}

}  // namespace parhelion::tools
