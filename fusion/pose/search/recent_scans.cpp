#include "fusion/pose/search/recent_scans.hpp"

#include <cmath>

#include "fusion/pose/matching/scan_match.hpp"

namespace parhelion::pose {
namespace {

constexpr double kApart = 0.3, kApartYaw = 0.3;  ///< m, rad, between scans that are kept
/// A scan of which less is explained by the ones before does not continue them.
constexpr double kContinues = 0.35;
constexpr double kStepSigma = 0.1, kStepYawSigma = 0.1;  ///< m, rad, of a predicted step

Eigen::Matrix3d step_information() {
  return Eigen::Vector3d(kStepSigma, kStepSigma, kStepYawSigma).cwiseAbs2().cwiseInverse().asDiagonal();
}

}  // namespace

bool RecentScans::add(const ScanPoints& scan, const Pose2& odometry) {
  bool continues = true;
  if (kept_.empty()) {
    step_ = {};
  } else {
    const Eigen::Matrix3d prior = step_information();
    // Odometry may be late or wrong, and the motion so far may have changed.
    Match best;
    for (const Pose2& step : {odometry, step_}) {
      const Match found = match_from_several(fine_, coarse_, scan.points, T_local_base_ * step, prior, {});
      if (best.points == 0 || found.cost < best.cost) best = found;
    }
    continues = best.explained >= kContinues;
    if (!continues) clear();
    step_ = continues ? T_local_base_.inverse() * best.T_map_base : odometry;
    T_local_base_ = continues ? best.T_map_base : Pose2{};
  }
  gather(scan);
  keep(scan);
  return continues;
}

void RecentScans::clear() {
  fine_ = SurfelMap(fine_.cell());
  coarse_ = SurfelMap(coarse_.cell());
  kept_.clear();
  T_local_base_ = step_ = {};
}

void RecentScans::keep(const ScanPoints& scan) {
  if (!kept_.empty()) {
    const Pose2 moved = kept_.back().T_local_base.inverse() * T_local_base_;
    if (moved.position().norm() < kApart && std::abs(moved.yaw) < kApartYaw) return;
  }
  if (kept_.size() == kScans) {
    fine_.add(kept_.front().points, kept_.front().T_local_base, -1);
    coarse_.add(kept_.front().points, kept_.front().T_local_base, -1);
    kept_.pop_front();
  }
  kept_.push_back({scan.points, scan.laser, T_local_base_});
  fine_.add(scan.points, T_local_base_);
  coarse_.add(scan.points, T_local_base_);
}

void RecentScans::gather(const ScanPoints& scan) {
  beams_.clear();
  see(scan.points, scan.laser, {});
  for (const Kept& kept : kept_) see(kept.points, kept.laser, T_local_base_.inverse() * kept.T_local_base);
}

void RecentScans::see(const std::vector<Eigen::Vector2d>& points, const Eigen::Vector2d& laser,
                      const Pose2& T_now_base) {
  const std::size_t count = std::min(points.size(), kBeamsPerScan);
  for (std::size_t i = 0; i < count; ++i)
    beams_.push_back({T_now_base * laser, T_now_base * points[i * points.size() / count]});
}

}  // namespace parhelion::pose
