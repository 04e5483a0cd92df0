// Labelled entities from surfaces, on known rooms.
#include "fusion/semantic/net/semantic_net.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "fusion/semantic/net/net_graph.hpp"
#include "protocols/model_overlap.hpp"
#include "tests/fusion/semantic/clouds.hpp"
#include "tests/fusion/semantic/net_of.hpp"

namespace parhelion::semantic {
namespace {

using test::CloudSampler;
using testing::HasSubstr;

long count(const SemanticNet& net, EntityLabel label) {
  return std::count_if(net.entities.begin(), net.entities.end(),
                       [&](const ModelEntity& e) { return e.label == label; });
}

TEST(SemanticNet, FindsFourWallsFloorAndCeilingOfABareRoom) {
  CloudSampler sampler(600, 0.005, 1);
  sampler.room({0, 0}, {5, 4}, 0, 2.7);
  const SemanticNet net = net_of(sampler.cloud());
  EXPECT_EQ(count(net, EntityLabel::wall), 4);
  EXPECT_EQ(count(net, EntityLabel::floor), 1);
  EXPECT_EQ(count(net, EntityLabel::ceiling), 1);
  EXPECT_EQ(count(net, EntityLabel::door), 0);
  EXPECT_EQ(net.evidence.size(), net.entities.size());
  EXPECT_EQ(net.labels.size(), sampler.cloud().size());
  EXPECT_FALSE(find_overlap(net.entities));
}

TEST(SemanticNet, FindsTheCeilingsOfStoreysUnderTheWidestFloor) {
  CloudSampler sampler(600, 0.005, 5);
  sampler.room({0, 0}, {8, 6}, 0, 2.6);
  sampler.wall({4, 0}, {4, 6}, 0, 2.6);
  sampler.room({0, 0}, {10, 6}, 2.9, 5.4);
  cloud::PointCloud<Map> cloud = sampler.cloud();
  cloud.viewpoints = {{2, 3, 1.3}, {6, 3, 1.3}, {5, 3, 4.2}};
  for (const Eigen::Vector3f& p : cloud.points) cloud.scans.push_back(p.z() > 2.75F ? 2 : p.x() < 4 ? 0 : 1);
  const SemanticNet net = net_of(cloud);
  EXPECT_EQ(count(net, EntityLabel::ceiling), 2);
  EXPECT_EQ(count(net, EntityLabel::floor), 2);
  const auto partition = std::find_if(net.entities.begin(), net.entities.end(), [](const ModelEntity& e) {
    return e.label == EntityLabel::wall && std::abs(e.T_map_body.translation().x() - 4) < 0.2 &&
           e.size.x() > 5;
  });
  ASSERT_NE(partition, net.entities.end());
  EXPECT_NEAR(partition->T_map_body.translation().z() + partition->size.z() / 2, 2.6, 0.1);
}

/// The longest wall near x = 4.
ModelEntity partition_of(const SemanticNet& net) {
  ModelEntity longest;
  longest.size.setZero();
  for (const ModelEntity& e : net.entities) {
    if (e.label == EntityLabel::wall && std::abs(e.T_map_body.translation().x() - 4) < 0.4 &&
        std::abs(std::sin(e.T_map_body.yaw())) > 0.9 && e.size.x() > longest.size.x())
      longest = e;
  }
  return longest;
}

/// Two rooms with a wall of this thickness between them, from x = 4 on.
cloud::PointCloud<Map> two_rooms(double thickness) {
  CloudSampler sampler(600, 0.005, 8);
  sampler.room({0, 0}, {4, 5}, 0, 2.7);
  sampler.room({4 + thickness, 0}, {9, 5}, 0, 2.7);
  return sampler.cloud();
}

TEST(SemanticNet, AWallThatIsSeenFromBothSidesIsAsThickAsItIs) {
  for (const double thickness : {0.10, 0.14}) {
    for (const bool placed : {true, false}) {
      cloud::PointCloud<Map> cloud = two_rooms(thickness);
      if (placed) {
        cloud.viewpoints = {{2, 2.5, 1.3}, {6.5, 2.5, 1.3}};
        for (const Eigen::Vector3f& p : cloud.points)
          cloud.scans.push_back(static_cast<double>(p.x()) < 4 + thickness / 2 ? 0 : 1);
      }
      const SemanticNet net = net_of(cloud);
      const ModelEntity wall = partition_of(net);
      EXPECT_NEAR(wall.T_map_body.translation().x(), 4 + thickness / 2, 0.01) << thickness << placed;
      EXPECT_NEAR(wall.size.y(), thickness + 0.04, 0.015) << thickness << placed;
      long unknown = 0;
      for (std::size_t i = 0; i < cloud.size(); ++i)
        unknown += net.labels[i] == static_cast<std::uint8_t>(EntityLabel::unknown);
      EXPECT_LT(unknown, 0.02 * static_cast<double>(cloud.size()));
    }
  }
}

TEST(SemanticNet, WhatStandsBeforeAWallIsNotItsOtherFace) {
  CloudSampler sampler(600, 0.005, 9);
  sampler.room({0, 0}, {4, 5}, 0, 2.7);
  sampler.wall({3.88, 1}, {3.88, 4}, 0, 2.5);
  cloud::PointCloud<Map> cloud = sampler.cloud();
  cloud.viewpoints = {{2, 2.5, 1.3}};
  cloud.scans.assign(cloud.size(), 0);
  EXPECT_LT(partition_of(net_of(cloud)).size.y(), 0.08);
}

/// A room with a hole or a mirror in its wall at x = 4, through which a wall at x = `image` is seen.
SemanticNet room_with_a_wall_behind(double image) {
  CloudSampler sampler(900, 0.005, 10);
  sampler.room({0, 0}, {4, 5}, 0, 2.7);
  sampler.wall({image, 0}, {image, 5}, 0.4, 2.7);
  cloud::PointCloud<Map> cloud;
  for (const Eigen::Vector3f& p : sampler.cloud().points) {
    const bool in_frame =
        std::abs(p.x() - 4) < 0.05F && std::abs(p.y() - 2.5F) < 1 && p.z() > 1 && p.z() < 2.2F;
    if (!in_frame) cloud.points.push_back(p);
  }
  cloud.viewpoints = {{1.5, 2.5, 1.4}};
  cloud.scans.assign(cloud.size(), 0);
  return net_of(cloud);
}

TEST(SemanticNet, AWallThatIsSeenInAMirrorIsNone) {
  const auto walls_behind = [](const SemanticNet& net) {
    return std::count_if(net.entities.begin(), net.entities.end(), [](const ModelEntity& e) {
      return e.label == EntityLabel::wall && e.T_map_body.translation().x() > 6;
    });
  };
  EXPECT_EQ(walls_behind(room_with_a_wall_behind(8)), 0) << "the image of the wall at x = 0";
  EXPECT_GT(walls_behind(room_with_a_wall_behind(7)), 0) << "seen through a window";
}

TEST(SemanticNet, WallsAcrossAMirrorEndAtItsPlane) {
  for (const bool mirror : {true, false}) {
    CloudSampler sampler(900, 0.005, 13);
    sampler.room({0, 0}, {4, 5}, 0, 2.7);
    const double depth = mirror ? 4 : 3;  // m, of what is seen behind the wall at x = 4
    sampler.wall({4 + depth, 1}, {4 + depth, 4}, 0.4, 2.7);
    sampler.wall({4.5, 0}, {4 + depth, 0}, 0.5, 2.5);
    cloud::PointCloud<Map> cloud;
    for (const Eigen::Vector3f& p : sampler.cloud().points) {
      const bool in_frame =
          std::abs(p.x() - 4) < 0.05F && std::abs(p.y() - 2) < 1.4F && p.z() > 0.5F && p.z() < 2.3F;
      if (!in_frame) cloud.points.push_back(p);
    }
    cloud.viewpoints = {{1.5, 3.5, 1.4}};
    cloud.scans.assign(cloud.size(), 0);
    double beyond = 0;
    for (const ModelEntity& e : net_of(cloud).entities) {
      if (e.label == EntityLabel::wall && std::abs(std::cos(e.T_map_body.yaw())) > 0.9)
        beyond = std::max(beyond, e.T_map_body.translation().x() + e.size.x() / 2 - 4);
    }
    if (mirror) {
      EXPECT_LT(beyond, 0.2);
    } else {
      EXPECT_GT(beyond, 1) << "seen through a window";
    }
  }
}

TEST(SemanticNet, WhatHangsOverAStreetHereAndThereIsNoCeiling) {
  CloudSampler sampler(150, 0.01, 7);
  sampler.slab({-15, -10}, {15, 10}, 0);
  for (int i = 0; i < 14; ++i) {
    const double x = 26 * sampler.uniform() - 13, y = 16 * sampler.uniform() - 8;
    sampler.slab({x, y}, {x + 0.9, y + 0.9}, i % 2 == 0 ? 2.4 : 2.6);
  }
  cloud::PointCloud<Map> cloud = sampler.cloud();
  cloud.viewpoints = {{0, 0, 1.7}};
  cloud.scans.assign(cloud.size(), 0);
  EXPECT_EQ(count(net_of(cloud), EntityLabel::ceiling), 0);
}

TEST(SemanticNet, RecognizesAnOpenDoor) {
  // A wall across a hall with an opening 0.9 m wide and 2.0 m high, seen from one side.
  CloudSampler sampler(900, 0.005, 2);
  sampler.room({0, 0}, {8, 4}, 0, 2.7);
  sampler.wall({4, 0}, {4, 1.5}, 0, 2.7);
  sampler.wall({4, 2.4}, {4, 4}, 0, 2.7);
  sampler.wall({4, 1.5}, {4, 2.4}, 2.0, 2.7);
  cloud::PointCloud<Map> cloud = sampler.cloud();
  cloud.viewpoints = {{2, 2, 1.2}};
  // The part hidden by the wall was not measured.
  std::erase_if(cloud.points, [](const Eigen::Vector3f& p) {
    if (p.x() < 4.05F) return false;
    const float s = 2 / (p.x() - 2), y = 2 + s * (p.y() - 2), z = 1.2F + s * (p.z() - 1.2F);
    return y < 1.5F || y > 2.4F || z > 2.0F;
  });
  const SemanticNet net = net_of(cloud);
  ASSERT_EQ(count(net, EntityLabel::door), 1);
  const auto door = std::find_if(net.entities.begin(), net.entities.end(),
                                 [](const ModelEntity& e) { return e.label == EntityLabel::door; });
  // An unseen leaf is drawn open; its hinge gives the closed angle.
  ASSERT_TRUE(door->hinge.has_value());
  const auto centre_at = [&](double angle) -> Eigen::Vector2d {
    const Eigen::Vector2d in_door =
        door->hinge->axis - Eigen::Rotation2Dd(angle).toRotationMatrix() * door->hinge->axis;
    return (door->T_map_body * Eigen::Vector3d(in_door.x(), in_door.y(), 0)).head<2>();
  };
  const Eigen::Vector2d opening(4, 1.95);
  EXPECT_LT((centre_at(door->hinge->closed) - opening).norm(), 0.12);
  EXPECT_NEAR(door->size.x(), 0.9, 0.15);
  EXPECT_NEAR(door->size.z(), 2.0, 0.15);
  EXPECT_EQ(count(net, EntityLabel::wall_above_door), 1);
  EXPECT_TRUE(std::any_of(net.relations.begin(), net.relations.end(), [&](const Relation& r) {
    return r.kind == RelationKind::connected_via_joint && r.from == door->name;
  }));
  EXPECT_FALSE(find_overlap(net.entities));
}

TEST(SemanticNet, FindsStairsOfRandomRises) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    CloudSampler sampler(3000, 0.004, seed);
    const double rise = 0.14 + 0.06 * sampler.uniform(), tread = 0.26 + 0.08 * sampler.uniform();
    sampler.slab({-2, 0}, {0, 1.4}, 0);
    for (int i = 0; i < 5; ++i) {
      sampler.wall({i * tread, 0}, {i * tread, 1.4}, i * rise, (i + 1) * rise);
      sampler.slab({i * tread, 0}, {(i + 1) * tread + (i == 4 ? 1.5 : 0.0), 1.4}, (i + 1) * rise);
    }
    const SemanticNet net = net_of(sampler.cloud());
    ASSERT_EQ(net.stairs.size(), 1U) << "seed " << seed;
    ASSERT_EQ(net.stairs[0].rises.size(), 5U) << "seed " << seed << ", rise " << rise;
    for (const double found : net.stairs[0].rises) EXPECT_NEAR(found, rise, 0.01) << "seed " << seed;
  }
}

