// Segmentation of real scans, against what their attribution files say was measured by hand.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <numbers>

#include "fusion/cloud/read_cloud.hpp"
#include "fusion/semantic/segmentation.hpp"
#include "tests/fusion/semantic/depth_frames.hpp"
#include "tests/recordings.hpp"

namespace parhelion::semantic {
namespace {

cloud::PointCloud<Cloud> scan(const std::string& relative) {
  auto file = cloud::read_scan(test::recording(relative));
  EXPECT_TRUE(file.ok()) << (file.ok() ? "" : file.error().message);
  const Transform<Cloud, Scanner> T_cloud_scan;
  return cloud::transformed(T_cloud_scan, file->cloud);
}

struct Levelled {
  cloud::PointCloud<Map> cloud;
  Segmentation found;
};

Levelled segmented(const cloud::PointCloud<Cloud>& cloud,
                   const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ()) {
  const auto T_map_cloud = level(cloud, up);
  EXPECT_TRUE(T_map_cloud.ok()) << (T_map_cloud.ok() ? "" : T_map_cloud.error().message);
  Levelled result{cloud::transformed(*T_map_cloud, cloud), {}};
  auto found = segment(result.cloud);
  EXPECT_TRUE(found.ok());
  result.found = std::move(*found);
  for (const HorizontalSurface& s : result.found.horizontals) {
    if (s.area >= 0.5)
      std::printf("  horizontal %6.3f m, %5.2f m2%s\n", s.z, s.area, s.faces_down ? ", faces down" : "");
  }
  for (const VerticalSurface& s : result.found.verticals) {
    const Eigen::Vector2d d = s.end - s.start;
    if (d.norm() >= 2)
      std::printf("  vertical %5.2f m, yaw %6.2f, %5.2f to %5.2f m\n", d.norm(),
                  std::remainder(std::atan2(d.y(), d.x()) * 180 / std::numbers::pi, 180), s.z_low, s.z_high);
  }
  return result;
}

/// The widest that faces up (or down), or null.
const HorizontalSurface* widest(const Segmentation& found, bool down) {
  const HorizontalSurface* best = nullptr;
  for (const HorizontalSurface& s : found.horizontals) {
    if (s.faces_down == down && (best == nullptr || s.area > best->area)) best = &s;
  }
  return best;
}

TEST(SegmentationOfRecordings, TheRoomHasItsFloorItsCeilingAndItsRightAngles) {
  PARHELION_NEEDS_RECORDING(test::recording("3d-room-scan/room_scan1.pcd"));
  const auto [cloud, found] = segmented(scan("3d-room-scan/room_scan1.pcd"));
  const auto *floor = widest(found, false), *ceiling = widest(found, true);
  ASSERT_TRUE(floor != nullptr && ceiling != nullptr);
  // The check values, -1.30 and 1.65, come from a histogram of the scan as it stands, tilted by one degree.
  EXPECT_NEAR(floor->z, -1.30, 0.04);
  EXPECT_NEAR(ceiling->z, 1.65, 0.03);
  EXPECT_NEAR(ceiling->z - floor->z, 2.95, 0.02);
  int walls = 0;
  for (const VerticalSurface& s : found.verticals) {
    const Eigen::Vector2d d = s.end - s.start;
    if (d.norm() < 4 || s.z_high - s.z_low < 1.5) continue;
    const double yaw = std::atan2(d.y(), d.x()) * 180 / std::numbers::pi;
    EXPECT_LT(std::abs(std::remainder(yaw, 90)), 1.0);
    ++walls;
  }
  EXPECT_GE(walls, 3);
}

TEST(SegmentationOfRecordings, TheStairsHaveTheirRises) {
  PARHELION_NEEDS_RECORDING(test::recording("3d-ori-stairs/06.pcd"));
  const auto [cloud, found] = segmented(scan("3d-ori-stairs/06.pcd"));
  std::vector<double> treads;
  for (const HorizontalSurface& s : found.horizontals) {
    if (s.area >= 0.5) treads.push_back(s.z);
  }
  std::sort(treads.begin(), treads.end());
  ASSERT_EQ(treads.size(), 5U);
  const std::vector<double> rises = {0.17, 0.17, 0.17, 0.18};
  for (std::size_t i = 0; i < rises.size(); ++i) EXPECT_NEAR(treads[i + 1] - treads[i], rises[i], 0.01) << i;
}

TEST(SegmentationOfRecordings, TheTerrainHasNoFlight) {
  for (const char* name : {"3d-drc-terrain/terrain_med.pcd", "3d-drc-terrain/tilted-steps.pcd"}) {
    PARHELION_NEEDS_RECORDING(test::recording(name));
    const auto [cloud, found] = segmented(scan(name));
    EXPECT_TRUE(found.parallels.empty()) << name;
  }
}

TEST(SegmentationOfRecordings, TheCorridorHasItsFloorItsCeilingAndItsWall) {
  PARHELION_NEEDS_RECORDING(test::recording("3d-3dtk-corridor/scan000.3d"));
  const auto [cloud, found] = segmented(scan("3d-3dtk-corridor/scan000.3d"));
  const auto *floor = widest(found, false), *ceiling = widest(found, true);
  ASSERT_TRUE(floor != nullptr && ceiling != nullptr);
  // One scan alone, its check values from the scan as it stands, nodding by two degrees.
  EXPECT_NEAR(floor->z, -0.43, 0.05);
  // The nodding bends it: its pieces lie at 2.04, 2.06 and 2.08.
  EXPECT_NEAR(ceiling->z, 2.00, 0.09);
  const auto wall = std::max_element(found.verticals.begin(), found.verticals.end(),
                                     [](const auto& a, const auto& b) { return a.points < b.points; });
  // The solid wall stands 0.90 m to the right.
  EXPECT_GT((wall->end - wall->start).norm(), 4);
  const Eigen::Vector2d d = (wall->end - wall->start).normalized();
  EXPECT_NEAR(std::abs(d.x() * wall->start.y() - d.y() * wall->start.x()), 0.95, 0.06);
}

TEST(SegmentationOfRecordings, TheLabelledCropsFloorAndWallAreFound) {
  PARHELION_NEEDS_RECORDING(test::recording("3d-s3dis-labelled-crop/s3dis_crop.ply"));
  const cloud::PointCloud<Cloud> cloud = scan("3d-s3dis-labelled-crop/s3dis_crop.ply");
  ASSERT_EQ(cloud.labels.size(), cloud.size());
  const Segmentation found = segmented(cloud).found;
  const HorizontalSurface* const floor = widest(found, false);
  ASSERT_NE(floor, nullptr);
  const auto verticals = static_cast<std::uint32_t>(found.verticals.size());
  const auto f1 = [&](std::uint8_t label, const auto& is_it) {
    double both = 0, said = 0, true_ones = 0;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const bool says = found.surface_of[i] != no_surface && is_it(found.surface_of[i]);
      both += says && cloud.labels[i] == label;
      said += says;
      true_ones += cloud.labels[i] == label;
    }
    return 2 * both / (said + true_ones);
  };
  const double floor_f1 =
      f1(1, [&](std::uint32_t s) { return s >= verticals && &found.horizontals[s - verticals] == floor; });
  // Only the lowest 0.6 m of one wall are there: it is the fullest upright surface all the same.
  const auto fullest = std::max_element(found.verticals.begin(), found.verticals.end(),
                                        [](const auto& a, const auto& b) { return a.points < b.points; });
  const double wall_f1 =
      f1(2, [&](std::uint32_t s) { return s < verticals && &found.verticals[s] == &*fullest; });
  std::printf("  F1 floor %.3f, wall %.3f\n", floor_f1, wall_f1);
  EXPECT_GE(floor_f1, 0.95);
  EXPECT_GE(wall_f1, 0.85);
}

TEST(SegmentationOfRecordings, TheKitchensTableTopIsNotItsFloor) {
  PARHELION_NEEDS_RECORDING(test::recording("rgbd-7scenes-redkitchen-a/frame-000000.depth.png"));
  const auto [cloud, found] = segmented(test::fused(test::kitchen_frames()), test::kitchen_up());
  // Table top 0.72 m above the floor, both seen from above.
  const HorizontalSurface* lowest = nullptr;
  for (const HorizontalSurface& s : found.horizontals) {
    if (s.area >= 0.3 && (lowest == nullptr || s.z < lowest->z)) lowest = &s;
  }
  ASSERT_NE(lowest, nullptr);
  EXPECT_FALSE(lowest->faces_down);
  EXPECT_TRUE(
      std::any_of(found.horizontals.begin(), found.horizontals.end(), [&](const HorizontalSurface& s) {
        return std::abs(s.z - lowest->z - 0.72) < 0.05 && s.area > 0.5 && !s.faces_down;
      }));
}

TEST(SegmentationOfRecordings, BothWaysAgreeOnTheRoom) {
  PARHELION_NEEDS_RECORDING(test::recording("3d-room-scan/room_scan1.pcd"));
  const cloud::PointCloud<Cloud> cloud = scan("3d-room-scan/room_scan1.pcd");
  const auto T_map_cloud = level(cloud);
  ASSERT_TRUE(T_map_cloud.ok());
  const cloud::PointCloud<Map> levelled = cloud::transformed(*T_map_cloud, cloud);
  const auto images = segment(levelled);
  const auto normals = segment_by_normals(levelled);
  ASSERT_TRUE(images.ok() && normals.ok());
  for (const bool down : {false, true})
    EXPECT_NEAR(widest(*images, down)->z, widest(*normals, down)->z, 0.015);
  // Each long wall of the normals way lies along one of the image way.
  for (const VerticalSurface& n : normals->verticals) {
    const Eigen::Vector2d d = n.end - n.start;
    if (d.norm() < 2.5 || n.z_high - n.z_low < 1.5) continue;
    EXPECT_TRUE(std::any_of(images->verticals.begin(), images->verticals.end(),
                            [&](const VerticalSurface& i) {
                              const Eigen::Vector2d e = (i.end - i.start).normalized();
                              const auto across = [&](const Eigen::Vector2d& q) {
                                return std::abs(e.x() * (q.y() - i.start.y()) -
                                                e.y() * (q.x() - i.start.x()));
                              };
                              return across(n.start) < 0.06 && across(n.end) < 0.06;
                            }))
        << d.norm() << " m from " << n.start.transpose();
  }
}

}  // namespace
}  // namespace parhelion::semantic
