// MRPT rawlogs, both formats. With rawlog_reader.cpp the only file here that includes MRPT.
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CActionRobotMovement3D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservationOdometry.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "protocols/channels.hpp"
#include "tools/import/first_stamp.hpp"
#include "tools/import/importers.hpp"
#include "tools/import/laser_evidence.hpp"
#include "tools/import/rawlog_reader.hpp"
#include "tools/import/recording_writer.hpp"
#include "tools/import/report_bytes.hpp"

namespace parhelion::tools {
namespace {

namespace obs = mrpt::obs;

/// MRPT counts 100 ns since 1601; 0 means not set. Implausible times are refused when they are written.
SensorTime sensor_time(const mrpt::system::TTimeStamp& stamp) {
  constexpr std::int64_t epoch_1970 = 116'444'736'000'000'000, farthest = 90'000'000'000'000'000;
  const auto ticks = static_cast<std::int64_t>(stamp.time_since_epoch().count());
  if (ticks < 0) return {-1'000'000'000};
  return {std::clamp(ticks - epoch_1970, -farthest, farthest) * 100};
}

std::string label_of(const obs::CObservation& observation) {
  return observation.sensorLabel.empty() ? "(no label)" : observation.sensorLabel;
}

Transform<Base, Laser> sensor_pose(const mrpt::poses::CPose3D& pose) {
  Eigen::Isometry3d isometry = Eigen::Isometry3d::Identity();
  const auto rotation = pose.getRotationMatrix();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) isometry.linear()(row, column) = rotation(row, column);
  }
  isometry.translation() = Eigen::Vector3d(pose.x(), pose.y(), pose.z());
  return Transform<Base, Laser>(isometry);
}

/// Angles are implicit: centred on the sensor's x axis, from the aperture and the sense of rotation. A
/// flagged beam keeps its value if that cannot be taken for a range, else it is NaN. Error: too few beams for
/// a step.
Result<Scan> to_scan(const obs::CObservation2DRangeScan& observation) {
  const std::size_t n = observation.getScanSize();
  if (n < 2) return Error{"a scan of " + std::to_string(n) + " beams, which has no angle step"};
  Scan scan;
  scan.stamp = sensor_time(observation.timestamp);
  const double sense = observation.rightToLeft ? 1 : -1;
  const double aperture = observation.aperture;
  scan.angle_min = static_cast<float>(-sense * aperture / 2);
  scan.angle_increment = static_cast<float>(sense * aperture / static_cast<double>(n - 1));
  scan.ranges.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const float range = observation.getScanRange(i);
    const bool looks_valid = range > 0 && range < observation.maxRange;
    scan.ranges[i] =
        !observation.getScanRangeValidity(i) && looks_valid ? std::numeric_limits<float>::quiet_NaN() : range;
  }
  if (observation.hasIntensity()) {
    scan.intensities.resize(n);
    for (std::size_t i = 0; i < n; ++i)
      scan.intensities[i] = static_cast<float>(observation.getScanIntensity(i));
  }
  return scan;
}

Transform<Odom, Base> planar(const mrpt::poses::CPose2D& pose) {
  return Transform<Odom, Base>::planar(pose.x(), pose.y(), pose.phi());
}

struct LaserSeen {
  LaserEvidence evidence;
  std::uint64_t scans = 0, moved = 0;
  Transform<Base, Laser> T_base_laser;
};

/// First pass: collects the sensors and their formats.
class Survey final : public RawlogVisitor {
 public:
  std::map<std::string, LaserSeen> lasers;
  std::map<std::string, std::uint64_t> odometers;
  std::uint64_t actions = 0;
  FirstStamp first_stamp;

  Status action(const obs::CActionCollection&, Place) override {
    ++actions;
    return {};
  }
  Status observation(const obs::CObservation& one, Place) override {
    if (dynamic_cast<const obs::CObservationOdometry*>(&one) != nullptr) {
      ++odometers[label_of(one)];
      see(sensor_time(one.timestamp));
    } else if (const auto* range_scan = dynamic_cast<const obs::CObservation2DRangeScan*>(&one)) {
      see_scan(*range_scan);
    }
    return {};
  }
  void other(const std::string&) override {}
  void damage(Place, const std::string&) override {}