TEST(SemanticNet, ClimbsOverRisersWithoutTreads) {
  // From below, the upper treads are not seen.
  constexpr int kSteps = 9, kTreads = 4;
  CloudSampler sampler(2000, 0.004, 5);
  sampler.slab({-2, 0}, {0, 1.4}, 0);
  for (int i = 0; i < kSteps; ++i) {
    sampler.wall({i * 0.28, 0}, {i * 0.28, 1.4}, i * 0.17, (i + 1) * 0.17);
    if (i < kTreads) sampler.slab({i * 0.28, 0}, {(i + 1) * 0.28, 1.4}, (i + 1) * 0.17);
  }
  const SemanticNet net = net_of(sampler.cloud());
  ASSERT_EQ(net.stairs.size(), 1U);
  EXPECT_GE(net.stairs[0].rises.size(), static_cast<std::size_t>(kSteps) - 1);
  for (const double found : net.stairs[0].rises) EXPECT_NEAR(found, 0.17, 0.01);
}

TEST(SemanticNet, TakesLinesOfPointsAcrossARoofForNoStairs) {
  // As a laser with many rings, far away, sees it: each line is as high as a tread and nowhere as deep.
  constexpr int kLines = 7;
  CloudSampler sampler(2000, 0.024, 5);
  sampler.slab({-4, -2}, {0, 4}, 0);
  for (int i = 0; i < kLines; ++i)
    sampler.rectangle({i * 0.28 - 0.03, 0, i * 0.17 + 0.15}, {0.06, 0, 0.036}, {0, 1.9, 0});
  EXPECT_TRUE(net_of(sampler.cloud()).stairs.empty());
}

