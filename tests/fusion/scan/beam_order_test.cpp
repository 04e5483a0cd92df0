// The result of a beam depends only on its bearing and its instant: not on which other beams are cast with
// it, nor on their order, nor on what is hidden behind.
#include <gtest/gtest.h>

#include <vector>

#include "fusion/scan/beam_window.hpp"
#include "fusion/scan/sweep_rays.hpp"
#include "tests/fusion/scan/random_scene.hpp"

namespace parhelion::scan {
namespace {

constexpr int kSweepBeams = 361;

std::vector<RangeHit> cast(const test::RandomScene& scene, const BeamSet& beams,
                           std::span<const BodyMotion> bodies) {
  RayCaster caster;
  std::vector<RangeHit> hits(beams.time.size());
  caster.cast_bodies(scene.laser, beams, bodies, scene.max_range, hits);
  return hits;
}

TEST(BeamOrder, part_of_a_sweep_equals_that_part_of_the_whole) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const test::RandomScene scene = test::random_scene(seed, kSweepBeams, 10, 0);
    const auto whole = cast(scene, scene.beams, scene.bodies);
    // Only the first beams: their bearings are identical to the bit.
    for (const std::size_t n : {std::size_t{1}, std::size_t{2}, std::size_t{100}}) {
      const BeamSet part{scene.beams.angle_min, scene.beams.angle_increment, scene.beams.time.first(n)};
      const auto hits = cast(scene, part, scene.bodies);
      for (std::size_t i = 0; i < n; ++i) {
        ASSERT_EQ(hits[i].range, whole[i].range) << "scene " << seed << " beam " << i;
        ASSERT_EQ(hits[i].body, whole[i].body);
      }
    }
  }
}

TEST(BeamOrder, bodies_in_another_order_give_the_same_ranges) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const test::RandomScene scene = test::random_scene(seed, kSweepBeams, 10, 0);
    const auto hits = cast(scene, scene.beams, scene.bodies);
    std::vector<BodyMotion> reversed(scene.bodies.rbegin(), scene.bodies.rend());
    const auto other = cast(scene, scene.beams, reversed);
    for (std::size_t i = 0; i < hits.size(); ++i)
      ASSERT_EQ(hits[i].range, other[i].range) << "scene " << seed;
  }
}

TEST(BeamOrder, one_body_more_never_makes_a_range_longer) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const test::RandomScene scene = test::random_scene(seed, kSweepBeams, 10, 0);
    auto before = cast(scene, scene.beams, {});
    for (std::size_t n = 1; n <= scene.bodies.size(); ++n) {
      const auto after = cast(scene, scene.beams, std::span(scene.bodies).first(n));
      for (std::size_t i = 0; i < after.size(); ++i) {
        ASSERT_LE(after[i].range, before[i].range);
        if (after[i].range == before[i].range) {
          ASSERT_EQ(after[i].body, before[i].body);
        } else {
          ASSERT_EQ(after[i].body, static_cast<std::int32_t>(n - 1)) << "only the new body can be nearer";
        }
      }
      before = after;
    }
  }
}

// The window may include a beam too many, never one too few: every beam whose ray meets the sphere is in it.
TEST(BeamWindow, names_every_beam_that_meets_a_sphere) {
  std::size_t meeting = 0, named = 0, all = 0;
  for (std::uint64_t seed = 1; seed <= 3000; ++seed) {
    const test::RandomScene scene = test::random_scene(seed, 91, 0, 0);
    test::Draw draw(seed + 1'000'000);
    SweepRays rays;
    rays.set(scene.laser, scene.beams);
    const BeamWindow window(scene.beams, rays.half_turn(), rays.half_tilt(), scene.max_range);
    // A sphere at rest relative to the laser: its centre moves against the laser's motion.
    const Eigen::Vector3d travel = rays.end() - rays.start();
    const Eigen::Vector3d middle = (rays.start() + rays.end()) / 2;
    const double radius = draw.real(0.01, draw.chance(0.2) ? 5 : 0.5);
    const Eigen::Vector3d offset =
        draw.vector(draw.chance(0.3) ? 2 : 20).cwiseProduct(Eigen::Vector3d(1, 1, 0.1));
    const Eigen::Vector3d center = rays.R_map_middle().transpose() * offset;
    std::vector<bool> in(rays.size(), false);
    for (const BeamRange& range : window.meet(center, radius + travel.norm() / 2)) {
      for (std::size_t i = range.first; i < range.last; ++i) in[i] = true;
    }
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Eigen::Vector3d to_center = middle + offset - rays.origin(i);
      const double along = to_center.dot(rays.direction(i));
      const double miss = (to_center - along * rays.direction(i)).norm();
      const bool meets =
          to_center.norm() <= radius || (along > 0 && miss < radius && along - radius < scene.max_range);
      ASSERT_TRUE(in[i] || !meets) << "scene " << seed << " beam " << i;
      meeting += meets;
      named += in[i];
      ++all;
    }
  }
  EXPECT_GT(meeting, 1000U);
  EXPECT_LT(named, all / 2) << "a window that names all beams is of no use";
}

}  // namespace
}  // namespace parhelion::scan
