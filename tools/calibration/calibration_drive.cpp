#include "tools/calibration/calibration_drive.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

#include "fusion/pose/calibration/motion_calibration.hpp"
#include "fusion/pose/calibration/recorded_sweeps.hpp"
#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "tools/calibration/calibration_log.hpp"
#include "tools/slam/slam_log.hpp"
#include "tools/validate_log.hpp"

namespace parhelion::tools {
namespace {

using Kind = RecordedDrive::Event::Kind;

class DriveReader {
 public:
  explicit DriveReader(const CalibrationOptions& options) : options_(options) {}

  Status read(const CalibrationProgress& progress) {
    for (const std::string& channel :
         {options_.scan_channel, options_.odometry_channel, options_.reference_channel, options_.imu_channel,
          options_.camera_channel, options_.depth_channel}) {
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
    report_refused();
    return check();
  }

  ReadDrive result;

 private:
  void find(std::string what) {
    ++result.refused;
    const auto same = std::find_if(refused_.begin(), refused_.end(),
                                   [&what](const auto& refused) { return refused.first == what; });
    if (same != refused_.end())
      ++same->second;
    else if (refused_.size() < kKinds)
      refused_.emplace_back(std::move(what), 1);
  }

  void report_refused() {
    std::uint64_t listed = 0;
    for (const auto& [what, times] : refused_) {
      listed += times;
      result.findings.push_back(times == 1 ? what : what + " (" + std::to_string(times) + " times)");
    }
    if (listed < result.refused)
      result.findings.push_back("and " + std::to_string(result.refused - listed) +
                                " others that cannot be read");
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

  template <class T>
  bool take_sample(const Message& event, Kind kind, std::vector<T>& samples) {
    if (!decoded(event, samples)) return false;
    result.drive.events.push_back({kind, samples.size() - 1});
    return true;
  }

  void take(const Message& event) {
    RecordedDrive& drive = result.drive;
    if (event.channel == channel::kRobot && yaml_.empty()) {
      RobotMessage message;
      if (decode(event.channel, event.payload, message).ok()) yaml_ = message.yaml;
    } else if (event.channel == options_.scan_channel) {
      if (take_sample(event, Kind::scan, drive.scans))
        result.scan_arrivals.add(drive.scans.back().stamp, event.arrival);
    } else if (event.channel == options_.odometry_channel) {
      if (take_sample(event, Kind::odometry, drive.odometry))
        result.odometry_arrivals.add(drive.odometry.back().stamp, event.arrival);
    } else if (event.channel == options_.imu_channel) {
      take_sample(event, Kind::inertial, drive.inertial);
    } else if (event.channel == options_.camera_channel) {
      ++result.images;
    } else if (event.channel == options_.depth_channel) {
      ++result.depth_images;
    } else if (!options_.reference_channel.empty() && event.channel == options_.reference_channel) {
      decoded(event, drive.reference);
    }
  }

  Error missing(const std::string& channel) const {
    return holds_no_event(options_.input.string(), channel, result.findings);
  }

  Status check() {
    if (result.drive.scans.empty()) return missing(options_.scan_channel);
    if (result.drive.odometry.empty()) return missing(options_.odometry_channel);
    if (!options_.reference_channel.empty() && result.drive.reference.empty())
      return missing(options_.reference_channel);
    // The usual names may be absent; another name is one that somebody wants to be used.
    if (options_.imu_channel != CalibrationOptions().imu_channel && result.drive.inertial.empty())
      return missing(options_.imu_channel);
    if (options_.camera_channel != CalibrationOptions().camera_channel && result.images == 0)
      return missing(options_.camera_channel);
    if (options_.depth_channel != CalibrationOptions().depth_channel && result.depth_images == 0)
      return missing(options_.depth_channel);
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
    result.robot = std::move(*robot);
    return {};
  }

  static constexpr std::size_t kKinds = 20;  ///< of refused events that are listed
  const CalibrationOptions& options_;
  std::string yaml_;
  std::vector<std::pair<std::string, std::uint64_t>> refused_;  ///< what, and how often
};

/// Events [first, last) of a drive.
RecordedDrive part_of(const RecordedDrive& whole, std::size_t first, std::size_t last) {
  RecordedDrive part = whole;
  part.events.assign(whole.events.begin() + static_cast<std::ptrdiff_t>(first),
                     whole.events.begin() + static_cast<std::ptrdiff_t>(last));
  return part;
}

/// Odometry in the order of arrival, but before the scans of its instants.
class OdometryFeed {
 public:
  OdometryFeed(const RecordedDrive& drive, double time_offset, pose::Slam& slam)
      : drive_(drive), offset_(seconds(time_offset)), slam_(slam) {
    const auto first = std::find_if(drive.events.begin(), drive.events.end(),
                                    [](const RecordedDrive::Event& e) { return e.kind == Kind::odometry; });
    next_ = first == drive.events.end() ? drive.odometry.size() : first->index;
  }

  void arrived(std::size_t index) {
    while (next_ <= index) slam_.add(drive_.odometry[next_++]);
  }
  void up_to(SensorTime scan) {
    constexpr Duration after = milliseconds(100), before = seconds(1.0);
    for (; next_ < drive_.odometry.size(); ++next_) {
      const SensorTime then = drive_.odometry[next_].stamp + offset_;
      // Of another clock, or one that has been set: only the order of arrival is known.
      if (then > scan + after || then < scan - before) return;
      slam_.add(drive_.odometry[next_]);
    }
  }

 private:
  const RecordedDrive& drive_;
  Duration offset_;
  pose::Slam& slam_;
  std::size_t next_ = 0;
};

std::vector<PoseEstimate> estimates_of(const RecordedDrive& drive, OdometryFeed& odometry, pose::Slam& slam,
                                       const CalibrationProgress& progress) {
  std::vector<PoseEstimate> estimates;
  std::size_t done = 0;
  for (const RecordedDrive::Event& event : drive.events) {
    if (progress) progress(static_cast<double>(++done), static_cast<double>(drive.events.size()));
    if (event.kind == Kind::odometry) {
      odometry.arrived(event.index);
    } else if (event.kind == Kind::inertial) {
      slam.add_inertial(drive.inertial[event.index]);
    } else {
      odometry.up_to(drive.scans[event.index].stamp);
      if (auto estimate = slam.add(drive.scans[event.index])) estimates.push_back(std::move(*estimate));
    }
  }
  return estimates;
}

/// Stamps of the first and the last scan; equal where there is none, or where a clock jumped back.
std::pair<SensorTime, SensorTime> span_of(const RecordedDrive& drive) {
  std::optional<std::pair<SensorTime, SensorTime>> span;
  for (const RecordedDrive::Event& event : drive.events) {
    if (event.kind != Kind::scan) continue;
    const SensorTime stamp = drive.scans[event.index].stamp;
    if (!span) span.emplace(stamp, stamp);
    span->second = std::max(span->second, stamp);
  }
  return span.value_or(std::pair<SensorTime, SensorTime>{});
}

}  // namespace

std::size_t RecordedDrive::scan_events() const {
  return static_cast<std::size_t>(
      std::count_if(events.begin(), events.end(), [](const Event& e) { return e.kind == Kind::scan; }));
}

Result<ReadDrive> read_drive(const CalibrationOptions& options, const CalibrationProgress& progress) {
  DriveReader reader(options);
  if (const Status read = reader.read(progress); !read) return read.error();
  return std::move(reader.result);
}

DriveParts split_drive(const RecordedDrive& drive, const CalibrationOptions& options) {
  const auto events = static_cast<double>(drive.events.size());
  const double kept =
      options.validate_on_start ? options.validation_fraction : 1 - options.validation_fraction;
  const auto at = static_cast<std::size_t>(std::lround(kept * events));
  RecordedDrive first = part_of(drive, 0, at), second = part_of(drive, at, drive.events.size());
  if (options.validate_on_start) std::swap(first, second);
  return {std::move(first), std::move(second)};
}

Result<TrackedDrive> track_drive(const RecordedDrive& drive, const RobotDescription& robot, Deskew deskew,
                                 const CalibrationOptions& options, const CalibrationProgress& progress) {
  const RobotDescription weak = pose::with_weak_odometry(robot);
  const pose::RecordedSweeps sweeps(drive.odometry, robot.odometry, *robot.laser,
                                    drive.scans.front().ranges.size());
  pose::SlamOptions slam_options;
  if (deskew == Deskew::recorded)
    slam_options.sweep_motion = [&sweeps](SensorTime stamp) { return sweeps.at(stamp); };
  slam_options.doubt_mounting = false;
  auto slam = options.map.empty() ? pose::make_mapper(weak, slam_options)
                                  : pose::make_localizer(weak, options.map.string(), slam_options);
  if (!slam) return slam.error();
  OdometryFeed odometry(drive, robot.odometry.time_offset, **slam);
  std::vector<PoseEstimate> estimates = estimates_of(drive, odometry, **slam, progress);
  if (options.map.empty()) estimates = (*slam)->finish();
  TrackedDrive result{{drive.odometry, {}, drive.reference},
                      (*slam)->grid_map(),
                      (*slam)->odometry_findings(),
                      {},
                      {},
                      drive.scan_events()};
  std::tie(result.first_scan, result.last_scan) = span_of(drive);
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

}  // namespace parhelion::tools
