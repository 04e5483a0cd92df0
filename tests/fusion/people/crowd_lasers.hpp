// What a laser measures in a made-up world.
#pragma once

#include "tests/fusion/people/crowd_world.hpp"

namespace parhelion::test {

LaserDescription describe(const LaserKind& kind);
/// rad from the laser's x axis
inline double beam_angle(const LaserDescription& laser, int beam) {
  return laser.angle_min + beam * laser.angle_increment;
}
/// A scan, during which the world goes on for 0.9 of the scan's period.
void measure(const CrowdOptions& options, const LaserDescription& laser, World& world, CrowdScan& out);
/// m on each beam to the walls alone, as seen from the middle of the estimated motion; for a whole scan.
std::vector<scan::RangeHit> modelled_walls(const CrowdOptions& options, const LaserDescription& laser,
                                           const World& world, const scan::LaserMotion& estimated);

}  // namespace parhelion::test
