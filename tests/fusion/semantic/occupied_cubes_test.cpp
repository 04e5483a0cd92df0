// Occupied cubes, counted by bits, against a plain set of them.
#include "fusion/semantic/occupied_cubes.hpp"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <tuple>

namespace parhelion::semantic {
namespace {

using Place = std::tuple<int, int, int>;

std::size_t plain_count_neighbours(const std::set<Place>& cubes) {
  std::size_t sum = 0;
  for (const auto& [x, y, z] : cubes) {
    for (int n = 0; n < 27; ++n)
      sum += n != 13 && cubes.contains({x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1}) ? 1 : 0;
  }
  return sum;
}

TEST(OccupiedCubes, CountAsAPlainSet) {
  std::mt19937_64 random(7);
  for (const int side : {1, 3, 6, 20}) {
    for (const int points : {1, 40, 2000}) {
      std::uniform_int_distribution<int> along(-side, side);
      OccupiedCubes cubes;
      std::set<Place> plain;
      for (int i = 0; i < points; ++i) {
        const Eigen::Array3i cube(along(random), along(random), along(random));
        cubes.add(cube);
        plain.emplace(cube.x(), cube.y(), cube.z());
      }
      EXPECT_EQ(cubes.count(), plain.size());
      EXPECT_EQ(cubes.count_neighbours(), plain_count_neighbours(plain));
    }
  }
}

TEST(OccupiedCubes, OfAPlaneHaveEightNeighboursEach) {
  constexpr int kSide = 40;
  OccupiedCubes cubes;
  for (int x = 0; x < kSide; ++x) {
    for (int y = 0; y < kSide; ++y) cubes.add({x - 1'000'000, y + 999'960, 5});
  }
  EXPECT_EQ(cubes.count(), std::size_t{kSide} * kSide);
  EXPECT_EQ(cubes.count_neighbours(), 8U * (kSide - 2) * (kSide - 2) + 4U * 5 * (kSide - 2) + 4U * 3);
}

TEST(OccupiedCubes, NoneAtFirst) {
  EXPECT_EQ(OccupiedCubes().count(), 0U);
  EXPECT_EQ(OccupiedCubes().count_neighbours(), 0U);
}

}  // namespace
}  // namespace parhelion::semantic
