// A drive's trajectory, computed afterwards by another matcher than the product's: MRPT's ICP of each scan to
// the points of a map, then a smoother over all scans.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "protocols/pose2.hpp"
#include "protocols/scan.hpp"
#include "protocols/status.hpp"

namespace parhelion::bench {

struct ReferenceScan {
  Scan scan;
  Pose2 guess;  ///< T_map_base at the stamp, such as SLAM's; within 0.3 m and 0.1 rad
};

struct ReferencePose {
  SensorTime stamp;
  Pose2 T_map_base;      ///< when the scan was taken, which jitter moves away from its stamp
  Pose2 T_map_base_icp;  ///< as matched, before the smoother
  Twist2 twist;          ///< body frame
  double goodness = 0;   ///< fraction of the returns that ICP paired; below 0.5 the smoother bridges the scan
};

struct ReferenceTrajectory {
  std::vector<ReferencePose> poses;
  double stamp_sigma = 0;  ///< s, jitter of the stamps, estimated with the poses
};

/// `scans`: in the order of their stamps. `simplemap`: path of the map of the guesses; its scans within two
/// seconds of a stamp are left out there, as they may be the same ones. One pose for each scan. Error: the
/// map cannot be read.
Result<ReferenceTrajectory> reference_trajectory(const std::vector<ReferenceScan>& scans,
                                                 const LaserDescription& laser, const std::string& simplemap,
                                                 const std::function<void(double)>& progress = {});

}  // namespace parhelion::bench
