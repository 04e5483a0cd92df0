#include "tools/calibration/calibration_level.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "protocols/bus/log_file.hpp"
#include "protocols/codec.hpp"
#include "tools/calibration/calibration_log.hpp"

namespace parhelion::tools {
namespace {

constexpr std::size_t kMaxImages = 100;
/// s between an image and its scans: other instants show things from nearer, and sides that the camera does
/// not look at.
constexpr double kApart[] = {0, -5, -2, 2, 5};
constexpr Duration kNear = milliseconds(100);    ///< of a scan and the instant that is wanted
constexpr Duration kMaxGap = milliseconds(300);  ///< between two poses
constexpr double kMaxTurn = 0.03;                ///< rad, during a scan

/// Poses of the base by those of its laser, ascending stamps.
class BasePath {
 public:
  BasePath(const std::vector<pose::LaserPose>& laser, const Pose2& T_base_laser)
      : T_laser_base_(T_base_laser.inverse()) {
    for (const pose::LaserPose& each : laser) {
      if (!poses_.empty() && each.stamp <= poses_.back().stamp) continue;
      parts_.push_back(parts_.empty() ? 0 : parts_.back() + (each.linked ? 0 : 1));
      poses_.push_back(each);
    }
  }

  struct Placed {
    Pose2 T_map_base;
    int part = 0;  ///< of the drive, within which motion is known
  };
  std::optional<Placed> at(SensorTime t) const {
    const auto after =
        std::lower_bound(poses_.begin(), poses_.end(), t,
                         [](const pose::LaserPose& each, SensorTime stamp) { return each.stamp < stamp; });
    if (after == poses_.end() || after == poses_.begin()) return std::nullopt;
    const auto before = std::prev(after);
    const Duration step = after->stamp - before->stamp;
    if (!after->linked || step > kMaxGap) return std::nullopt;
    const double s = (t - before->stamp).seconds() / step.seconds();
    return Placed{interpolate(before->T_map_laser, after->T_map_laser, s) * T_laser_base_,
                  parts_[static_cast<std::size_t>(after - poses_.begin())]};
  }

 private:
  std::vector<pose::LaserPose> poses_;
  std::vector<int> parts_;
  Pose2 T_laser_base_;
};

/// The scans of a drive in order of their stamps.
class ScansByTime {
 public:
  explicit ScansByTime(const RecordedDrive& drive) {
    for (const RecordedDrive::Event& event : drive.events) {
      if (event.kind == RecordedDrive::Event::Kind::scan) scans_.push_back(&drive.scans[event.index]);
    }
    std::stable_sort(scans_.begin(), scans_.end(),
                     [](const Scan* a, const Scan* b) { return a->stamp < b->stamp; });
  }

  /// The one nearest to `t`; nullptr: none is near.
  const Scan* near(SensorTime t) const {
    const auto after =
        std::lower_bound(scans_.begin(), scans_.end(), t,
                         [](const Scan* scan, SensorTime stamp) { return scan->stamp < stamp; });
    const Scan* nearest = nullptr;
    Duration min_apart = kNear;
    for (auto each = after == scans_.begin() ? after : std::prev(after);
         each != scans_.end() && each <= after; ++each) {
      const Duration apart = std::max((*each)->stamp - t, t - (*each)->stamp);
      if (apart <= min_apart) min_apart = apart, nearest = *each;
    }
    return nearest;
  }