/// Four steps of `rise` from x = 0, their lowest tread at z = rise.
void paint_steps(CloudSampler& sampler, double rise) {
  for (int i = 0; i < 4; ++i) {
    if (i > 0) sampler.wall({i * 0.3, 0}, {i * 0.3, 1.4}, i * rise, (i + 1) * rise);
    sampler.slab({i * 0.3, 0}, {(i + 1) * 0.3 + (i == 3 ? 1.5 : 0.0), 1.4}, (i + 1) * rise);
  }
}

TEST(SemanticNet, TakesAStripOfGroundForTheBaseOfAFlight) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    CloudSampler sampler(3000, 0.004, seed);
    const double rise = 0.14 + 0.06 * sampler.uniform();
    sampler.slab({-0.05, 0}, {0, 1.4}, 0);
    sampler.wall({0, 0}, {0, 1.4}, 0, rise);
    paint_steps(sampler, rise);
    const SemanticNet net = net_of(sampler.cloud());
    ASSERT_EQ(net.stairs.size(), 1U) << "seed " << seed;
    ASSERT_EQ(net.stairs[0].rises.size(), 4U) << "seed " << seed << ", rise " << rise;
    EXPECT_NEAR(net.stairs[0].rises[0], rise, 0.01) << "seed " << seed;
  }
}

