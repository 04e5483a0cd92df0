// What looks like a doorway and is none, in clouds whose viewpoints are not known.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "fusion/semantic/net/semantic_net.hpp"
#include "tests/fusion/semantic/clouds.hpp"

namespace parhelion::semantic {
namespace {

using test::CloudSampler;

/// Number of entities with the label whose middle is within 0.8 m of the place in the plan.
long number_at(const cloud::PointCloud<Map>& cloud, EntityLabel label, const Eigen::Vector2d& place) {
  const auto surfaces = segment(cloud);
  if (!surfaces) throw std::runtime_error(surfaces.error().message);
  const auto net = label_entities(cloud, *surfaces, {});
  if (!net) throw std::runtime_error(net.error().message);
  return std::count_if(net->entities.begin(), net->entities.end(), [&](const ModelEntity& e) {
    return e.label == label && (e.T_map_body.translation().head<2>() - place).norm() < 0.8;
  });
}

/// Removes the wall at y = 4 m from x = 3 to 4 m between two heights.
void cut_wall(cloud::PointCloud<Map>& cloud, float low, float high) {
  std::erase_if(cloud.points, [&](const Eigen::Vector3f& p) {
    return std::abs(p.y() - 4) < 0.03F && p.x() > 3 && p.x() < 4 && p.z() > low && p.z() < high;
  });
}

/// A room of 8 by 4 m with a doorway of 1 by 2.1 m into a room behind its wall, or into a niche of this
/// depth.
cloud::PointCloud<Map> room_with_niche(double depth) {
  CloudSampler sampler(600, 0.004, 81);
  sampler.room({0, 0}, {8, 4}, 0, 3);
  sampler.slab({3, 4}, {4, 4 + depth}, 0);
  sampler.slab({3, 4}, {4, 4 + depth}, 2.1);
  sampler.wall({3, 4 + depth}, {4, 4 + depth}, 0, 2.1);
  for (const double x : {3.0, 4.0}) sampler.wall({x, 4}, {x, 4 + depth}, 0, 2.1);
  cloud::PointCloud<Map> cloud = sampler.cloud();
  cut_wall(cloud, 0.03F, 2.1F);
  return cloud;
}

TEST(FalseDoorways, ANicheDeeperThanARecessIsNone) {
  for (const double depth : {0.45, 0.6, 0.7}) {
    EXPECT_EQ(number_at(room_with_niche(depth), EntityLabel::door, {3.5, 4}), 0) << depth;
  }
  EXPECT_EQ(number_at(room_with_niche(2.5), EntityLabel::door, {3.5, 4}), 1);
}

/// Two rooms on both sides of a wall 12 cm thick. A locker hides the wall of the first room, or its doorway
/// has a leaf in the plane of the other face.
cloud::PointCloud<Map> room_with_locker(bool locker) {
  CloudSampler sampler(600, 0.004, 82);
  sampler.room({0, 0}, {8, 4}, 0, 3);
  sampler.room({2, 4.12}, {6, 8}, 0, 3);
  if (!locker) sampler.slab({3, 4}, {4, 4.12}, 0);
  cloud::PointCloud<Map> cloud = sampler.cloud();
  cut_wall(cloud, 0.03F, 1.95F);
  if (locker) {
    std::erase_if(cloud.points, [](const Eigen::Vector3f& p) {
      return p.x() > 3 && p.x() < 4 && p.y() > 3.5F && p.y() < 4.03F && p.z() < 1.95F;
    });
    CloudSampler thing(600, 0.004, 83);
    thing.wall({3, 3.5}, {4, 3.5}, 0, 1.95);
    for (const double x : {3.0, 4.0}) thing.wall({x, 3.5}, {x, 4}, 0, 1.95);
    thing.slab({3, 3.5}, {4, 4}, 1.95);
    cloud.points.insert(cloud.points.end(), thing.cloud().points.begin(), thing.cloud().points.end());
  }
  return cloud;
}

TEST(FalseDoorways, TheOtherFaceOfAWallBehindALockerIsNone) {
  EXPECT_EQ(number_at(room_with_locker(true), EntityLabel::door, {3.5, 4}), 0);
  EXPECT_EQ(number_at(room_with_locker(false), EntityLabel::door, {3.5, 4}), 1);
}

/// A room whose far wall lies behind its plane by these depths, m, over 0.8 m each.
cloud::PointCloud<Map> room_with_steps(const std::array<float, 10>& depths) {
  CloudSampler sampler(900, 0.002, 84);
  sampler.room({0, 0}, {8, 4}, 0, 2.6);
  cloud::PointCloud<Map> cloud = sampler.cloud();
  for (Eigen::Vector3f& p : cloud.points) {
    if (p.y() > 3.9F && p.z() > 0.02F && p.z() < 2.05F)
      p.y() += depths[static_cast<std::size_t>(std::clamp(p.x() / 0.8F, 0.F, 9.F))];
  }
  return cloud;
}

// So does the wall of a camera whose images do not fit.
TEST(FalseDoorways, AStretchOfAWallThatWavesIsNoLeaf) {
  const float leaf = 0.022F;
  EXPECT_EQ(number_at(room_with_steps({0, 0, 0, leaf, 0, 0, 0, 0, 0, 0}), EntityLabel::door, {2.8, 4}), 1);
  EXPECT_EQ(number_at(room_with_steps({0, -0.012F, 0, leaf, 0, -0.012F, -0.014F, 0, -0.012F, 0.011F}),
                      EntityLabel::door, {2.8, 4}),
            0);
}

TEST(FalseDoorways, AWindowOverAWallWhoseFootIsHiddenIsNone) {
  CloudSampler sampler(600, 0.004, 85);
  sampler.room({0, 0}, {8, 4}, 0, 2.8);
  cloud::PointCloud<Map> cloud = sampler.cloud();
  cut_wall(cloud, 1.1F, 2.2F);
  cut_wall(cloud, 0.03F, 0.5F);
  EXPECT_EQ(number_at(cloud, EntityLabel::door, {3.5, 4}), 0);
  EXPECT_EQ(number_at(cloud, EntityLabel::window, {3.5, 4}), 1);
}

/// A low room across which a wall stands up to this height, with a gap. Floor and ceiling go on.
cloud::PointCloud<Map> low_room_with_gap(double top, double gap = 0.9) {
  CloudSampler sampler(600, 0.004, 86);
  sampler.room({0, 0}, {8, 8}, 0, 2.45);
  for (const double y : {4.0, 4.1}) {
    sampler.wall({0, y}, {3, y}, 0, top);
    sampler.wall({3 + gap, y}, {8, y}, 0, top);
  }
  return sampler.cloud();
}

TEST(FalseDoorways, AGapBetweenPartitionsBelowTheCeilingIsNone) {
  EXPECT_EQ(number_at(low_room_with_gap(2.05), EntityLabel::door, {3.45, 4}), 0);
  EXPECT_EQ(number_at(low_room_with_gap(2.45), EntityLabel::door, {3.45, 4}), 1);
}

TEST(FalseDoorways, NoWallIsDrawnAcrossAGapWithFloorAtBothSides) {
  const cloud::PointCloud<Map> cloud = low_room_with_gap(2.05, 0.65);
  const auto surfaces = segment(cloud);
  ASSERT_TRUE(surfaces);
  const auto net = label_entities(cloud, *surfaces, {});
  ASSERT_TRUE(net);
  for (const ModelEntity& e : net->entities) {
    const Eigen::Vector3d gap = e.T_map_body.inverse() * Eigen::Vector3d(3.3, 4.05, 1);
    EXPECT_FALSE(e.label == EntityLabel::wall && (gap.cwiseAbs().array() < 0.5 * e.size.array() + 0.1).all())
        << e.name;
  }
}

}  // namespace
}  // namespace parhelion::semantic
