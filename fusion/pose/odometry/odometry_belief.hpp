// How far odometry can be trusted where scans do not constrain the pose: learned from matches where they do.
#pragma once

#include "fusion/pose/matching/scan_match.hpp"
#include "protocols/pose2.hpp"

namespace parhelion::pose {

class OdometryBelief {
 public:
  /// `sigma_per_metre`: m per m driven, 1 sigma, from the robot's description.
  explicit OdometryBelief(double sigma_per_metre) : sigma_per_metre_(sigma_per_metre) {}

  /// A scan whose `match` was made about `expected`, where odometry predicts the base, from `before` at the
  /// previous scan. Counts where the match determines the pose along the step between them.
  void add(const Pose2& before, const Pose2& expected, const Match& match);

  /// It drifts by no more than a few percent of what was driven. Jitter of its stamps is no drift: it does
  /// not add up.
  bool is_good() const;
  /// m^2, of the position after a step of so many m, along any axis.
  double variance(double step) const;

 private:
  double sigma_per_metre_;
  double drift_ = 0, driven_ = 0;  ///< m, over about the last 5 m that were compared
  double jitter_ = 0;              ///< m^2, mean of the last 30 or so
};

}  // namespace parhelion::pose
