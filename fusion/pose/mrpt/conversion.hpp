// Scans and poses as MRPT's types, both ways. Internal to fusion/pose.
#pragma once

#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/poses/CPose3D.h>

#include <vector>

#include "fusion/pose/maps/mapped_scan.hpp"

namespace parhelion::pose {

mrpt::poses::CPose3D to_mrpt(const Eigen::Isometry3d& T);

/// MRPT's beam angles are implicitly centred about the sensor's x axis; an offset goes into the sensor's
/// pose.
mrpt::obs::CObservation2DRangeScan::Ptr to_mrpt(const MappedScan& mapped);

/// The 2D range scans of a map. Throws where it is damaged.
std::vector<MappedScan> scans_of(const mrpt::maps::CSimpleMap& map);

}  // namespace parhelion::pose