TEST(SemanticNet, AddsNoStepWhereALowWallSupportsAFlight) {
  CloudSampler sampler(3000, 0.004, 3);
  sampler.wall({0, 0}, {0, 1.4}, -0.8, 0.17);
  sampler.slab({-1, 0}, {0, 1.4}, -0.8);
  paint_steps(sampler, 0.17);
  const SemanticNet net = net_of(sampler.cloud());
  ASSERT_EQ(net.stairs.size(), 1U);
  EXPECT_EQ(net.stairs[0].rises.size(), 3U);
}

TEST(SemanticNet, AddsNoStepInARampBeforeAFlight) {
  CloudSampler sampler(3000, 0.004, 3);
  sampler.rectangle({-1.2, 0, -0.6}, {1.2, 0, 0.77}, {0, 1.4, 0});
  paint_steps(sampler, 0.17);
  const SemanticNet net = net_of(sampler.cloud());
  ASSERT_EQ(net.stairs.size(), 1U);
  EXPECT_EQ(net.stairs[0].rises.size(), 3U);
}

TEST(SemanticNet, EndsAWallAtACoplanarRiser) {
  CloudSampler sampler(3000, 0.004, 5);
  sampler.slab({-2, 0}, {0, 3.4}, 0);
  sampler.slab({0, 1.4}, {0.6, 3.4}, 0);
  sampler.wall({0, 0}, {0, 1.4}, 0, 0.17);
  paint_steps(sampler, 0.17);
  sampler.wall({0.6, 1.4}, {0.6, 3.4}, 0, 2);
  sampler.wall({0.6, 0}, {0.6, 1.4}, 0.34, 0.51);
  const SemanticNet net = net_of(sampler.cloud());
  ASSERT_EQ(net.stairs.size(), 1U);
  int walls = 0;
  for (const ModelEntity& e : net.entities) {
    if (e.label != EntityLabel::wall) continue;
    const double half = e.size.x() / 2, y = e.T_map_body.translation().y();
    EXPECT_NEAR(y - half, 1.4, 0.1) << e.name;
    EXPECT_NEAR(y + half, 3.4, 0.1) << e.name;
    ++walls;
  }
  EXPECT_EQ(walls, 1);
}

