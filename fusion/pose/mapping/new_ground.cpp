#include "fusion/pose/mapping/new_ground.hpp"

#include <Eigen/LU>
#include <cmath>

namespace parhelion::pose {
namespace {

/// Returns of a scan: fewer fit anywhere.
constexpr std::size_t kEnough = 40;
/// m and rad from the first scan, over which scans and odometry have to agree: twice as far as where a lost
/// robot is found again, as they are compared with one scan of this place and not with a whole map.
constexpr double kAgreedFor = 0.5;
constexpr double kExplained = 0.5;
/// m and rad, and of the motion: by so much odometry may be wrong.
constexpr double kNear = 0.05, kNearFraction = 0.15;
/// 1 sigma, m and rad: of odometry, in the match.
constexpr double kSigma = 0.3, kYawSigma = 0.1;

}  // namespace

void NewGround::begin(const ScanPoints& scan, const Pose2& T_map_base) {
  first_.emplace(cell_);
  first_->add(scan.points, T_map_base);
  T_map_first_ = T_map_base;
}

bool NewGround::add(const ScanPoints& scan, const Pose2& T_map_base, const MatchOptions& options) {
  if (scan.points.size() < kEnough) {
    forget();
    return false;
  }
  if (!first_) {
    begin(scan, T_map_base);
    return false;
  }
  const Pose2 T_first_base = T_map_first_.inverse() * T_map_base;
  const double moved = T_first_base.position().norm() + std::abs(T_first_base.yaw);
  const Eigen::Vector3d sigma(kSigma, kSigma, kYawSigma);
  const Eigen::Matrix3d prior = sigma.cwiseAbs2().cwiseInverse().asDiagonal();
  const Match found = match(*first_, scan.points, T_map_base, T_map_base, prior, options);
  const Pose2 off = T_map_base.inverse() * found.T_map_base;
  const bool agree = found.explained >= kExplained &&
                     off.position().norm() + std::abs(off.yaw) < kNear + kNearFraction * moved;
  if (!agree) begin(scan, T_map_base);
  return agree && moved >= kAgreedFor;
}

}  // namespace parhelion::pose
