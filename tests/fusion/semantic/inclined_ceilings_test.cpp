// Ceilings that are inclined, and what is none: a hillside, a board that leans on a wall, a level ceiling.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "fusion/semantic/build_model.hpp"
#include "tests/degree.hpp"
#include "tests/fusion/semantic/clouds.hpp"

namespace parhelion::semantic {
namespace {

using test::CloudSampler;
using test::kDegree;

/// Two rooms of an attic, 8 m along x, its ridge over y = 3 m, between knee walls.
struct Attic {
  double knee, pitch;  ///< m, rad
  double ridge() const { return knee + 3 * std::tan(pitch); }
  double roof(double y) const { return knee + std::tan(pitch) * std::min(y, 6 - y); }
};

cloud::PointCloud<Cloud> attic_cloud(const Attic& attic, double sigma, bool viewpoints, std::uint64_t seed) {
  CloudSampler sampler(400, sigma, seed);
  sampler.slab({0, 0}, {8, 6}, 0);
  sampler.wall({0, 0}, {8, 0}, 0, attic.knee), sampler.wall({0, 6}, {8, 6}, 0, attic.knee);
  for (const double x : {0.0, 4.0, 8.0}) sampler.wall({x, 0}, {x, 6}, 0, attic.ridge());
  const double rise = attic.ridge() - attic.knee;
  sampler.rectangle({0, 0, attic.knee}, {8, 0, 0}, {0, 3, rise});
  sampler.rectangle({0, 6, attic.knee}, {8, 0, 0}, {0, -3, rise});
  cloud::PointCloud<Cloud> cloud;
  for (const Eigen::Vector3f& p : sampler.cloud().points) {
    if (static_cast<double>(p.z()) < attic.roof(static_cast<double>(p.y())) + 4 * sigma)
      cloud.points.push_back(p);
  }
  if (!viewpoints) return cloud;
  cloud.viewpoints = {{2, 3, 1.4}, {6, 3, 1.4}};
  for (const Eigen::Vector3f& p : cloud.points) cloud.scans.push_back(p.x() < 4 ? 0 : 1);
  return cloud;
}

BuiltModel built_of(const cloud::PointCloud<Cloud>& cloud, int threads = 0) {
  ModelOptions options;
  options.segmentation.threads = threads;
  options.up = Eigen::Vector3d::UnitZ();
  auto built = build_model(cloud, options);
  if (!built) throw std::runtime_error(built.error().message);
  return std::move(*built);
}

std::vector<ModelEntity> ceilings_of(const BuiltModel& built) {
  std::vector<ModelEntity> found;
  for (const ModelEntity& e : built.model.entities) {
    if (e.label == EntityLabel::ceiling) found.push_back(e);
  }
  return found;
}

double inclination(const ModelEntity& e) { return std::acos(std::min(1.0, e.T_map_body.rotation()(2, 2))); }

TEST(InclinedCeilings, TheTwoSidesOfARoofAreCeilingsWhateverTheirPitch) {
  std::uint64_t seed = 10;
  for (const double pitch : {8.0, 20.0, 35.0, 50.0}) {
    for (const bool viewpoints : {false, true}) {
      const Attic attic{pitch < 30 ? 2.2 : 1.0, pitch * kDegree};
      const BuiltModel built = built_of(attic_cloud(attic, viewpoints ? 0.02 : 0.005, viewpoints, ++seed));
      double roof = 0, called = 0;
      for (std::size_t i = 0; i < built.cloud.size(); ++i) {
        const Eigen::Vector3d p = built.model.T_map_cloud.inverse() * built.cloud.points[i].cast<double>();
        if (std::abs(p.z() - attic.roof(p.y())) > 0.04 || std::remainder(p.x(), 4) < 0.2) continue;
        roof += 1;
        called += built.cloud.labels[i] == static_cast<std::uint8_t>(EntityLabel::ceiling) ? 1 : 0;
      }
      EXPECT_GT(called, 0.95 * roof) << pitch << viewpoints;
      double area = 0;
      for (const ModelEntity& e : ceilings_of(built)) {
        EXPECT_NEAR(inclination(e), pitch * kDegree, 1.0 * kDegree) << e.name;
        const Eigen::Vector3d under =
            built.model.T_map_cloud.inverse() * (e.T_map_body * Eigen::Vector3d(0, 0, -e.size.z() / 2));
        EXPECT_NEAR(under.z(), attic.roof(under.y()), 0.05) << e.name;
        area += e.size.x() * e.size.y();
      }
      EXPECT_NEAR(area, 48 / std::cos(pitch * kDegree), 7) << pitch << viewpoints;
    }
  }
}

TEST(InclinedCeilings, AHillsideAndABoardThatLeansAreNone) {
  CloudSampler hill(400, 0.01, 3);
  hill.slab({0, 0}, {8, 6}, 0);
  hill.rectangle({0, 6, 0}, {8, 0, 0}, {0, 6, 3.5});
  hill.wall({0, 0}, {8, 0}, 0, 3);
  cloud::PointCloud<Cloud> outdoors;
  outdoors.points = hill.cloud().points;
  EXPECT_TRUE(ceilings_of(built_of(outdoors)).empty());

  CloudSampler room(400, 0.005, 4);
  room.room({0, 0}, {6, 5}, 0, 2.6);
  room.rectangle({2, 0.1, 1.5}, {2, 0, 0}, {0, 1.2, -1.45});
  cloud::PointCloud<Cloud> board;
  board.points = room.cloud().points;
  for (const ModelEntity& e : ceilings_of(built_of(board))) EXPECT_LT(inclination(e), 2 * kDegree) << e.name;
}

TEST(InclinedCeilings, AreTheSameForAnyNumberOfThreads) {
  const cloud::PointCloud<Cloud> cloud = attic_cloud({1.0, 40 * kDegree}, 0.01, true, 6);
  const BuiltModel one = built_of(cloud, 1), several = built_of(cloud, 4);
  EXPECT_EQ(one.cloud.labels, several.cloud.labels);
  const std::vector<ModelEntity> ceilings = ceilings_of(one), again = ceilings_of(several);
  ASSERT_GE(ceilings.size(), 2U);
  ASSERT_EQ(ceilings.size(), again.size());
  for (std::size_t k = 0; k < again.size(); ++k) {
    EXPECT_EQ(ceilings[k].name, again[k].name);
    EXPECT_EQ(ceilings[k].size, again[k].size);
    EXPECT_EQ(ceilings[k].confidence, again[k].confidence);
    EXPECT_EQ(ceilings[k].T_map_body.translation(), again[k].T_map_body.translation());
  }
}

TEST(InclinedCeilings, ARoomUnderALevelCeilingKeepsIt) {
  CloudSampler sampler(400, 0.01, 5);
  sampler.room({0, 0}, {6, 5}, 0, 2.6);
  cloud::PointCloud<Cloud> cloud;
  cloud.points = sampler.cloud().points;
  const std::vector<ModelEntity> ceilings = ceilings_of(built_of(cloud));
  ASSERT_EQ(ceilings.size(), 1U);
  EXPECT_LT(inclination(ceilings[0]), 1e-6);
}

}  // namespace
}  // namespace parhelion::semantic
