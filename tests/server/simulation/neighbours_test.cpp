#include "server/simulation/world/neighbours.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

namespace parhelion::simulation {
namespace {

TEST(Neighbours, FindsAllInRangeOnceAndInOrder) {
  std::mt19937_64 random(7);
  const auto within = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  Neighbours neighbours;
  std::vector<std::uint32_t> found;
  for (int round = 0; round < 60; ++round) {
    const double half = round % 3 == 0 ? 4 : 60;
    std::vector<std::pair<Eigen::Vector2d, double>> discs;
    for (int i = 0; i < 5 * round; ++i)
      discs.emplace_back(Eigen::Vector2d(within(-half, half), within(-half, half)),
                         i % 17 == 0 ? within(1, 12) : within(0.1, 1));
    if (round % 10 == 9) discs.emplace_back(Eigen::Vector2d(1e300, std::nan("")), 0.3);
    neighbours.place(discs.size(), [&](std::size_t i) { return discs[i]; });
    for (int query = 0; query < 20; ++query) {
      const Eigen::Vector2d p(within(-half, half), within(-half, half));
      const double range = query == 0 ? 1e4 : within(0, 8);
      neighbours.near(p, range, found);
      EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
      EXPECT_EQ(std::adjacent_find(found.begin(), found.end()), found.end());
      for (std::uint32_t i = 0; i < discs.size(); ++i) {
        if ((discs[i].first - p).norm() > range + discs[i].second) continue;
        EXPECT_TRUE(std::binary_search(found.begin(), found.end(), i)) << i;
      }
    }
  }
}

}  // namespace
}  // namespace parhelion::simulation