 private:
  void see(SensorTime stamp) { first_stamp.add(stamp); }
  void see_scan(const obs::CObservation2DRangeScan& observation) {
    const auto scan = to_scan(observation);
    if (!scan) return;
    see(scan->stamp);
    LaserSeen& laser = lasers[label_of(observation)];
    const auto pose = sensor_pose(observation.sensorPose);
    if (laser.scans++ == 0) {
      laser.T_base_laser = pose;
      describe(observation, laser.evidence);
    } else if (!pose.isometry().isApprox(laser.T_base_laser.isometry(), 1e-6)) {
      ++laser.moved;
    }
    laser.evidence.add(*scan);
  }
  static void describe(const obs::CObservation2DRangeScan& observation, LaserEvidence& evidence) {
    evidence.T_base_laser = sensor_pose(observation.sensorPose);
    evidence.height_known = true;
    evidence.range_max = observation.maxRange;
    evidence.noise_sigma = observation.stdError;
    // MRPT's drivers read the clock when the whole scan has arrived.
    evidence.stamp_beam = LaserDescription::StampBeam::last;
    char text[240];
    std::snprintf(
        text, sizeof text,
        "MRPT scan, label '%s', aperture %.9g rad, %s, maxRange %g m, stdError %g m, beamAperture %g rad, "
        "deltaPitch %g rad",
        observation.sensorLabel.c_str(), static_cast<double>(observation.aperture),
        observation.rightToLeft ? "right to left" : "left to right",
        static_cast<double>(observation.maxRange), static_cast<double>(observation.stdError),
        static_cast<double>(observation.beamAperture), observation.deltaPitch);
    evidence.source = text;
  }
};

/// Labels of the sensors to import.
struct Sensors {
  LaserTopics lasers;
  std::optional<std::string> odometer;
};

/// Second pass: writes the log.
class Copy final : public RawlogVisitor {
 public:
  Copy(RecordingWriter& writer, Sensors sensors) : writer_(writer), sensors_(std::move(sensors)) {}

  /// Paired format: the odometry frame's origin is at the start of the recording.
  void start_at_origin() { pending_ = true; }

  Status action(const obs::CActionCollection& actions, Place) override {
    for (std::size_t i = 0; i < actions.size(); ++i) {
      const obs::CAction& any = actions.get(i);
      if (const auto* move = dynamic_cast<const obs::CActionRobotMovement2D*>(&any)) {
        const bool wheels = move->estimationMethod == obs::CActionRobotMovement2D::emOdometry;
        advance(wheels || !move->poseChange ? move->rawOdometryIncrementReading
                                            : mrpt::poses::CPose2D(move->poseChange->getMeanVal()));
      } else if (const auto* move3 = dynamic_cast<const obs::CActionRobotMovement3D*>(&any)) {
        advance(mrpt::poses::CPose2D(move3->poseChange.getMeanVal()));
      } else {
        other(any.GetRuntimeClass()->className);
      }
    }
    return {};
  }

  Status observation(const obs::CObservation& one, Place place) override {
    if (const auto* wheels = dynamic_cast<const obs::CObservationOdometry*>(&one)) {
      if (sensors_.odometer != label_of(one)) return leave_out("odometry " + label_of(one));
      return writer_.put(channel::kOdometry, Odometry{sensor_time(one.timestamp), planar(wheels->odometry)},
                         place);
    }
    if (const auto* range_scan = dynamic_cast<const obs::CObservation2DRangeScan*>(&one)) {
      if (sensors_.lasers.lines == label_of(one)) return put_lines(*range_scan, place);
      if (sensors_.lasers.scan != label_of(one)) return leave_out("scan " + label_of(one));
      return put_scan(*range_scan, place);
    }
    return leave_out(one.GetRuntimeClass()->className);
  }

  void other(const std::string& class_name) override { writer_.leave_out(class_name); }
  void damage(Place place, const std::string& what) override { writer_.refuse_damage(place, what); }
  void read_one() override { writer_.count_read(); }

 private:
  Status leave_out(const std::string& kind) {
    writer_.leave_out(kind);
    return {};
  }

  void advance(const mrpt::poses::CPose2D& increment) {
    T_odom_base_ = T_odom_base_ * planar(increment).as<Base, Base>();  // from the previous pose
    pending_ = true;
  }

  Status put_lines(const obs::CObservation2DRangeScan& observation, Place place) {
    const auto scan = to_scan(observation);
    if (scan) return writer_.put(channel::kLines, *scan, place);
    writer_.refuse(place, scan.error().message);
    return {};
  }