 private:
  std::vector<const Scan*> scans_;
};

/// The base in the middle of a scan; nullopt: not known, or it turns too fast for a scan at once.
std::optional<BasePath::Placed> place(const Scan& scan, const BasePath& path, const LaserDescription& laser) {
  const auto first = path.at(scan.stamp + laser.beam_time(0, scan));
  const auto last = path.at(scan.stamp + laser.beam_time(scan.ranges.size() - 1, scan));
  if (!first || !last || first->part != last->part) return std::nullopt;
  if (std::abs(wrap_angle(last->T_map_base.yaw - first->T_map_base.yaw)) > kMaxTurn) return std::nullopt;
  return BasePath::Placed{interpolate(first->T_map_base, last->T_map_base, 0.5), first->part};
}

/// False: the image cannot be decoded.
bool add(const Image& image, const ScansByTime& scans, const BasePath& path, const LaserDescription& laser,
         LaserLevelFit& fit) {
  const auto at_image = path.at(image.stamp);
  if (!at_image) return true;
  std::vector<PlacedScan> placed;
  for (const double apart : kApart) {
    const Scan* scan = scans.near(image.stamp + seconds(apart));
    if (scan == nullptr || scan->ranges.empty()) continue;
    const auto at_scan = place(*scan, path, laser);
    if (at_scan && at_scan->part == at_image->part) placed.push_back({scan, at_scan->T_map_base});
  }
  if (placed.empty()) return true;
  auto pixels = render::decode_depth(image);
  if (!pixels) return false;
  fit.add(std::move(*pixels), at_image->T_map_base, placed);
  return true;
}

}  // namespace

FoundLevel calibrate_level(const CalibrationOptions& options, const RecordedDrive& drive,
                           const RobotDescription& robot, std::size_t images,
                           const std::vector<pose::LaserPose>& laser, const CalibrationProgress& progress) {
  if (images == 0) return {{}, robot.depth ? "the log has no image of the depth camera" : ""};
  if (!robot.depth) return {{}, "the robot description has no 'depth': its lens is unknown"};
  if (!robot.depth->head.empty()) return {{}, "the depth camera is carried by joints"};
  auto reader = LogReader::open(options.input.string());
  if (!reader) return {{}, reader.error().message};
  const BasePath path(laser, planar(robot.laser->T_base_laser));
  const ScansByTime scans(drive);
  LaserLevelFit fit(robot);
  const std::size_t stride = 1 + (images - 1) / kMaxImages;
  std::size_t refused = 0;
  for (std::size_t number = 0;;) {
    const auto event = reader->next();
    if (!event) continue;
    if (!event->has_value()) break;
    if ((*event)->channel != options.depth_channel || number++ % stride != 0) continue;
    Image image;
    if (!decode((*event)->channel, (*event)->payload, image).ok() ||
        !add(image, scans, path, *robot.laser, fit))
      ++refused;
  }
  auto found = fit.fit(progress);
  std::string lost;
  if (refused > 0) lost = std::to_string(refused) + " depth images cannot be decoded";
  if (fit.left_out() > 0)
    lost += (lost.empty() ? "" : ", ") + std::to_string(fit.left_out()) +
            " depth images have another size or aspect than the description's";
  if (!found) return {{}, found.error().message + (lost.empty() ? "" : " (" + lost + ")")};
  if (!lost.empty()) found->advice.push_back(lost);
  return {std::move(*found), {}};
}

void keep_above_floor(const RecordedDrive& part, const RobotDescription& robot, LaserLevel& level) {
  constexpr double kMany = 0.02;  // of the hits
  if (!level.writes_pitch && !level.writes_roll) return;
  const LaserDescription turned = *with_level(robot, level).laser;
  LaserLevel height_only = level;
  height_only.writes_pitch = height_only.writes_roll = false;
  const LaserDescription kept = *with_level(robot, height_only).laser;
  double now = 0, before = 0;
  std::size_t scans = 0;
  for (const RecordedDrive::Event& event : part.events) {
    if (event.kind != RecordedDrive::Event::Kind::scan) continue;
    now += below_floor(part.scans[event.index], turned);
    before += below_floor(part.scans[event.index], kept);
    ++scans;
  }
  if (now <= before + kMany * static_cast<double>(scans)) return;
  level.writes_pitch = level.writes_roll = false;
  level.advice.emplace_back(
      "the tilt of the laser stays as described: with the measured tilt, the laser would see things below "
      "the floor");
}

}  // namespace parhelion::tools