TEST(SemanticNet, TakesNoTableForAFloor) {
  CloudSampler sampler(900, 0.005, 4);
  sampler.room({0, 0}, {6, 4}, 0, 2.6);
  sampler.slab({1, 1}, {3, 2}, 0.74);
  sampler.slab({3.5, 2.5}, {5, 3.3}, 0.72);
  const SemanticNet net = net_of(sampler.cloud());
  for (const ModelEntity& e : net.entities) {
    if (e.label != EntityLabel::floor) continue;
    EXPECT_LT(e.T_map_body.translation().z(), 0.1) << e.name;
  }
  EXPECT_EQ(net.stairs.size(), 0U);
}

TEST(SemanticNet, FindsTheWallBehindACounter) {
  CloudSampler sampler(2500, 0.004, 6);
  sampler.slab({0, 0}, {4, 2.4}, 0);
  sampler.wall({0, 2.4}, {2.6, 2.4}, 0, 0.9);  // the front, and the top that it carries
  sampler.slab({0, 2.4}, {2.6, 3}, 0.9);
  sampler.wall({0, 3}, {2.6, 3}, 0.9, 1.7);  // the visible part of the wall behind; no ceiling
  sampler.wall({2.6, 3}, {4, 3}, 0, 1.7);
  sampler.wall({0, 0}, {0, 3}, 0, 1.7);
  const SemanticNet net = net_of(sampler.cloud());
  bool behind = false;
  for (const ModelEntity& e : net.entities) {
    if (e.label != EntityLabel::wall || std::abs(std::sin(e.T_map_body.yaw())) > 0.1) continue;
    EXPECT_GT(std::abs(e.T_map_body.translation().y() - 2.4), 0.1) << e.name << " is the counter's front";
    behind = behind || std::abs(e.T_map_body.translation().y() - 3) < 0.05;
  }
  EXPECT_TRUE(behind);
}

TEST(SemanticNet, RefusesASegmentationOfAnotherCloud) {
  CloudSampler sampler(300, 0.005, 1);
  sampler.room({0, 0}, {5, 4}, 0, 2.7);
  const Segmentation wrong;
  EXPECT_THAT(label_entities(sampler.cloud(), wrong).error().message, HasSubstr("points"));
  EXPECT_FALSE(label_entities({}, wrong).ok());
}

TEST(SemanticNet, IsWrittenAsAGraph) {
  CloudSampler sampler(600, 0.005, 1);
  sampler.room({0, 0}, {5, 4}, 0, 2.7);
  SemanticNet net = net_of(sampler.cloud());
  net.entities[0].name = "the \"big\" floor";
  const std::string dot = net_to_dot(net);
  EXPECT_THAT(dot, testing::StartsWith("digraph"));
  EXPECT_THAT(dot, HasSubstr("\"the \\\"big\\\" floor\""));
  EXPECT_THAT(dot, HasSubstr("[label=\"wall 1\\nwall"));
  EXPECT_THAT(dot, HasSubstr("dir=none"));
  std::size_t edges = 0;
  for (std::size_t at = dot.find(" -> "); at != std::string::npos; at = dot.find(" -> ", at + 1)) ++edges;
  EXPECT_EQ(edges, net.relations.size());

  const auto folder = std::filesystem::temp_directory_path() / "parhelion_net_graph";
  ASSERT_TRUE(write_net(net, folder.string()).ok());
  EXPECT_GT(std::filesystem::file_size(folder / "net.png"), 10'000U);
  EXPECT_EQ(std::filesystem::file_size(folder / "net.dot"), dot.size());
  std::filesystem::remove_all(folder);
  EXPECT_FALSE(write_net(net, "/proc/nowhere").ok());
  EXPECT_FALSE(write_net({}, folder.string()).ok());
}

}  // namespace
}  // namespace parhelion::semantic
