#include "fusion/pose/tracking/beam_correction.hpp"

#include <algorithm>
#include <string>

namespace parhelion::pose {

void BeamCorrection::learn(const Scan& scan, const ScanOdometry::Step& step, const ScanTracking& tracking,
                           LaserDescription& laser) {
  if (!wanted_ || order_.verdict() != BeamOrder::Verdict::unknown) return;
  if (order_.add(scan, step.known ? std::optional(step.reported) : std::nullopt) !=
      BeamOrder::Verdict::reversed)
    return;
  laser.beam_interval = -laser.beam_interval;
  before_ = tracking.findings().size();
  finding_ = OdometryFinding{OdometryFault::beams_reversed, scan.stamp, std::nullopt,
                             advice(OdometryFault::beams_reversed) + std::string(" (") +
                                 std::to_string(order_.comparisons()) + " scans of turns compared)"};
}

std::vector<OdometryFinding> BeamCorrection::among(const std::vector<OdometryFinding>& findings) const {
  std::vector<OdometryFinding> all = findings;
  if (finding_)
    all.insert(all.begin() + static_cast<std::ptrdiff_t>(std::min(before_, all.size())), *finding_);
  return all;
}

}  // namespace parhelion::pose
