// The semantic net on real recordings.
#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

#include "fusion/cloud/read_cloud.hpp"
#include "fusion/semantic/semantic_net.hpp"
#include "tests/fusion/semantic/depth_frames.hpp"
#include "tests/recordings.hpp"

namespace parhelion {
namespace {

struct Labelled {
  PointCloud<Map> cloud;
  SemanticNet net;
};

Labelled labelled(const PointCloud<Cloud>& cloud, const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ()) {
  const auto T_map_cloud = level(cloud, up);
  if (!T_map_cloud) throw std::runtime_error(T_map_cloud.error().message);
  Labelled result{transformed(*T_map_cloud, cloud), {}};
  const auto surfaces = segment(result.cloud);
  if (!surfaces) throw std::runtime_error(surfaces.error().message);
  auto net = label_entities(result.cloud, *surfaces);
  if (!net) throw std::runtime_error(net.error().message);
  result.net = std::move(*net);
  return result;
}

/// One scan, with the scanner at its origin where `at_origin`.
Labelled labelled(const std::filesystem::path& path, bool at_origin) {
  auto file = read_scan(path);
  if (!file) throw std::runtime_error(file.error().message);
  PointCloud<Cloud> cloud = transformed(Transform<Cloud, Scanner>(), file->cloud);
  if (at_origin && cloud.viewpoints.empty()) cloud.viewpoints = {Eigen::Vector3d::Zero()};
  Labelled result = labelled(cloud);
  result.cloud.labels = file->cloud.labels;
  return result;
}

double f1(const Labelled& found, std::uint8_t truth, EntityLabel label) {
  double both = 0, either = 0;
  for (std::size_t i = 0; i < found.cloud.size(); ++i) {
    const bool a = found.cloud.labels[i] == truth,
               b = found.net.labels[i] == static_cast<std::uint8_t>(label);
    both += a && b ? 2 : 0;
    either += (a ? 1 : 0) + (b ? 1 : 0);
  }
  return both / either;
}

TEST(NetOnRecordings, LabelsTheCropAsPeopleDid) {
  const auto path = test::recording("3d-s3dis-labelled-crop/s3dis_crop.ply");
  PARHELION_NEEDS_RECORDING(path)
  const Labelled found = labelled(path, false);
  ASSERT_EQ(found.cloud.labels.size(), found.cloud.size());
  EXPECT_GE(f1(found, 1, EntityLabel::floor), 0.95);
  EXPECT_GE(f1(found, 2, EntityLabel::wall), 0.85);
}

TEST(NetOnRecordings, FindsTheTwoRecessedDoorsOfTheSolidWall) {
  const auto path = test::recording("3d-3dtk-corridor/scan000.3d");
  PARHELION_NEEDS_RECORDING(path)
  const Labelled found = labelled(path, true);
  // The solid wall is 0.90 m to the right of the scanner, the doors about 0 and 3.4 m ahead of it.
  int in_solid_wall = 0, elsewhere = 0;
  for (const ModelEntity& e : found.net.entities) {
    if (e.label != EntityLabel::door) continue;
    const double y = e.T_map_body.translation().y();
    (y < -0.7 && y > -1.4 ? in_solid_wall : elsewhere) += 1;
  }
  RecordProperty("in_solid_wall", in_solid_wall);
  RecordProperty("elsewhere", elsewhere);
  EXPECT_GE(in_solid_wall, 1);
}

TEST(NetOnRecordings, MeasuresTheRisesOfTheEntrance) {
  const auto path = test::recording("3d-ori-stairs/06.pcd");
  PARHELION_NEEDS_RECORDING(path)
  const Labelled found = labelled(path, false);
  ASSERT_EQ(found.net.stairs.size(), 1U);
  // The lowest from a strip of ground 4 cm deep, which is no surface.
  const std::vector<double> expected = {0.17, 0.17, 0.17, 0.17, 0.18};
  const auto& rises = found.net.stairs[0].rises;
  ASSERT_EQ(rises.size(), expected.size());
  for (std::size_t i = 0; i < rises.size(); ++i) EXPECT_NEAR(rises[i], expected[i], 0.01) << i;
}

TEST(NetOnRecordings, ClimbsTheStairsOfTheDepthCamera) {
  PARHELION_NEEDS_RECORDING(test::recording("rgbd-7scenes-stairs/seq-01/frame-000000.depth.png"))
  const PointCloud<Cloud> cloud = test::fused(test::stairs_frames());
  // The first camera's y axis points down its picture; it looks 30 degrees down.
  const Labelled found = labelled(cloud, -Eigen::Vector3d::UnitY());
  ASSERT_EQ(found.net.stairs.size(), 1U);
  std::vector<double> rises = found.net.stairs[0].rises;
  ASSERT_EQ(rises.size(), 9U);
  // The lowest riser is 1.5 cm lower than the others, in one sequence alone too.
  EXPECT_NEAR(rises[0], 0.145, 0.01);
  for (std::size_t i = 1; i < rises.size(); ++i) EXPECT_NEAR(rises[i], 0.159, 0.01) << i;
}

TEST(NetOnRecordings, TakesNoTableOfTheKitchenForItsFloor) {
  PARHELION_NEEDS_RECORDING(test::recording("rgbd-7scenes-redkitchen-a/frame-000000.depth.png"))
  const Labelled found = labelled(test::fused(test::kitchen_frames()), test::kitchen_up());
  double floor = 1e9, walls = 0;
  for (const ModelEntity& e : found.net.entities) {
    if (e.label == EntityLabel::floor) floor = std::min(floor, e.T_map_body.translation().z());
    if (e.label == EntityLabel::wall && e.size.z() > 1.2 && e.size.x() > 2) ++walls;
  }
  for (const ModelEntity& e : found.net.entities) {
    if (e.label != EntityLabel::floor) continue;
    EXPECT_LT(e.T_map_body.translation().z(), floor + 0.1) << e.name;
  }
  EXPECT_GE(walls, 1);
  EXPECT_TRUE(found.net.stairs.empty());
}

TEST(NetOnRecordings, CallsNoTerrainStairs) {
  for (const char* name : {"terrain_med.pcd", "tilted-steps.pcd"}) {
    const auto path = test::recording(std::string("3d-drc-terrain/") + name);
    PARHELION_NEEDS_RECORDING(path)
    EXPECT_EQ(labelled(path, false).net.stairs.size(), 0U) << name;
  }
}

}  // namespace
}  // namespace parhelion
