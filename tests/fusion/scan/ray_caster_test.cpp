#include "fusion/scan/ray_caster.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/fusion/scan/random_scene.hpp"

namespace parhelion {
namespace {

using test::Draw;
using test::random_scene;
using test::RandomScene;

constexpr float kNone = std::numeric_limits<float>::infinity();

bool agree(const RangeHit& a, const RangeHit& b) {
  if (std::isinf(a.range) || std::isinf(b.range)) return a.range == b.range;
  return std::abs(a.range - b.range) <= 1e-3F;
}

struct Comparison {
  std::size_t beams = 0, hits = 0, inside = 0, apart = 0, other_body = 0;
};

void compare(std::span<const RangeHit> fast, std::span<const RangeHit> twin, Comparison& sum) {
  for (std::size_t i = 0; i < twin.size(); ++i) {
    ++sum.beams;
    sum.hits += std::isfinite(twin[i].range);
    sum.inside += twin[i].range == 0;
    if (!agree(fast[i], twin[i])) ++sum.apart;
    if (fast[i].body != twin[i].body || fast[i].reflectivity != twin[i].reflectivity) ++sum.other_body;
  }
}

// Both casters work in doubles, so even at grazing edges they part only within about 1e-12 rad: over random
// scenes that does not happen, and no disagreement is allowed.
TEST(RayCaster, agrees_with_the_exact_twin_on_bodies_over_a_million_beams) {
  constexpr int kBeams = 361, kScenes = 2800;
  RayCaster caster;
  Comparison sum;
  std::vector<RangeHit> fast(kBeams), twin(kBeams);
  for (std::uint64_t seed = 1; seed <= kScenes; ++seed) {
    const RandomScene scene = random_scene(seed, kBeams, 10, 0);
    caster.cast_bodies(scene.laser, scene.beams, scene.bodies, scene.max_range, fast);
    cast_bodies_exact(scene.laser, scene.beams, scene.bodies, scene.max_range, twin);
    compare(fast, twin, sum);
    ASSERT_EQ(sum.apart, 0U) << "scene " << seed;
  }
  EXPECT_GE(sum.beams, 1'000'000U);
  EXPECT_GT(sum.hits, sum.beams / 4) << "the scenes must not be empty";
  EXPECT_GT(sum.inside, 1000U) << "some beams must start inside a body";
  // Only where two bodies' surfaces cross on a beam to within rounding.
  EXPECT_LE(sum.other_body, 5U);
}

TEST(RayCaster, agrees_with_the_exact_twin_on_buildings) {
  constexpr int kBeams = 361, kScenes = 300;
  RayCaster caster;
  Comparison sum;
  std::vector<RangeHit> fast(kBeams), twin(kBeams);
  for (std::uint64_t seed = 1; seed <= kScenes; ++seed) {
    const RandomScene scene =
        random_scene(seed, kBeams, 0, seed % 50 == 0 ? 1000 : static_cast<int>(seed % 60));
    caster.set_building(scene.building);
    caster.cast_building(scene.laser, scene.beams, scene.max_range, fast);
    cast_building_exact(scene.laser, scene.beams, scene.building, scene.max_range, twin);
    compare(fast, twin, sum);
    ASSERT_EQ(sum.apart, 0U) << "scene " << seed;
  }
  EXPECT_GT(sum.hits, sum.beams / 6);
  EXPECT_LE(sum.other_body, 5U);
}

}  // namespace
}  // namespace parhelion