  Status put_scan(const obs::CObservation2DRangeScan& observation, Place place) {
    const auto scan = to_scan(observation);
    if (!scan) {
      writer_.refuse(place, scan.error().message);
      return {};
    }
    if (pending_) {
      pending_ = false;
      if (Status done = writer_.put(channel::kOdometry, Odometry{scan->stamp, T_odom_base_}, place); !done)
        return done;
    }
    return writer_.put(channel::kScan, *scan, place);
  }

  RecordingWriter& writer_;
  Sensors sensors_;
  Transform<Odom, Base> T_odom_base_;
  bool pending_ = false;
};

template <class V>
std::vector<std::string> keys(const std::map<std::string, V>& map) {
  std::vector<std::string> names;
  for (const auto& entry : map) names.push_back(entry.first);
  return names;
}

Result<LaserDescription> describe_laser(const ImportOptions& options, const LaserSeen& seen,
                                        std::vector<std::string>& notes) {
  auto laser = seen.evidence.describe(options, notes);
  if (laser && seen.moved > 0) {
    notes.push_back("the laser moves on the robot: " + std::to_string(seen.moved) +
                    " scans have another laser pose than the first; the description has that of the first");
  }
  return laser;
}

Result<RobotDescription> describe(const ImportOptions& options, const Survey& survey, const Sensors& sensors,
                                  std::vector<std::string>& notes) {
  auto laser = describe_laser(options, survey.lasers.at(*sensors.lasers.scan), notes);
  if (!laser) return laser.error();
  RobotDescription robot = describe_robot(options, std::move(*laser), notes);
  if (!sensors.lasers.lines) return robot;
  auto lines = describe_laser(options, survey.lasers.at(*sensors.lasers.lines), notes);
  if (!lines) return lines.error();
  robot.line_laser = LineLaserDescription{std::move(*lines), {}};
  return robot;
}

Result<Sensors> choose_sensors(const ImportOptions& options, const Survey& survey) {
  auto lasers = choose_lasers(options, keys(survey.lasers), "2D range scan");
  if (!lasers) return lasers.error();
  if (!lasers->scan) {
    return Error{options.input.string() +
                 ": no 2D range scan in it: a rawlog with CObservation2DRangeScan is expected"};
  }
  auto odometer = choose_topic(options, channel::kOdometry, keys(survey.odometers), "odometry");
  if (!odometer) return odometer.error();
  return Sensors{std::move(*lasers), std::move(*odometer)};
}

/// In the process that may crash.
Result<ImportReport> import_here(const ImportOptions& options, const RawlogReading& reading) {
  const std::string path = options.input.string();
  const auto size = static_cast<double>(std::filesystem::file_size(options.input));
  // Two passes, each half of the progress.
  const auto pass = [&](double begun) -> RawlogReading {
    return {path, reading.crashing, reading.before_object,
            [&reading, begun](double done) { reading.progress(begun + done / 2); }};
  };
  Survey survey;
  if (const Status read = read_rawlog(pass(0), survey); !read) return read.error();
  const auto sensors = choose_sensors(options, survey);
  if (!sensors) return sensors.error();
  const bool paired = survey.actions > 0;

  std::vector<std::string> notes;
  auto robot = describe(options, survey, *sensors, notes);
  if (!robot) return robot.error();
  if (paired) notes.push_back("odometry accumulated from actions, stamped at the scan that each leads to");
  robot->source += "; " + joined(notes);
  auto writer = RecordingWriter::create(options, options.input.filename().string() + ", object ", "objects");
  if (!writer) return writer.error();
  for (std::string& note : notes) writer->note(std::move(note));
  if (const Status written = writer->describe(*robot, *survey.first_stamp.get()); !written)
    return written.error();
  Copy copy(*writer, *sensors);
  if (paired && !sensors->odometer) copy.start_at_origin();
  if (const Status read = read_rawlog(pass(size / 2), copy); !read) return read.error();
  return writer->finish();
}

}  // namespace

Result<ImportReport> import_rawlog(const ImportOptions& options, const ImportProgress& progress) {
  std::error_code unknown;
  const auto size = static_cast<double>(std::filesystem::file_size(options.input, unknown));
  const auto bytes = work_on_rawlog(
      options.input.string(),
      [&](const RawlogReading& reading) { return to_bytes(import_here(options, reading)); },
      [&](double done) {
        if (progress) progress(done, size);
      });
  if (bytes) return import_result(*bytes);
  RecordingWriter::remove_unfinished(options);
  return bytes.error();
}

}  // namespace parhelion::tools
