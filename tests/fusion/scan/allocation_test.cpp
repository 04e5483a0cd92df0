// Counts the allocations of the scan path: none after warm-up.
#include <gtest/gtest.h>

#include "fusion/scan/augment.hpp"
#include "fusion/scan/unexplained.hpp"
#include "tests/allocations.hpp"
#include "tests/fusion/scan/random_scene.hpp"

namespace parhelion::scan {
namespace {

TEST(ScanPath, allocates_nothing_after_warm_up_with_changing_bodies) {
  constexpr int kBeams = 361;
  test::RandomScene scene = test::random_scene(3, kBeams, 30, 50);
  LaserDescription laser;
  laser.convention = {0.1F, 80, RangeConvention::Sentinel::infinity, 0, RangeConvention::Sentinel::value, 0};
  laser.noise_sigma = 0.01;
  laser.beam_interval = 1e-5;
  RayCaster caster;
  caster.set_building(scene.building);
  UnexplainedReturns unexplained;
  Scan real, out;
  real.ranges.assign(kBeams, 20);
  real.intensities.assign(kBeams, 1);
  real.angle_min = scene.beams.angle_min;
  real.angle_increment = scene.beams.angle_increment;
  std::vector<float> time;
  std::vector<std::int32_t> beam_body;
  std::vector<RangeHit> bodies(kBeams), building(kBeams);
  std::size_t replaced = 0, discs = 0;
  const auto scan = [&](std::size_t n) {
    // The laser moves, and the number of bodies changes from scan to scan.
    const auto forward = Transform<Map, Laser>(Eigen::Isometry3d(Eigen::Translation3d(
        scene.laser.T_map_laser_end.translation() + Eigen::Vector3d(0.01 * static_cast<double>(n), 0, 0))));
    scene.laser.T_map_laser_end =
        Transform<Map, Laser>(scene.laser.T_map_laser_end.quaternion(), forward.translation());
    beam_times(laser, kBeams, time);
    const std::span<const BodyMotion> some = std::span(scene.bodies).first(scene.bodies.size() - n % 7);
    const BeamSet beams{real.angle_min, real.angle_increment, time};
    caster.cast_bodies(scene.laser, beams, some, 80, bodies);
    caster.cast_building(scene.laser, beams, 80, building);
    replaced += augment_scan(real, laser, {1, n}, bodies, building, out, beam_body);
    discs += unexplained.find(out, laser, scene.laser, time, building, 0.02).size();
    simulate_scan(laser, {2, n}, bodies, building, {}, out);
  };
  for (std::size_t n = 0; n < 14; ++n) scan(n);
  const test::AllocationWatch watch;
  for (std::size_t n = 0; n < 140; ++n) scan(n);
  EXPECT_EQ(watch.count(), 0U);
  EXPECT_GT(replaced, 0U);
  EXPECT_GT(discs, 0U);
}

}  // namespace
}  // namespace parhelion::scan
