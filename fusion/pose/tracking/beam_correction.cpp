#include "fusion/pose/tracking/beam_correction.hpp"

#include <algorithm>

namespace parhelion::pose {

void BeamCorrection::learn(const Scan& scan, const ScanOdometry::Step& step, const ScanTracking& tracking,
                           LaserDescription& laser) {
  if (!wanted_ || order_.verdict() != BeamOrder::Verdict::unknown) return;
  order_.add(scan, step.known ? std::optional(step.reported) : std::nullopt);
  if (!order_.differs()) return;
  order_.correct(laser);
  before_ = tracking.findings().size();
  finding_ = OdometryFinding{
      OdometryFault::beam_order, scan.stamp, std::nullopt,
      order_.advice() + ", and make the map again; from here on scans are corrected in that order"};
}

std::vector<OdometryFinding> BeamCorrection::among(const std::vector<OdometryFinding>& findings) const {
  std::vector<OdometryFinding> all = findings;
  if (finding_)
    all.insert(all.begin() + static_cast<std::ptrdiff_t>(std::min(before_, all.size())), *finding_);
  return all;
}

}  // namespace parhelion::pose
