// MRPT rawlogs, both formats. The only file here that includes MRPT.
#include <mrpt/io/CStream.h>
#include <mrpt/obs/CActionCollection.h>
#include <mrpt/obs/CActionRobotMovement2D.h>
#include <mrpt/obs/CActionRobotMovement3D.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/obs/CSensoryFrame.h>
#include <mrpt/serialization/CArchive.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <limits>
#include <new>
#include <set>
#include <utility>

#include "protocols/channels.hpp"
#include "tools/import/first_stamp.hpp"
#include "tools/import/gzip_file.hpp"
#include "tools/import/importers.hpp"
#include "tools/import/isolation.hpp"
#include "tools/import/laser_evidence.hpp"
#include "tools/import/recording_writer.hpp"

namespace parhelion {
namespace {

namespace obs = mrpt::obs;

constexpr std::uint64_t parent_headroom = 1ULL << 30, child_headroom = 1ULL << 29;  // bytes
constexpr int most_crashes = 200;

/// MRPT's own gzip stream can't step back to where a damaged object began.
class Stream final : public mrpt::io::CStream {
 public:
  explicit Stream(GzipFile& file) : file_(file) {}
  std::size_t Read(void* buffer, std::size_t count) override { return file_.read(buffer, count); }
  std::size_t Write(const void*, std::size_t) override { return 0; }
  std::uint64_t Seek(std::int64_t offset, TSeekOrigin origin) override {
    const auto from = origin == sFromCurrent ? static_cast<std::int64_t>(file_.position()) : 0;
    file_.seek(static_cast<std::uint64_t>(std::max<std::int64_t>(0, from + offset)));
    return file_.position();
  }
  std::uint64_t getTotalBytesCount() const override { return std::numeric_limits<std::uint64_t>::max(); }
  std::uint64_t getPosition() const override { return file_.position(); }

