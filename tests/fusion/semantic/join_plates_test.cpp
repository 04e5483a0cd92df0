// Plates joined to surfaces, against an exhaustive search over all pairs.
#include "fusion/semantic/segmentation/join_plates.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "fusion/cloud/parallel.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kCell = 0.08;  // m

/// Strips of floors over one another, with holes, walls on them, and noise; sorted by place.
std::vector<Plate> random_plates(unsigned seed) {
  constexpr int kSide = 90, kStrip = 7, kNextStrip = 12;  // cells
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> fraction(0, 1);
  std::normal_distribution<float> noise(0, 0.008F);
  std::vector<Plate> plates;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      if (x % kNextStrip >= kStrip) continue;
      for (int level = 0; level < 3; ++level) {
        if (fraction(random) < 0.3F) continue;
        Plate plate;
        plate.x = x - kSide / 2, plate.y = y - kSide / 2;
        plate.z = 0.1F * static_cast<float>(level) + noise(random);
        plate.points = 1 + random() % 60;
        plate.around = random() % (fraction(random) < 0.3F ? 600 : 60);
        plates.push_back(plate);
      }
    }
  }
  std::sort(plates.begin(), plates.end(), by_place);
  return plates;
}

bool is_flat(const Plate& plate) {
  const double n = plate.points + plate.around;
  return plate.points > 0.17 * n + 2 * std::sqrt(0.17 * n * 0.83);
}

bool may_join(const Plate& a, const Plate& b) {
  const int dx = std::abs(a.x - b.x), dy = std::abs(a.y - b.y);
  const double sigma = 0.01 * std::sqrt(1.0 / a.points + 1.0 / b.points);
  return std::max(dx, dy) > 0 && dx <= 4 && dy <= 4 &&
         static_cast<double>(std::abs(b.z - a.z)) <= std::min(0.03, 0.008 + 2.5 * sigma);
}

/// The first flat plate that each is connected with; itself where there is none.
std::vector<std::uint32_t> joined_slowly(const std::vector<Plate>& plates) {
  std::vector<std::uint32_t> part(plates.size());
  std::iota(part.begin(), part.end(), 0U);
  for (std::uint32_t i = 0; i < plates.size(); ++i) {
    for (std::uint32_t j = 0; j < i && is_flat(plates[i]); ++j) {
      if (part[j] == part[i] || !is_flat(plates[j]) || !may_join(plates[i], plates[j])) continue;
      const auto [first, other] = std::minmax({part[i], part[j]});
      std::replace(part.begin(), part.end(), other, first);
    }
  }
  std::vector<std::uint32_t> result = part;
  for (std::uint32_t i = 0; i < plates.size(); ++i) {
    float nearest = 1;
    for (std::uint32_t j = 0; j < plates.size() && !is_flat(plates[i]); ++j) {
      const float away = std::abs(plates[j].z - plates[i].z);
      if (!is_flat(plates[j]) || away >= nearest || !may_join(plates[i], plates[j])) continue;
      nearest = away, result[i] = part[j];
    }
  }
  return result;
}

TEST(JoinPlates, EqualsTheReferenceForAnyNumberOfThreads) {
  for (unsigned seed = 1; seed <= 2; ++seed) {
    const std::vector<Plate> plates = random_plates(seed);
    const std::vector<std::uint32_t> expected = joined_slowly(plates);
    for (const int threads : {1, 2, 4}) {
      std::vector<std::uint32_t> part;
      cloud::with_threads(threads, [&] { part = join_plates(plates, kCell); });
      ASSERT_EQ(part, expected) << "seed " << seed << ", " << threads << " threads";
    }
    std::vector<std::uint32_t> parts = expected;
    std::sort(parts.begin(), parts.end());
    parts.erase(std::unique(parts.begin(), parts.end()), parts.end());
    EXPECT_GE(parts.size(), 15U);
    EXPECT_LT(parts.size(), plates.size() / 2);
  }
}

}  // namespace
}  // namespace parhelion::semantic
