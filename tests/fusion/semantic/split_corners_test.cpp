#include "fusion/semantic/objects/split_corners.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace parhelion::semantic {
namespace {

/// Points 2 cm apart on a level rectangle, turned by `yaw` about the origin.
void add_top(cloud::PointCloud<Map>& cloud, Eigen::Vector2d low, Eigen::Vector2d high, double yaw) {
  for (double x = low.x(); x < high.x(); x += 0.02) {
    for (double y = low.y(); y < high.y(); y += 0.02) {
      const Eigen::Vector2d p = Eigen::Rotation2Dd(yaw) * Eigen::Vector2d(x, y);
      cloud.points.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()), 0.9F);
      cloud.labels.push_back(static_cast<std::uint8_t>(EntityLabel::unknown));
    }
  }
}

std::vector<std::vector<std::uint32_t>> pieces_of(const cloud::PointCloud<Map>& cloud) {
  const ObjectGrid grid(cloud, cloud.labels, {}, 0.05);
  std::vector<std::uint32_t> cubes(grid.cubes().size());
  std::iota(cubes.begin(), cubes.end(), 0U);
  auto pieces = split_corners(grid, cubes);
  std::size_t all = 0;
  for (const auto& piece : pieces) all += piece.size();
  EXPECT_EQ(all, cubes.size());
  return pieces;
}

TEST(SplitCorners, CountersAroundACornerAreTwo) {
  for (const double yaw : {0.0, 0.3, 0.8, 1.4}) {
    cloud::PointCloud<Map> cloud;
    add_top(cloud, {0, 0}, {2.6, 0.6}, yaw);
    add_top(cloud, {2.0, 0.6}, {2.6, 3.0}, yaw);
    EXPECT_EQ(pieces_of(cloud).size(), 2U) << yaw;
  }
}

TEST(SplitCorners, CountersAlongThreeWallsAreThree) {
  for (const double yaw : {0.1, 0.7}) {
    cloud::PointCloud<Map> cloud;
    add_top(cloud, {0, 0}, {0.6, 2.4}, yaw);
    add_top(cloud, {0.6, 0}, {2.4, 0.6}, yaw);
    add_top(cloud, {2.4, 0}, {3.0, 2.4}, yaw);
    EXPECT_EQ(pieces_of(cloud).size(), 3U) << yaw;
  }
}

TEST(SplitCorners, ATableAndTwoFacesOfACupboardStayWhole) {
  cloud::PointCloud<Map> table, faces;
  add_top(table, {0, 0}, {2.0, 1.0}, 0.4);
  EXPECT_EQ(pieces_of(table).size(), 1U);
  add_top(faces, {0, 0}, {2.0, 0.06}, 0.4);
  add_top(faces, {0, 0.06}, {0.06, 1.0}, 0.4);
  EXPECT_EQ(pieces_of(faces).size(), 1U);
}

}  // namespace
}  // namespace parhelion::semantic
