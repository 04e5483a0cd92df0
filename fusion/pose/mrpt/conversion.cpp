#include "fusion/pose/mrpt/conversion.hpp"

#include <mrpt/obs/CSensoryFrame.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace parhelion::pose {
namespace {

using mrpt::obs::CObservation2DRangeScan;

Eigen::Isometry3d from_mrpt(const mrpt::poses::CPose3D& pose) {
  Eigen::Isometry3d T;
  T.matrix() = pose.getHomogeneousMatrixVal<mrpt::math::CMatrixDouble44>().asEigen();
  return T;
}

MappedScan from_mrpt(const CObservation2DRangeScan& scan, const mrpt::poses::CPose3D& T_map_base) {
  MappedScan mapped;
  mapped.T_map_base = {T_map_base.x(), T_map_base.y(), T_map_base.yaw()};
  mapped.T_base_laser = Transform<Base, Laser>(from_mrpt(scan.sensorPose));
  mapped.range_max = static_cast<double>(scan.maxRange);
  const std::size_t n = scan.getScanSize();
  const double step = n > 1 ? static_cast<double>(scan.aperture) / static_cast<double>(n - 1) : 0;
  mapped.scan.angle_increment = static_cast<float>(scan.rightToLeft ? step : -step);
  mapped.scan.angle_min =
      static_cast<float>(static_cast<double>(scan.aperture) * (scan.rightToLeft ? -0.5 : 0.5));
  for (std::size_t i = 0; i < n; ++i) {
    const float range = scan.getScanRange(i);
    const bool known = scan.getScanRangeValidity(i) && std::isfinite(range) && range > 0;
    mapped.scan.ranges.push_back(known ? range : std::numeric_limits<float>::quiet_NaN());
  }
  return mapped;
}

}  // namespace

mrpt::poses::CPose3D to_mrpt(const Eigen::Isometry3d& T) {
  return mrpt::poses::CPose3D(mrpt::math::CMatrixDouble44(Eigen::Matrix4d(T.matrix())));
}

mrpt::obs::CObservation2DRangeScan::Ptr to_mrpt(const MappedScan& mapped) {
  auto scan = CObservation2DRangeScan::Create();
  const Scan even = evenly_spaced(mapped.scan);
  const std::size_t n = even.ranges.size();
  const auto step = static_cast<double>(even.angle_increment);
  const double span = step * static_cast<double>(n - 1);
  const Eigen::AngleAxisd to_middle(static_cast<double>(even.angle_min) + span / 2, Eigen::Vector3d::UnitZ());
  scan->sensorPose = to_mrpt(mapped.T_base_laser.isometry() * to_middle);
  scan->timestamp = mrpt::Clock::fromDouble((mapped.scan.stamp - SensorTime{}).seconds());
  scan->aperture = static_cast<float>(std::abs(span));
  scan->rightToLeft = step > 0;
  scan->maxRange = static_cast<float>(mapped.range_max);
  scan->sensorLabel = "SCAN";
  scan->resizeScan(n);
  for (std::size_t i = 0; i < n; ++i) {
    const bool known = std::isfinite(even.ranges[i]);
    scan->setScanRange(i, known ? even.ranges[i] : 0.0F);
    scan->setScanRangeValidity(i, known);
  }
  return scan;
}

std::vector<MappedScan> scans_of(const mrpt::maps::CSimpleMap& map) {
  std::vector<MappedScan> scans;
  for (std::size_t i = 0; i < map.size(); ++i) {
    mrpt::poses::CPose3DPDF::ConstPtr pose;
    mrpt::obs::CSensoryFrame::ConstPtr frame;
    map.get(i, pose, frame);
    if (!pose || !frame) throw std::runtime_error("no pose or no frame");
    mrpt::poses::CPose3D mean;
    pose->getMean(mean);
    for (const auto& observation : *frame) {
      const auto scan = std::dynamic_pointer_cast<CObservation2DRangeScan>(observation);
      if (scan) scans.push_back(from_mrpt(*scan, mean));
    }
  }
  return scans;
}

}  // namespace parhelion::pose