 private:
  GzipFile& file_;
};

/// A top-level object starts with 0x80 | length of its class name.
bool is_top_level_class(std::string name) {
  if (name.starts_with("mrpt::obs::")) name = name.substr(11);
  return name == "CSensoryFrame" || name == "CActionCollection" || name.starts_with("CObservation");
}

/// Moves to the next place where a top-level object may begin.
bool resynchronize(GzipFile& file) {
  for (int byte = file.next_byte(); byte >= 0; byte = file.next_byte()) {
    const int length = byte & 0x7F;
    if ((byte & 0x80) == 0 || length < 12 || length > 60) continue;
    const std::uint64_t start = file.position();
    std::string name(static_cast<std::size_t>(length), '\0');
    const bool found = file.read(name.data(), name.size()) == name.size() && is_top_level_class(name);
    file.seek(found ? start - 1 : start);
    if (found) return true;
  }
  return false;
}

struct RawlogVisitor {
  virtual ~RawlogVisitor() = default;
  virtual Status action(const obs::CActionCollection& actions, Place place) = 0;
  virtual Status observation(const obs::CObservation& observation, Place place) = 0;
  virtual void other(const std::string& class_name) = 0;
  virtual void damage(Place place, const std::string& what) = 0;
  virtual void read_one() {}
};

Status visit(const mrpt::serialization::CSerializable& object, RawlogVisitor& visitor, Place place) {
  if (const auto* actions = dynamic_cast<const obs::CActionCollection*>(&object)) {
    return visitor.action(*actions, place);
  }
  if (const auto* frame = dynamic_cast<const obs::CSensoryFrame*>(&object)) {
    for (const auto& part : *frame) {
      if (Status done = visitor.observation(*part, place); !done) return done;
    }
    return {};
  }
  if (const auto* one = dynamic_cast<const obs::CObservation*>(&object))
    return visitor.observation(*one, place);
  visitor.other(object.GetRuntimeClass()->className);
  return {};
}

std::string first_line_of(const std::exception& error) {
  // MRPT's messages are several lines long, "Message:" first.
  std::string text = error.what();
  if (const auto at = text.find("Message:"); at != std::string::npos) text = text.substr(at + 8);
  text = text.substr(0, text.find('\n'));
  text.erase(0, text.find_first_not_of(' '));
  return text.substr(0, 160);
}

/// How much of the file can be believed.
struct Trust {
  bool intact = false;               ///< its checksum is right: MRPT wrote all of it
  std::set<std::uint64_t> crashing;  ///< bytes at which objects start that MRPT can't survive
};

struct Reading {
  std::string path;
  const Trust& trust;
  std::function<void(std::uint64_t)> before_object;  ///< told where each object starts
  std::function<void(double)> progress;              ///< told bytes done, of the file as it lies on disk
};

/// One object; what is wrong with it, or empty.
Result<std::string> read_object(mrpt::serialization::CArchive& archive, RawlogVisitor& visitor, Place place) {
  try {
    const auto object = archive.ReadObject();
    if (!object) return std::string("no object here");
    visitor.read_one();
    if (const Status done = visit(*object, visitor, place); !done) return done.error();
    return std::string();
  } catch (const std::bad_alloc&) {
    return std::string("a count that can't be");
  } catch (const std::exception& error) {
    return first_line_of(error);
  }
}

/// Every object of the file, in its order. After a damaged one reading goes on at the next that can be
/// recognised.
Status read_rawlog(const Reading& reading, RawlogVisitor& visitor) {
  GzipFile file(reading.path);
  if (!file.is_open()) return Error{reading.path + ": can't be opened: " + std::strerror(errno)};
  Stream stream(file);
  auto archive = mrpt::serialization::archiveFrom(stream);
  bool damaged = false;
  for (Place place = 1;; ++place) {
    const std::uint64_t start = file.position();
    if (file.next_byte() < 0) {
      if (file.damaged() && !damaged) {
        visitor.damage(place, "the compressed data ends or is damaged at byte " + std::to_string(start) +
                                  " of the inflated file; what follows can't be read");
      }
      return {};
    }
    file.seek(start);
    if (reading.before_object) reading.before_object(start);
    const auto what = reading.trust.crashing.count(start) > 0
                          ? Result<std::string>(std::string("MRPT can't read it"))
                          : read_object(archive, visitor, place);
    if (!what) return what.error();
    // The parts of a damaged object look like objects too: one refusal for all that can't be read in a row.
    const bool was_damaged = std::exchange(damaged, !what->empty());
    if (damaged) {
      if (!was_damaged) {
        visitor.damage(place, "object at byte " + std::to_string(start) +
                                  " of the inflated file can't be read: " + *what);
      }
      file.seek(start + 1);
      if (!resynchronize(file)) return {};
    }
    if (reading.progress && place % 64 == 0)
      reading.progress(static_cast<double>(file.compressed_position()));
  }
}

/// MRPT counts 100 ns since 1601; 0 is its word for "not set". What no clock says is refused when it is
/// written.
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

/// Angles are implied: centred on the sensor's x axis, from the aperture and the sense of rotation. A flagged
/// beam keeps what stands there where that can't be taken for a range, else it is NaN. Error: too few beams
/// to have a step.
Result<Scan> to_scan(const obs::CObservation2DRangeScan& observation) {
  const std::size_t n = observation.getScanSize();
  if (n < 2) return Error{"a scan of " + std::to_string(n) + " beams, which has no angle step"};
  Scan scan;
  scan.stamp = sensor_time(observation.timestamp);
  const double sense = observation.rightToLeft ? 1 : -1;
  const double aperture = observation.aperture;
  scan.angle_first = static_cast<float>(-sense * aperture / 2);
  scan.angle_step = static_cast<float>(sense * aperture / static_cast<double>(n - 1));
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

/// First reading: which sensors there are and how they write.
class Survey final : public RawlogVisitor {
 public:
  std::map<std::string, LaserSeen> lasers;
  std::map<std::string, std::uint64_t> odometers;
  std::uint64_t actions = 0;
  FirstStamp first;

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
  void see(SensorTime stamp) { first.see(stamp); }
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
    // MRPT's drivers read the clock when the whole scan has come in.
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

/// Second reading: writes.
class Copy final : public RawlogVisitor {
 public:
  Copy(RecordingWriter& writer, std::optional<std::string> laser, std::optional<std::string> odometer)
      : writer_(writer), laser_(std::move(laser)), odometer_(std::move(odometer)) {}

  /// Paired format: the origin of the odometry frame is where the recording begins.
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
      if (odometer_ != label_of(one)) return leave_out("odometry " + label_of(one));
      return writer_.put(channel::odometry, Odometry{sensor_time(one.timestamp), planar(wheels->odometry)},
                         place);
    }
    if (const auto* range_scan = dynamic_cast<const obs::CObservation2DRangeScan*>(&one)) {
      if (laser_ != label_of(one)) return leave_out("scan " + label_of(one));
      return put_scan(*range_scan, place);
    }
    return leave_out(one.GetRuntimeClass()->className);
  }

  void other(const std::string& class_name) override { writer_.leave_out(class_name); }
  void damage(Place place, const std::string& what) override { writer_.refuse(place, what); }
  void read_one() override { writer_.count_read(); }

 private:
  Status leave_out(const std::string& kind) {
    writer_.leave_out(kind);
    return {};
  }

  void advance(const mrpt::poses::CPose2D& increment) {
    T_odom_base_ = T_odom_base_ * Transform<Base, Base>(planar(increment).isometry());
    pending_ = true;
  }

  Status put_scan(const obs::CObservation2DRangeScan& observation, Place place) {
    const auto scan = to_scan(observation);
    if (!scan) {
      writer_.refuse(place, scan.error().message);
      return {};
    }
    if (pending_) {
      pending_ = false;
      if (Status done = writer_.put(channel::odometry, Odometry{scan->stamp, T_odom_base_}, place); !done)
        return done;
    }
    return writer_.put(channel::scan, *scan, place);
  }

  RecordingWriter& writer_;
  std::optional<std::string> laser_, odometer_;
  Transform<Odom, Base> T_odom_base_;
  bool pending_ = false;
};

template <class V>
std::vector<std::string> keys(const std::map<std::string, V>& map) {
  std::vector<std::string> names;
  for (const auto& entry : map) names.push_back(entry.first);
  return names;
}

Result<RobotDescription> describe(const ImportOptions& options, const LaserSeen& seen,
                                  std::vector<std::string>& notes) {
  auto laser = seen.evidence.describe(options, notes);
  if (!laser) return laser.error();
  if (seen.moved > 0) {
    notes.push_back("the laser moves on the robot: " + std::to_string(seen.moved) +
                    " scans stand elsewhere than the first, whose place the description has");
  }
  return describe_robot(options, std::move(*laser), notes);
}

/// MRPT crashes on some damage. A file without a right checksum is read in child processes until none
/// crashes; where one did, the object is left alone.
Result<Trust> judge(const std::string& path) {
  Trust trust;
  trust.intact = GzipFile::intact(path);
  for (int crashes = 0; !trust.intact && crashes < most_crashes; ++crashes) {
    const auto end = run_in_child([&](const std::function<void(std::uint64_t)>& report) {
      const AllocationLimit limit(child_headroom);
      Survey survey;
      const Status read = read_rawlog({path, trust, report, {}}, survey);
      static_cast<void>(read.ok());
    });
    if (!end) return end.error();
    if (end->completed) return trust;
    if (!end->last || !trust.crashing.insert(*end->last).second) break;
  }
  if (trust.intact) return trust;
  return Error{path + ": too damaged to be read"};
}

}  // namespace

Result<ImportReport> import_rawlog(const ImportOptions& options, const ImportProgress& progress) {
  const std::string path = options.input.string();
  const auto trust = judge(path);
  if (!trust) return trust.error();
  std::optional<AllocationLimit> limit;
  if (!trust->intact) limit.emplace(parent_headroom);
  const auto size = static_cast<double>(std::filesystem::file_size(options.input));
  const auto part = [&](double share) -> std::function<void(double)> {
    if (!progress) return {};
    return [&, share](double done) { progress(size * share + done / 2, size); };
  };
  Survey survey;
  if (const Status read = read_rawlog({path, *trust, {}, part(0)}, survey); !read) return read.error();
  const auto laser = choose_topic(options, channel::scan, keys(survey.lasers), "2D range scan");
  if (!laser) return laser.error();
  const bool paired = survey.actions > 0;
  const auto odometer = choose_topic(options, channel::odometry, keys(survey.odometers), "odometry");
  if (!odometer) return odometer.error();
  if (!*laser)
    return Error{path + ": no 2D range scan in it: a rawlog with CObservation2DRangeScan is expected"};

  std::vector<std::string> notes;
  auto robot = describe(options, survey.lasers.at(**laser), notes);
  if (!robot) return robot.error();
  if (paired) notes.push_back("odometry accumulated from actions, stamped at the scan that each leads to");
  robot->source += "; " + joined(notes);
  auto writer = RecordingWriter::create(options, options.input.filename().string() + ", object ", "objects");
  if (!writer) return writer.error();
  for (std::string& note : notes) writer->note(std::move(note));
  if (const Status written = writer->describe(*robot, *survey.first.get()); !written) return written.error();
  Copy copy(*writer, *laser, *odometer);
  if (paired && !*odometer) copy.start_at_origin();
  if (const Status read = read_rawlog({path, *trust, {}, part(0.5)}, copy); !read) return read.error();
  return writer->finish();
}

}  // namespace parhelion
