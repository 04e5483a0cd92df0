// Same input, same bytes: for any thread, any order of scans, debug and release.
#include <gtest/gtest.h>

#include <bit>
#include <thread>

#include "fusion/scan/augment.hpp"
#include "protocols/hash.hpp"
#include "tests/fusion/scan/random_scene.hpp"

namespace parhelion::scan {
namespace {

constexpr int kSceneBeams = 361, kScenes = 40;

/// FNV-1a over the bits of floats and indices.
class Hash {
 public:
  void add(std::uint32_t word) {
    for (int byte = 0; byte < 4; ++byte)
      value_ = fnv1a(static_cast<std::uint8_t>(word >> (8 * byte)), value_);
  }
  void add(float x) { add(std::bit_cast<std::uint32_t>(x)); }
  std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = kFnvBasis;
};

LaserDescription laser_1mm() {
  LaserDescription laser;
  laser.convention = {0.1F, 80, RangeConvention::Sentinel::infinity, 0, RangeConvention::Sentinel::value, 0};
  laser.noise_sigma = 0.01;
  laser.quantization = 0.001;
  return laser;
}

/// Hash of the augmented scan of scene `n`.
std::uint64_t answer(RayCaster& caster, std::uint64_t n) {
  const test::RandomScene scene = test::random_scene(1000 + n, kSceneBeams, 20, 30);
  std::vector<RangeHit> bodies(kSceneBeams), building(kSceneBeams);
  caster.set_building(scene.building);
  caster.cast_bodies(scene.laser, scene.beams, scene.bodies, scene.max_range, bodies);
  caster.cast_building(scene.laser, scene.beams, scene.max_range, building);
  const LaserDescription laser = laser_1mm();
  Scan real, out;
  simulate_scan(laser, {7, n}, building, {}, {}, real);
  std::vector<std::int32_t> beam_body;
  augment_scan(real, laser, {8, n}, bodies, building, out, beam_body);
  Hash hash;
  for (const float range : out.ranges) hash.add(range);
  for (const std::int32_t body : beam_body) hash.add(static_cast<std::uint32_t>(body));
  return hash.value();
}

std::vector<std::uint64_t> answers(bool backwards) {
  RayCaster caster;
  std::vector<std::uint64_t> all(kScenes);
  for (std::uint64_t k = 0; k < kScenes; ++k) {
    const std::uint64_t n = backwards ? kScenes - 1 - k : k;
    all[n] = answer(caster, n);
  }
  return all;
}

TEST(ScanPath, gives_the_same_bytes_on_any_thread_and_in_any_order) {
  const auto expected = answers(false);
  EXPECT_EQ(answers(true), expected);
  std::vector<std::vector<std::uint64_t>> found(8);
  {
    std::vector<std::jthread> threads;
    for (std::size_t t = 0; t < found.size(); ++t) {
      threads.emplace_back([&found, t] { found[t] = answers(t % 2 == 1); });
    }
  }
  for (const auto& all : found) EXPECT_EQ(all, expected);
}

// Pinned, so that debug, release and sanitized builds agree: a change here changes the replay of recorded
// sessions, and needs a reason.
TEST(ScanPath, gives_the_pinned_bytes_in_every_build) {
  Hash hash;
  for (const std::uint64_t one : answers(false)) {
    hash.add(static_cast<std::uint32_t>(one));
    hash.add(static_cast<std::uint32_t>(one >> 32));
  }
  EXPECT_EQ(hash.value(), 0x9A8FC5E6B036F0FULL);
}

}  // namespace
}  // namespace parhelion::scan
