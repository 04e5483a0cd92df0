// Doorways of all kinds in walls of all kinds, and what looks like one.
#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "fusion/semantic/net/semantic_net.hpp"
#include "tests/fusion/semantic/clouds.hpp"
#include "tests/synthetic_site.hpp"

namespace parhelion::semantic {
namespace {

using test::CloudSampler;

SemanticNet net_of(const cloud::PointCloud<Map>& cloud, const SemanticNetOptions& options = {}) {
  const auto surfaces = segment(cloud);
  if (!surfaces) throw std::runtime_error(surfaces.error().message);
  auto net = label_entities(cloud, *surfaces, options);
  if (!net) throw std::runtime_error(net.error().message);
  return *net;
}

long number_of(const SemanticNet& net, EntityLabel label) {
  return std::count_if(net.entities.begin(), net.entities.end(),
                       [&](const ModelEntity& e) { return e.label == label; });
}

/// m, of walls whose middle is within 0.3 m of a line across the plan.
double wall_length_on(const SemanticNet& net, double y) {
  double length = 0;
  for (const ModelEntity& e : net.entities) {
    if (e.label == EntityLabel::wall && std::abs(e.T_map_body.translation().y() - y) < 0.3)
      length += e.size.x();
  }
  return length;
}

struct Hole {
  double from = 0, to = 0, low = 0, high = 0;  ///< m, along x and z
};

/// Removes what lies within 0.2 m of the plane y in the holes, but for the floor.
void cut_holes(cloud::PointCloud<Map>& cloud, double y, const std::vector<Hole>& holes) {
  std::vector<bool> keep;
  for (const Eigen::Vector3f& point : cloud.points) {
    const Eigen::Vector3d p = point.cast<double>();
    keep.push_back(std::none_of(holes.begin(), holes.end(), [&](const Hole& hole) {
      return std::abs(p.y() - y) < 0.2 && p.x() > hole.from && p.x() < hole.to && p.z() > hole.low + 0.02 &&
             p.z() < hole.high;
    }));
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < keep.size(); ++i) {
    if (!keep[i]) continue;
    cloud.points[kept] = cloud.points[i];
    if (!cloud.scans.empty()) cloud.scans[kept] = cloud.scans[i];
    ++kept;
  }
  cloud.points.resize(kept);
  if (!cloud.scans.empty()) cloud.scans.resize(kept);
}

/// Two rooms, 12 m by 3 m each, on both sides of a wall at y = 3 m, seen from two places in either.
cloud::PointCloud<Map> two_rooms(const std::vector<Hole>& holes, double height = 2.6) {
  CloudSampler sampler(600, 0.004, 61);
  sampler.room({0, 0}, {12, 3}, 0, height);
  sampler.room({0, 3.12}, {12, 6}, 0, height);
  sampler.slab({0, 3}, {12, 3.12}, 0);
  cloud::PointCloud<Map> cloud = sampler.cloud();
  cut_holes(cloud, 3.06, holes);
  cloud.viewpoints = {{3, 1, 1.5}, {9, 1, 1.5}, {3, 5, 1.5}, {9, 5, 1.5}};
  // Every point is seen from its own room; one in ten of the far halves from the other one, through the
  // holes.
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    std::uint16_t scan = static_cast<std::uint16_t>((p.x() > 6 ? 1 : 0) + (p.y() > 3.06 ? 2 : 0));
    const std::uint16_t other = static_cast<std::uint16_t>((scan + 2) % 4);
    const Eigen::Vector3d from = cloud.viewpoints[other];
    const double t = (3.06 - from.y()) / (p.y() - from.y());
    const Eigen::Vector3d at = from + t * (p - from);
    const bool through = std::any_of(holes.begin(), holes.end(), [&](const Hole& hole) {
      return at.x() > hole.from && at.x() < hole.to && at.z() > hole.low && at.z() < hole.high;
    });
    if (through && i % 2 == 0) scan = other;
    cloud.scans.push_back(scan);
  }
  return cloud;
}

// No single label makes it one: without its doors it is worth less than they.
TEST(Doorways, AWallWithManyDoorsIsAWall) {
  std::vector<Hole> holes;
  for (double x = 0.8; x < 11; x += 1.75) holes.push_back({x, x + 0.9, 0, 2.05});
  const SemanticNet net = net_of(two_rooms(holes));
  EXPECT_GT(wall_length_on(net, 3.06), 5);
  EXPECT_GE(number_of(net, EntityLabel::door), 5);
}

TEST(Doorways, ADoubleDoorUnderALintelIsADoor) {
  EXPECT_EQ(number_of(net_of(two_rooms({{5, 6.8, 0, 2.1}})), EntityLabel::door), 1);
  EXPECT_EQ(number_of(net_of(two_rooms({{4, 7.4, 0, 2.1}})), EntityLabel::door), 0) << "a gate of 3.4 m";
}

TEST(Doorways, ADoorwayUpToTheCeilingIsADoor) {
  EXPECT_EQ(number_of(net_of(two_rooms({{3, 4.1, 0, 3.5}}, 3.2)), EntityLabel::door), 1);
}

TEST(Doorways, ANicheUpToTheCeilingOfALowRoomIsNone) {
  CloudSampler sampler(600, 0.004, 62);
  sampler.room({0, 0}, {8, 4}, 0, 2.5);
  sampler.wall({3, 4.25}, {4, 4.25}, 0, 2.5);
  for (const double x : {3.0, 4.0}) sampler.wall({x, 4}, {x, 4.25}, 0, 2.5);
  sampler.slab({3, 4}, {4, 4.25}, 0);
  cloud::PointCloud<Map> cloud = sampler.cloud();
  std::erase_if(cloud.points, [](const Eigen::Vector3f& p) {
    return p.x() > 3.02F && p.x() < 3.98F && std::abs(p.y() - 4) < 0.03F && p.z() > 0.05F;
  });
  EXPECT_EQ(number_of(net_of(cloud), EntityLabel::door), 0);
}

// Half a voxel deep: in a voxel map that is how a wall askew to the grid looks.
TEST(Doorways, ALeafThatIsRecessedByLessThanHalfAVoxelIsNone) {
  CloudSampler sampler(900, 0.002, 63);
  sampler.room({0, 0}, {8, 4}, 0, 2.6);
  cloud::PointCloud<Map> cloud = sampler.cloud();
  for (Eigen::Vector3f& p : cloud.points) {
    if (p.x() > 3 && p.x() < 3.9F && p.y() > 3.9F && p.z() > 0.02F && p.z() < 2.05F) p.y() += 0.02F;
  }
  EXPECT_EQ(number_of(net_of(cloud), EntityLabel::door), 1);
  SemanticNetOptions voxels;
  voxels.voxel = 0.05;
  EXPECT_EQ(number_of(net_of(cloud, voxels), EntityLabel::door), 0);
}

TEST(Doorways, OfAnUpperStoreyAreFoundInAWallThroughAllStoreys) {
  CloudSampler sampler(500, 0.004, 64);
  for (const double z : {0.0, 3.0, 6.0}) {
    sampler.slab({0, 0}, {8, 5}, z);
    sampler.slab({0, 0}, {8, 5}, z + 2.8);
  }
  sampler.wall({0, 0}, {8, 0}, 0, 8.8);
  sampler.wall({0, 5}, {8, 5}, 0, 8.8);
  sampler.wall({0, 0}, {0, 5}, 0, 8.8);
  sampler.wall({8, 0}, {8, 5}, 0, 8.8);
  for (const double z : {0.0, 3.0, 6.0}) sampler.slab({2, 5}, {6, 6.5}, z);
  cloud::PointCloud<Map> cloud = sampler.cloud();
  cut_holes(cloud, 5, {{2.5, 3.4, 0, 2.05}, {2.5, 3.4, 3, 5.05}, {4.5, 5.4, 6, 8.05}});
  const SemanticNet net = net_of(cloud);
  std::vector<double> feet;
  for (const ModelEntity& e : net.entities) {
    if (e.label == EntityLabel::door) feet.push_back(e.T_map_body.translation().z() - e.size.z() / 2);
  }
  std::sort(feet.begin(), feet.end());
  ASSERT_EQ(feet.size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(feet[k], 3.0 * static_cast<double>(k), 0.1);
}

/// A room whose counter hides what is under a hole in its wall, from all places; a house stands opposite.
/// From the next room no ray gets there at all.
cloud::PointCloud<Map> room_with_counter(double counter, double sill) {
  SemanticModel site;
  const auto add = [&](EntityLabel label, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    site.entities.push_back(test::model_box("box " + std::to_string(site.entities.size()), label,
                                            0.5 * (low + high), high - low));
  };
  using L = EntityLabel;
  add(L::floor, {-0.2, -4.2, -0.2}, {6.2, 4.4, 0}), add(L::ceiling, {-0.2, -4.2, 2.7}, {6.2, 4.4, 2.9});
  add(L::wall, {0, -4.1, 0}, {6, -4, 2.7}), add(L::wall, {-0.1, -4, 0}, {0, 0, 2.7});
  add(L::wall, {6, -4, 0}, {6.1, 0, 2.7});
  add(L::wall, {0, -0.1, 0}, {6, 0, 2.7}), add(L::wall, {-0.1, 0, 0}, {0, 4, 2.7});
  add(L::wall, {6, 0, 0}, {6.1, 4, 2.7}), add(L::wall, {0, 4, 0}, {2.4, 4.2, 2.7});
  add(L::wall, {3.6, 4, 0}, {6, 4.2, 2.7}), add(L::wall, {2.4, 4, 2.05}, {3.6, 4.2, 2.7});
  if (sill > 0) add(L::wall, {2.4, 4, 0}, {3.6, 4.2, sill});
  if (counter > 0) add(L::unknown, {1.6, 3.3, 0}, {4.4, 3.98, counter});
  add(L::wall, {-6, 9, -3}, {12, 9.2, 6});
  auto scan = test::scan_of(
      site, {{2.2, 1.2, 1.4}, {3.8, 1.0, 1.5}, {2.5, -1, 1.4}, {3.5, -1, 1.4}, {3, -2, 1.4}}, 0.012);
  const auto level_frame = level(scan);
  if (!level_frame) throw std::runtime_error(level_frame.error().message);
  return cloud::transformed(*level_frame, scan);
}

TEST(Doorways, AWindowWhoseSillACounterHidesIsNone) {
  for (const double counter : {0.85, 1.0}) {
    const SemanticNet net = net_of(room_with_counter(counter, 0.8));
    EXPECT_EQ(number_of(net, EntityLabel::door), 0) << counter;
    EXPECT_EQ(number_of(net, EntityLabel::window), 1) << counter;
  }
  EXPECT_EQ(number_of(net_of(room_with_counter(0, 0)), EntityLabel::door), 1);
}

TEST(Doorways, ALeafThatIsFlushWithTheFaceThatIsDrawnIsFoundFromTheOtherFace) {
  for (const bool flush_with_longer : {true, false}) {
    CloudSampler sampler(600, 0.003, 71);
    sampler.room({0, 0}, {flush_with_longer ? 6.0 : 12.0, 3}, 0, 2.6);
    sampler.room({0, 3.12}, {flush_with_longer ? 12.0 : 6.0, 6}, 0, 2.6);
    cloud::PointCloud<Map> cloud = sampler.cloud();
    // From the first room the leaf is in a recess of 11 cm; the other room sees an even face.
    std::erase_if(cloud.points, [](const Eigen::Vector3f& p) {
      return std::abs(p.y() - 3) < 0.02F && p.x() > 2 && p.x() < 2.9F && p.z() > 0.02F && p.z() < 2.05F;
    });
    CloudSampler leaf(600, 0.003, 72);
    leaf.wall({2, 3.11}, {2.9, 3.11}, 0.01, 2.05);
    leaf.slab({2, 3}, {2.9, 3.11}, 0);
    const std::size_t first = cloud.points.size();
    cloud.points.insert(cloud.points.end(), leaf.cloud().points.begin(), leaf.cloud().points.end());
    cloud.viewpoints = {{3, 1, 1.5}, {3, 5, 1.5}};
    for (std::size_t i = 0; i < cloud.size(); ++i)
      cloud.scans.push_back(i >= first || cloud.points[i].y() < 3.06F ? 0 : 1);
    const SemanticNet net = net_of(cloud);
    EXPECT_EQ(number_of(net, EntityLabel::door), 1) << flush_with_longer;
  }
}

}  // namespace
}  // namespace parhelion::semantic
