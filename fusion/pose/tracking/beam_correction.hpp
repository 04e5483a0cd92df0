// A laser whose beams are described in the wrong order of time: SLAM notices it and goes on with the right
// one.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "fusion/pose/matching/beam_order.hpp"
#include "fusion/pose/odometry/odometry_sanity.hpp"
#include "fusion/pose/odometry/scan_odometry.hpp"
#include "fusion/pose/tracking/scan_tracking.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"

namespace parhelion::pose {

class BeamCorrection {
 public:
  /// `wanted`: false for who compares both orders.
  BeamCorrection(const LaserDescription& laser, bool wanted) : order_(laser), wanted_(wanted) {}

  /// To be called with each scan before it is placed. Puts the order in `laser` right once scans have shown
  /// that it is wrong.
  void learn(const Scan& scan, const ScanOdometry::Step& step, const ScanTracking& tracking,
             LaserDescription& laser);
  /// `findings` so far, and this one among them at its place in the order of time.
  std::vector<OdometryFinding> among(const std::vector<OdometryFinding>& findings) const;

 private:
  BeamOrder order_;
  bool wanted_;
  std::optional<OdometryFinding> finding_;
  std::size_t before_ = 0;  ///< findings that were there already
};

}  // namespace parhelion::pose
