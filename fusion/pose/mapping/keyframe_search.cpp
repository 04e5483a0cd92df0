#include "fusion/pose/mapping/keyframe_search.hpp"

#include <cmath>
#include <set>
#include <tuple>

#include "fusion/pose/matching/scan_match.hpp"

namespace parhelion::pose {
namespace {

/// The robot may be where its map does not reach. So what localization in a whole map takes for the only
/// possible place has to explain so much of what is usual for so long (m and rad) and stay the same (m, rad).
constexpr double kCertainlyExplained = 0.9, kFollowedFor = 1, kSteady = 0.3, kSteadyYaw = 0.2;
constexpr double kThinned = 0.4,
                 kThinnedYaw = 0.4;  ///< m, rad: one keyframe of each place and heading is enough

/// The newest of each place and heading.
std::vector<MappedScan> thinned_out(std::span<const Keyframe> keyframes, const LaserDescription& laser) {
  std::set<std::tuple<int, int, int>> taken;
  std::vector<MappedScan> scans;
  for (std::size_t i = keyframes.size(); i-- > 0;) {
    const Pose2& pose = keyframes[i].T_map_base;
    const auto cell = [](double value, double size) { return static_cast<int>(std::floor(value / size)); };
    if (taken.emplace(cell(pose.x, kThinned), cell(pose.y, kThinned), cell(wrap_angle(pose.yaw), kThinnedYaw))
            .second)
      scans.push_back(mapped(keyframes[i], pose, laser));
  }
  return scans;
}

}  // namespace

MappedScan mapped(const Keyframe& keyframe, const Pose2& T_map_base, const LaserDescription& laser) {
  return {T_map_base, laser.T_base_laser, rectified(keyframe.scan, laser),
          static_cast<double>(laser.convention.range_max)};
}

std::optional<Pose2> KeyframeSearch::add(std::span<const Keyframe> keyframes, const LaserDescription& laser,
                                         const ScanPoints& scan, const Pose2& step, double usual) {
  if (!begun_) {
    begun_ = true;
    return std::nullopt;
  }
  if (!map_) {
    map_ = frozen_map_of(thinned_out(keyframes, laser), 0);
    search_.restart(usual);
  }
  const auto found = search_.add(*map_, scan, step);
  if (!found) before_.reset();
  return found && is_certain(scan, step, *found, usual) ? found : std::nullopt;
}

/// The same place for long enough, which explains each scan.
bool KeyframeSearch::is_certain(const ScanPoints& scan, const Pose2& step, const Pose2& found, double usual) {
  const Match here = match(map_->fine, scan.points, found, found, Eigen::Matrix3d::Zero(), {});
  const Pose2 off = (before_.value_or(found) * step).inverse() * found;
  const bool same = before_ && off.position().norm() < kSteady && std::abs(off.yaw) < kSteadyYaw;
  const bool fits = here.explained >= kCertainlyExplained * usual;
  followed_ = same && fits ? followed_ + step.position().norm() + std::abs(step.yaw) : 0;
  before_ = found;
  return followed_ >= kFollowedFor;
}

void KeyframeSearch::forget() {
  begun_ = false;
  map_.reset();
  before_.reset();
  followed_ = 0;
}

}  // namespace parhelion::pose
