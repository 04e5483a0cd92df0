// A scan of a model, without noise.
#pragma once

#include <cmath>
#include <vector>

#include "fusion/scan/lidar_model.hpp"
#include "fusion/scan/ray_caster.hpp"
#include "protocols/model.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"

namespace parhelion::test {

/// Of a robot that stands at `T_map_base`, to 30 m.
inline Scan exact_scan(const LaserDescription& laser, const Transform<Map, Base>& T_map_base,
                       const SemanticModel& model, SensorTime stamp = {}) {
  constexpr double reach = 30;
  Scan scan;
  scan.stamp = stamp;
  scan.angle_min = static_cast<float>(laser.angle_min);
  scan.angle_increment = static_cast<float>(laser.angle_increment);
  std::vector<float> time;
  scan::beam_times(laser, static_cast<std::size_t>(laser.beams), time);
  std::vector<scan::RangeHit> hits(time.size());
  const auto T_map_laser = T_map_base * laser.T_base_laser;
  scan::cast_building_exact({T_map_laser, T_map_laser}, {scan.angle_min, scan.angle_increment, time}, model,
                            reach, hits);
  for (const scan::RangeHit& hit : hits)
    scan.ranges.push_back(std::isinf(hit.range) ? laser.convention.no_return_sentinel() : hit.range);
  return scan;
}

}  // namespace parhelion::test
