// Things that look like parts of a building, and parts of a building that look like things.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <tuple>

#include "fusion/semantic/net/semantic_net.hpp"
#include "tests/fusion/semantic/clouds.hpp"

namespace parhelion::semantic {
namespace {

using test::CloudSampler;

SemanticNet labelled(const cloud::PointCloud<Map>& cloud) {
  const auto surfaces = segment(cloud);
  if (!surfaces) throw std::runtime_error(surfaces.error().message);
  auto net = label_entities(cloud, *surfaces);
  if (!net) throw std::runtime_error(net.error().message);
  return *net;
}

/// Fraction of the points within a box that have a label.
double fraction(const cloud::PointCloud<Map>& cloud, const SemanticNet& net, EntityLabel label,
                const Eigen::AlignedBox3d& box) {
  double in = 0, of_label = 0;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (!box.contains(cloud.points[i].cast<double>())) continue;
    ++in;
    of_label += net.labels[i] == static_cast<std::uint8_t>(label) ? 1 : 0;
  }
  return in > 0 ? of_label / in : 0;
}

/// m, of walls whose middle lies in a rectangle of the plan.
double wall_length(const SemanticNet& net, const Eigen::AlignedBox2d& plan) {
  double length = 0;
  for (const ModelEntity& e : net.entities) {
    if (e.label == EntityLabel::wall && plan.contains(e.T_map_body.translation().head<2>().eval()))
      length += e.size.x();
  }
  return length;
}

/// Points on the upper side of an ellipsoid that lies on the floor; under it there are none.
void lay_ellipsoid(cloud::PointCloud<Map>& cloud, const Eigen::Vector2d& at, const Eigen::Vector3d& radii) {
  std::erase_if(cloud.points, [&](const Eigen::Vector3f& p) {
    const Eigen::Vector2d d = (p.head<2>().cast<double>() - at).cwiseQuotient(radii.head<2>());
    return p.z() < 0.03F && d.norm() < 1;
  });
  CloudSampler sampler(1, 0.003, 21);
  for (int i = 0; i < 3000; ++i) {
    const double z = 1.4 * sampler.uniform() - 0.4, yaw = 2 * std::numbers::pi * sampler.uniform();
    const double r = std::sqrt(1 - z * z);
    const Eigen::Vector3d p = Eigen::Vector3d(at.x(), at.y(), radii.z()) +
                              Eigen::Vector3d(r * std::cos(yaw), r * std::sin(yaw), z).cwiseProduct(radii);
    cloud.points.push_back((p + 0.003 * sampler.gaussian() * Eigen::Vector3d::UnitZ()).cast<float>());
  }
}

// The flanks of a body are round: beside its upper side it goes down step by step. One lies under a table.
TEST(BuildingOrThing, ABodyOnTheFloorIsNoFloor) {
  CloudSampler sampler(900, 0.003, 20);
  sampler.room({0, 0}, {6, 5}, 0, 2.6);
  sampler.slab({3.6, 3.1}, {5.2, 3.9}, 0.74);
  cloud::PointCloud<Map> cloud = sampler.cloud();
  lay_ellipsoid(cloud, {2.2, 1.3}, {0.9, 0.3, 0.07});
  lay_ellipsoid(cloud, {4.4, 3.5}, {0.6, 0.25, 0.07});
  lay_ellipsoid(cloud, {1.5, 3.5}, {0.4, 0.2, 0.07});
  const SemanticNet net = labelled(cloud);
  const Eigen::AlignedBox3d upper(Eigen::Vector3d(1, 0.8, 0.1), Eigen::Vector3d(5.5, 4.2, 0.3));
  EXPECT_LT(fraction(cloud, net, EntityLabel::floor, upper), 0.05);
  const Eigen::AlignedBox3d beside(Eigen::Vector3d(0.2, 0.2, -0.02), Eigen::Vector3d(0.8, 4.8, 0.02));
  EXPECT_GT(fraction(cloud, net, EntityLabel::floor, beside), 0.9);
}

// Through a wide window a scanner sees more ground than its room has floor.
TEST(BuildingOrThing, AFloorOverWiderGroundOutsideIsAFloor) {
  for (const double ground : {-0.3, -0.6}) {
    CloudSampler sampler(250, 0.004, 22);
    sampler.room({0, 0}, {7, 5}, 0, 2.8);
    sampler.slab({-4, -14}, {11, -0.3}, ground);
    cloud::PointCloud<Map> cloud = sampler.cloud();
    std::erase_if(cloud.points, [](const Eigen::Vector3f& p) {
      return p.y() < 0.1F && p.y() > -0.1F && p.x() > 1 && p.x() < 6 && p.z() > 0.1F && p.z() < 2.5F;
    });
    const SemanticNet net = labelled(cloud);
    EXPECT_GT(fraction(cloud, net, EntityLabel::floor,
                       {Eigen::Vector3d(0.2, 0.2, -0.02), Eigen::Vector3d(6.8, 4.8, 0.02)}),
              0.9)
        << ground;
  }
}

TEST(BuildingOrThing, ARowOfLockersUnderTheCeilingIsNoWall) {
  CloudSampler sampler(500, 0.004, 23);
  sampler.room({0, 0}, {8, 6}, 0, 2.8);
  for (const double x : {2.5, 5.0}) {
    sampler.wall({x, 1}, {x, 5}, 0, 1.85);
    sampler.wall({x + 0.5, 1}, {x + 0.5, 5}, 0, 1.85);
    sampler.wall({x, 1}, {x + 0.5, 1}, 0, 1.85);
    sampler.wall({x, 5}, {x + 0.5, 5}, 0, 1.85);
  }
  cloud::PointCloud<Map> cloud = sampler.cloud();
  std::erase_if(cloud.points, [](const Eigen::Vector3f& p) {
    const float in_row = std::abs(p.x() - (p.x() < 4 ? 2.75F : 5.25F));
    return p.z() < 0.1F && in_row < 0.24F && p.y() > 1 && p.y() < 5;
  });
  const SemanticNet net = labelled(cloud);
  EXPECT_EQ(wall_length(net, {Eigen::Vector2d(1, 0.5), Eigen::Vector2d(7, 5.5)}), 0);
  EXPECT_GT(wall_length(net, {Eigen::Vector2d(-1, -1), Eigen::Vector2d(9, 7)}), 26);
}

TEST(BuildingOrThing, ARowOfLockersAlongAWholeWallIsNoWall) {
  CloudSampler sampler(500, 0.004, 27);
  sampler.room({0, 0}, {8, 6}, 0, 2.8);
  sampler.wall({7.4, 0.2}, {7.4, 5.8}, 0, 1.85);
  cloud::PointCloud<Map> cloud = sampler.cloud();
  std::erase_if(cloud.points, [](const Eigen::Vector3f& p) {
    return p.x() > 7.42F && p.y() > 0.2F && p.y() < 5.8F && p.z() < 1.8F;
  });
  const SemanticNet net = labelled(cloud);
  EXPECT_EQ(wall_length(net, {Eigen::Vector2d(7, 0.5), Eigen::Vector2d(7.7, 5.5)}), 0);
  EXPECT_GT(wall_length(net, {Eigen::Vector2d(7.8, 0.5), Eigen::Vector2d(8.2, 5.5)}), 5);
}

// Seen from both sides, it hides nothing of the floor under it.
TEST(BuildingOrThing, WhatHangsOverTheFloorIsNoWall) {
  for (const double foot : {0.4, 2.0}) {
    CloudSampler sampler(500, 0.004, 28);
    sampler.room({0, 0}, {8, 6}, 0, 2.6);
    for (const double y : {3.0, 3.05}) sampler.wall({0.1, y}, {7.9, y}, foot, 2.55);
    for (const double x : {2.6, 5.2}) sampler.wall({x, 3.02}, {x + 0.3, 3.02}, 0, 2.55);
    const SemanticNet net = labelled(sampler.cloud());
    EXPECT_EQ(wall_length(net, {Eigen::Vector2d(1, 2), Eigen::Vector2d(7, 4)}), 0) << foot;
  }
}

// The ramp joins both decks without a step.
TEST(BuildingOrThing, FloorsAtBothEndsOfARampAreFloors) {
  CloudSampler sampler(500, 0.004, 29);
  sampler.slab({0, 0}, {10, 10}, 0);
  sampler.slab({16, 0}, {26, 10}, 1.4);
  sampler.rectangle({10, 0, 0}, {6, 0, 1.4}, {0, 4, 0});
  sampler.slab({0, 0}, {26, 10}, 4.0);
  for (const double y : {0.0, 10.0}) {
    sampler.wall({0, y}, {16, y}, 0, 4.0);
    sampler.wall({16, y}, {26, y}, 1.4, 4.0);
  }
  sampler.wall({0, 0}, {0, 10}, 0, 4.0);
  sampler.wall({26, 0}, {26, 10}, 1.4, 4.0);
  sampler.wall({16, 4}, {16, 10}, 0, 1.4);
  sampler.slab({10, 4}, {16, 10}, 0);
  const cloud::PointCloud<Map> cloud = sampler.cloud();
  const SemanticNet net = labelled(cloud);
  for (const auto& [low, high, z] : {std::tuple{0.5, 9.5, 0.0}, {16.5, 25.5, 1.4}}) {
    const Eigen::AlignedBox3d deck(Eigen::Vector3d(low, 0.5, z - 0.02), Eigen::Vector3d(high, 9.5, z + 0.02));
    EXPECT_GT(fraction(cloud, net, EntityLabel::floor, deck), 0.9) << z;
  }
}

long pillars_in(const SemanticNet& net, const Eigen::AlignedBox2d& plan) {
  return std::count_if(net.entities.begin(), net.entities.end(), [&](const ModelEntity& e) {
    return e.label == EntityLabel::pillar && plan.contains(e.T_map_body.translation().head<2>().eval());
  });
}

void add_post(CloudSampler& sampler, const Eigen::Vector2d& at, double side, double low, double high) {
  const Eigen::Vector2d a = at.array() - side / 2, c = at.array() + side / 2, b(c.x(), a.y()),
                        d(a.x(), c.y());
  for (const auto& [from, to] : {std::pair{a, b}, {b, c}, {c, d}, {d, a}}) sampler.wall(from, to, low, high);
}

TEST(BuildingOrThing, PillarsStandOnEachFloorAndCarryACeiling) {
  CloudSampler sampler(500, 0.004, 30);
  sampler.room({0, 0}, {12, 10}, 0, 4);
  sampler.slab({12.2, 0}, {20, 10}, 1.4);
  sampler.slab({12.2, 0}, {20, 10}, 4);
  sampler.wall({12.2, 0}, {20, 0}, 1.4, 4);
  sampler.wall({12.2, 10}, {20, 10}, 1.4, 4);
  sampler.wall({20, 0}, {20, 10}, 1.4, 4);
  add_post(sampler, {4, 5}, 0.35, 0, 4);
  add_post(sampler, {8, 5}, 0.12, 0, 2.6);  // a mast
  add_post(sampler, {16, 5}, 0.35, 1.4, 4);
  const SemanticNet net = labelled(sampler.cloud());
  EXPECT_EQ(pillars_in(net, {Eigen::Vector2d(3.5, 4.5), Eigen::Vector2d(4.5, 5.5)}), 1);
  EXPECT_EQ(pillars_in(net, {Eigen::Vector2d(7.5, 4.5), Eigen::Vector2d(8.5, 5.5)}), 0);
  EXPECT_EQ(pillars_in(net, {Eigen::Vector2d(15.5, 4.5), Eigen::Vector2d(16.5, 5.5)}), 1);
}

TEST(BuildingOrThing, AThinPartitionAndAThickWallStayWalls) {
  CloudSampler sampler(500, 0.004, 24);
  sampler.slab({0, 0}, {8, 6}, 0);
  for (const auto& [from, to] : {std::pair{0.0, 3.0}, {3.4, 8.0}}) sampler.slab({from, 0}, {to, 6}, 2.8);
  sampler.wall({0, 0}, {8, 0}, 0, 2.8);
  sampler.wall({0, 6}, {8, 6}, 0, 2.8);
  sampler.wall({0, 0}, {0, 6}, 0, 2.8);
  sampler.wall({8, 0}, {8, 6}, 0, 2.8);
  for (const double x : {3.0, 3.4}) sampler.wall({x, 0}, {x, 6}, 0, 2.3);  // its upper end was not seen
  for (const double x : {6.0, 6.12}) sampler.wall({x, 0}, {x, 6}, 0, 2.1);
  const SemanticNet net = labelled(sampler.cloud());
  EXPECT_GT(wall_length(net, {Eigen::Vector2d(2.8, 1), Eigen::Vector2d(3.6, 5)}), 5);
  EXPECT_GT(wall_length(net, {Eigen::Vector2d(5.8, 1), Eigen::Vector2d(6.3, 5)}), 5);
}

// Each face of the pillar joins a longer one, but none joins a wall.
TEST(BuildingOrThing, FacesOfAPillarAreNoWalls) {
  CloudSampler sampler(900, 0.004, 31);
  sampler.room({0, 0}, {9, 7}, 0, 3);
  for (const auto& [from, to] : {std::pair<Eigen::Vector2d, Eigen::Vector2d>({4, 3}, {4.72, 3}),
                                 {{4.72, 3}, {4.72, 3.6}},
                                 {{4.72, 3.6}, {4, 3.6}},
                                 {{4, 3.6}, {4, 3}}})
    sampler.wall(from, to, 0, 3);
  const SemanticNet net = labelled(sampler.cloud());
  EXPECT_EQ(wall_length(net, {Eigen::Vector2d(3, 2), Eigen::Vector2d(6, 5)}), 0);
  EXPECT_GT(wall_length(net, {Eigen::Vector2d(-1, -1), Eigen::Vector2d(10, 8)}), 30);
}

TEST(BuildingOrThing, WhatEndsUnderTheCeilingIsAWallOnlyWhereItJoinsOne) {
  for (const bool joined : {false, true}) {
    CloudSampler sampler(500, 0.004, 32);
    sampler.room({0, 0}, {10, 8}, 0, 3.2);
    sampler.wall({5, joined ? 0 : 2}, {5, 5}, 0, 2.4);
    const SemanticNet net = labelled(sampler.cloud());
    const double length = wall_length(net, {Eigen::Vector2d(4, 1), Eigen::Vector2d(6, 6)});
    EXPECT_EQ(length > 0, joined) << length;
  }
}

// The pillar reaches the ceiling in the plane of the shelf's front.
TEST(BuildingOrThing, AShelfInLineWithAPillarIsNoWall) {
  CloudSampler sampler(500, 0.004, 35);
  sampler.room({0, 0}, {10, 8}, 0, 3.2);
  sampler.wall({5, 2}, {5, 5}, 0, 2.3);
  add_post(sampler, {5.2, 5.2}, 0.4, 0, 3.2);
  const SemanticNet net = labelled(sampler.cloud());
  EXPECT_EQ(wall_length(net, {Eigen::Vector2d(4, 1), Eigen::Vector2d(6, 6)}), 0);
}

// Boards of shelves are seen from below, and the ceiling over them was measured, too.
TEST(BuildingOrThing, BoardsOfShelvesAreNoCeiling) {
  CloudSampler sampler(500, 0.004, 33);
  sampler.room({0, 0}, {14, 9}, 0, 3.9);
  for (const double x : {3.0, 6.0, 9.0}) {
    sampler.slab({x, 2}, {x + 0.9, 7}, 2.05);
    sampler.wall({x + 0.45, 2}, {x + 0.45, 7}, 0, 2.05);
  }
  cloud::PointCloud<Map> cloud = sampler.cloud();
  for (const double x : {1.5, 5.0, 8.0, 12.0}) cloud.viewpoints.emplace_back(x, 4.5, 1.5);
  for (const Eigen::Vector3f& p : cloud.points)
    cloud.scans.push_back(p.x() < 3.2F ? 0 : p.x() < 6.4F ? 1 : p.x() < 9.4F ? 2 : 3);
  const SemanticNet net = labelled(cloud);
  int ceilings = 0;
  for (const ModelEntity& e : net.entities) {
    if (e.label == EntityLabel::ceiling) {
      ++ceilings;
      EXPECT_GT(e.T_map_body.translation().z(), 3) << e.name;
    }
  }
  EXPECT_GE(ceilings, 1);
}

// Without viewpoints, the slices of a sloped roof and the beams under it are level, and nothing is under
// them.
TEST(BuildingOrThing, BeamsAndSlicesOfASlopedRoofAreNoFloors) {
  CloudSampler sampler(700, 0.004, 34);
  constexpr double kLong = 11, kWide = 8, kKnee = 1, kRidge = 4;
  sampler.slab({0, 0}, {kLong, kWide}, 0);
  for (const double y : {0.0, kWide}) {
    sampler.wall({0, y}, {kLong, y}, 0, kKnee);
    sampler.rectangle({0, y, kKnee}, {kLong, 0, 0}, {0, kWide / 2 - y, kRidge - kKnee});
  }
  for (const double x : {0.0, kLong}) {
    for (double y = 0; y < kWide / 2; y += 0.1) {
      const double top = kKnee + (kRidge - kKnee) * y / (kWide / 2);
      sampler.wall({x, y}, {x, y + 0.1}, 0, top);
      sampler.wall({x, kWide - y}, {x, kWide - y - 0.1}, 0, top);
    }
  }
  for (double x = 1; x < kLong; x += 2) {
    for (const double z : {2.35, 2.5}) sampler.slab({x, 2}, {x + 0.14, 6}, z);
  }
  const SemanticNet net = labelled(sampler.cloud());
  double floors = 0;
  for (const ModelEntity& e : net.entities) {
    if (e.label != EntityLabel::floor) continue;
    EXPECT_LT(e.T_map_body.translation().z(), 0.1) << e.name;
    floors += e.size.head<2>().prod();
  }
  EXPECT_GT(floors, 80);
}

long steps(const SemanticNet& net) {
  return std::count_if(net.entities.begin(), net.entities.end(),
                       [](const ModelEntity& e) { return e.label == EntityLabel::stairs; });
}

/// Four even treads of 0.3 m, the lowest `foot` m over the floor of a room; with risers where `risers`.
CloudSampler four_treads(double foot, bool risers) {
  CloudSampler sampler(700, 0.003, 25);
  sampler.room({0, 0}, {7, 5}, 0, 3);
  for (int i = 0; i < 4; ++i) {
    const double x = 3 + 0.3 * i, z = foot + 0.17 * i;
    sampler.slab({x, 1.5}, {x + 0.3, 3}, z);
    if (risers) sampler.wall({x, 1.5}, {x, 3}, i == 0 ? 0 : z - 0.17, z);
  }
  sampler.slab({4.2, 1.5}, {5.2, 3}, foot + 0.17 * 4);
  if (risers) sampler.wall({4.2, 1.5}, {4.2, 3}, foot + 0.17 * 3, foot + 0.17 * 4);
  return sampler;
}

TEST(BuildingOrThing, AFlightBeginsOnAFloor) {
  EXPECT_GE(steps(labelled(four_treads(0.17, true).cloud())), 4);
  EXPECT_EQ(steps(labelled(four_treads(0.9, false).cloud())), 0) << "boards over a floor that was measured";
}

/// Four level plates 1 m deep, each 0.12 m over the one before, the lowest `foot` m over the floor, which is
/// hidden under and before them.
cloud::PointCloud<Map> four_terraces(double foot) {
  CloudSampler sampler(700, 0.003, 26);
  sampler.room({0, 0}, {9, 5}, 0, 3);
  cloud::PointCloud<Map> cloud = sampler.cloud();
  std::erase_if(cloud.points, [](const Eigen::Vector3f& p) {
    return p.z() < 0.05F && p.y() > 1.3F && p.y() < 3.2F && p.x() > 0.3F && p.x() < 8.5F;
  });
  CloudSampler plates(700, 0.003, 27);
  for (int i = 0; i < 4; ++i) {
    const double x = 3 + 1.1 * i, z = foot + 0.12 * i;
    plates.slab({x, 1.5}, {x + 1, 3}, z);
    plates.wall({x, 1.5}, {x, 3}, z - 0.12, z);
  }
  cloud.points.insert(cloud.points.end(), plates.cloud().points.begin(), plates.cloud().points.end());
  return cloud;
}

TEST(BuildingOrThing, BoxesInARackAreNoFlight) {
  EXPECT_GE(steps(labelled(four_terraces(0.12))), 3) << "terraces that begin on the floor";
  EXPECT_EQ(steps(labelled(four_terraces(1.0))), 0);
}

TEST(BuildingOrThing, StepsHaveHeadroom) {
  CloudSampler sampler = four_treads(0.17, true);
  for (int i = 0; i < 5; ++i) sampler.slab({3 + 0.3 * i, 1.5}, {3.3 + 0.3 * i, 3}, 0.6 + 0.17 * i);
  EXPECT_LE(steps(labelled(sampler.cloud())), 5) << "of two flights that lie over each other one is left";
}

// The straight wall is longer than each facet, but not than the whole arc.
TEST(BuildingOrThing, AStraightWallThatGoesOnAsARoundOneStays) {
  CloudSampler sampler(600, 0.004, 26);
  constexpr double kRadius = 3.5;
  sampler.slab({0, 0}, {8, 7}, 0);
  sampler.slab({0, 0}, {8, 7}, 2.8);
  sampler.wall({0, 0}, {8 - kRadius, 0}, 0, 2.8);
  sampler.wall({8, kRadius}, {8, 7}, 0, 2.8);
  sampler.wall({8, 7}, {0, 7}, 0, 2.8);
  sampler.wall({0, 7}, {0, 0}, 0, 2.8);
  const auto at = [&](int k) {
    const double angle = std::numbers::pi / 2 * (k / 60.0 - 1);
    return Eigen::Vector2d(8 - kRadius + kRadius * std::cos(angle), kRadius + kRadius * std::sin(angle));
  };
  for (int k = 0; k < 60; ++k) sampler.wall(at(k), at(k + 1), 0, 2.8);
  const SemanticNet net = labelled(sampler.cloud());
  EXPECT_GT(wall_length(net, {Eigen::Vector2d(1, -0.2), Eigen::Vector2d(4, 0.2)}), 3.5);
  EXPECT_GT(wall_length(net, {Eigen::Vector2d(7.8, 4), Eigen::Vector2d(8.2, 6)}), 2.5);
}

}  // namespace
}  // namespace parhelion::semantic
