#include "fusion/pose/odometry/odometry_belief.hpp"

#include <algorithm>
#include <cmath>

#include "fusion/pose/matching/weak_directions.hpp"

namespace parhelion::pose {
namespace {

constexpr double kMinStep = 0.01;        ///< m
constexpr double kMinStrength = 0.5;     ///< of the match, along the step
constexpr double kDriftMemory = 5;       ///< m
constexpr double kJitterMemory = 0.03;   ///< weight of a scan
constexpr double kMaxJitter = 0.1;       ///< m, of one scan
constexpr double kGoodDrift = 0.07;      ///< of what was driven, and of `kFirstMetres` more
constexpr double kFirstMetres = 1;       ///< m
constexpr double kErrors = 2;            ///< of the description: it says 1 sigma of what varies
constexpr double kRestingSigma = 0.002;  ///< m, at each scan

constexpr double squared(double x) { return x * x; }

}  // namespace

void OdometryBelief::add(const Pose2& before, const Pose2& expected, const Match& match) {
  const Eigen::Vector2d step = expected.position() - before.position();
  if (step.norm() < kMinStep) return;
  const Eigen::Vector2d along = step.normalized();
  const Eigen::Matrix3d strong = strong_directions(match.information);
  if (along.dot(strong.topLeftCorner<2, 2>() * along) < kMinStrength) return;
  const double off = along.dot(match.T_map_base.position() - expected.position());
  const double kept = std::exp(-step.norm() / kDriftMemory);
  drift_ = kept * drift_ + off;
  driven_ = kept * driven_ + step.norm();
  jitter_ += kJitterMemory * (std::min(squared(off), squared(kMaxJitter)) - jitter_);
}

bool OdometryBelief::is_good() const { return std::abs(drift_) < kGoodDrift * (kFirstMetres + driven_); }

double OdometryBelief::variance(double step) const {
  return squared(kErrors * sigma_per_metre_ * step + kRestingSigma) + jitter_;
}

}  // namespace parhelion::pose
