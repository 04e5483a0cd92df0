// Looked-through space: the rays found near a wall equal those of an exhaustive search.
#include "fusion/semantic/net/wall_raster.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace parhelion::semantic {
namespace {

cloud::PointCloud<Map> points_around(const std::vector<Eigen::Vector3d>& viewpoints, std::size_t each,
                                     unsigned seed) {
  cloud::PointCloud<Map> cloud;
  cloud.viewpoints = viewpoints;
  std::mt19937 random(seed);
  std::normal_distribution<float> offset(0, 5);
  for (std::uint16_t v = 0; v < viewpoints.size(); ++v) {
    for (std::size_t i = 0; i < each; ++i) {
      cloud.points.push_back(viewpoints[v].cast<float>() +
                             Eigen::Vector3f(offset(random), offset(random), 0.2F * offset(random)));
      cloud.scans.push_back(v);
    }
  }
  return cloud;
}

struct Rays {
  std::vector<std::uint16_t> through;  ///< those that continue for half a metre
  std::vector<std::uint32_t> hidden;   ///< those that end before the wall
};

/// Per cell, one ray at a time.
Rays rays_slowly(const cloud::PointCloud<Map>& cloud, const WallRaster& wall) {
  Rays rays{std::vector<std::uint16_t>(wall.through.size(), 0),
            std::vector<std::uint32_t>(wall.hidden.size(), 0)};
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d eye = cloud.viewpoints[cloud.scans[i]].cast<float>().cast<double>();
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    const double a = wall.away.dot(eye.head<2>() - wall.start), b = wall.away.dot(p.head<2>() - wall.start);
    if (std::abs(a) < 0.045 || std::abs(b) < 0.045) continue;
    if (a * b > 0 ? std::abs(b) >= std::abs(a) : std::abs(b) < 0.5) continue;
    const Eigen::Vector3d hit = eye + (p - eye) * (a / (a - b));
    const int c = static_cast<int>(std::floor(wall.along.dot(hit.head<2>() - wall.start) / wall.column));
    const int r = wall.row_of(hit.z());
    if (c < 0 || c >= wall.columns || r < 0 || r >= wall.rows) continue;
    if (a * b > 0)
      ++rays.hidden[wall.at(c, r)];
    else
      ++rays.through[wall.at(c, r)];
  }
  return rays;
}

TEST(WallRaster, CountsTheSameRaysAsBruteForce) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(-6, 6);
  for (unsigned round = 0; round < 40; ++round) {
    const cloud::PointCloud<Map> cloud =
        points_around({{place(random), place(random), 1}, {place(random), place(random), 1.5}}, 3000, round);
    const Eigen::Vector2d start(place(random), place(random)), end(place(random), place(random));
    const WallRaster wall = rasterize(PlanPoints(cloud), start, end, -1, 3, 0.045);
    const Rays rays = rays_slowly(cloud, wall);
    EXPECT_EQ(wall.through, rays.through) << "round " << round;
    EXPECT_EQ(wall.hidden, rays.hidden) << "round " << round;
    EXPECT_TRUE(std::equal(rays.through.begin(), rays.through.end(), wall.crossed.begin()))
        << "round " << round;
    EXPECT_TRUE(wall.viewpoints_known);
  }
}

TEST(WallRaster, AWallOfALargeSiteKeepsItsOwnRays) {
  std::vector<Eigen::Vector3d> viewpoints;
  for (int i = 0; i < 60; ++i) viewpoints.emplace_back(100.0 * i, 0, 1);
  const auto crossed = [&](std::size_t rooms) {
    const cloud::PointCloud<Map> cloud = points_around(
        {viewpoints.begin(), viewpoints.begin() + static_cast<std::ptrdiff_t>(rooms)}, 15'000, 5);
    const WallRaster wall = rasterize(PlanPoints(cloud), {2, -3}, {2, 3}, -1, 3, 0.045);
    std::size_t sum = 0;
    for (const std::uint16_t rays : wall.through) sum += rays;
    return sum;
  };
  EXPECT_GT(crossed(1), 1000U);
  EXPECT_EQ(crossed(60), crossed(1));
}

}  // namespace
}  // namespace parhelion::semantic
