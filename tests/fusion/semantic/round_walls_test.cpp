// Round walls: arcs where walls are round, and none where they are straight, however many of them meet.
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "fusion/semantic/build_model.hpp"
#include "fusion/semantic/segmentation/plan_arcs.hpp"
#include "tests/fusion/semantic/clouds.hpp"
#include "tests/synthetic_site.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kNearArc = 0.05, kMinLength = 0.4, kPixel = 10.0 / 512;

struct Plan {
  std::vector<Eigen::Vector3f> evidence;
  std::mt19937 random{3};

  void add(const Eigen::Vector2d& p, double noise) {
    std::normal_distribution<double> error(0, noise);
    evidence.emplace_back(static_cast<float>(p.x() + error(random)),
                          static_cast<float>(p.y() + error(random)), 20.F);
  }
  void straight(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double noise = 0.006) {
    for (double s = 0; s < (b - a).norm(); s += kPixel) add(a + s * (b - a).normalized(), noise);
  }
  void round(const Eigen::Vector2d& centre, double radius, double from, double to, double noise = 0.006) {
    for (double s = from * radius; s < to * radius; s += kPixel)
      add(centre + radius * Eigen::Vector2d(std::cos(s / radius), std::sin(s / radius)), noise);
  }
  void polygon(int sides, double side) {
    const double radius = side / (2 * std::sin(std::numbers::pi / sides));
    const auto corner = [&](int i) {
      const double angle = 2 * std::numbers::pi * i / sides + 0.1;
      return Eigen::Vector2d(radius * std::cos(angle), radius * std::sin(angle));
    };
    for (int i = 0; i < sides; ++i) straight(corner(i), corner(i + 1));
  }

  /// Like `find_verticals`: chords of the drawn points, each from separate evidence.
  std::vector<PlanLine> lines(LineRefiner& refiner) const {
    std::vector<PlanLine> found;
    for (std::size_t i = 0; i + 30 < evidence.size(); i += 15) {
      const Eigen::Vector2d a = evidence[i].head<2>().cast<double>(),
                            b = evidence[i + 30].head<2>().cast<double>();
      const double half = (b - a).norm() / 2;
      if (half > 0.5) continue;
      auto line = refiner.refine({(a + b) / 2, (b - a).normalized(), -half, half, 0});
      if (!line) continue;
      refiner.claim(*line);
      found.push_back(*line);
    }
    return found;
  }

  struct Found {
    std::vector<PlanArc> arcs;
    std::size_t lines_before = 0, lines_left = 0;
  };
  Found find() const {
    LineRefiner refiner(evidence, kPixel, kNearArc, kMinLength);
    std::vector<PlanLine> left = lines(refiner);
    Found found;
    found.lines_before = left.size();
    found.arcs = find_arcs(refiner.evidence(), kNearArc, kMinLength, left);
    found.lines_left = left.size();
    return found;
  }
};

TEST(RoundWalls, AnArcIsFoundWithItsRadius) {
  for (const double radius : {1.5, 4.0, 9.0, 25.0}) {
    Plan plan;
    plan.round({3, -2}, radius, 0.4, 0.4 + std::min(4.0, 9 / radius));
    const Plan::Found found = plan.find();
    ASSERT_EQ(found.arcs.size(), 1U) << radius << " m, of " << found.lines_before << " lines";
    EXPECT_NEAR(found.arcs[0].radius, radius, 0.02 * radius);
    EXPECT_NEAR(found.arcs[0].high - found.arcs[0].low, std::min(4.0 * radius, 9.0), 0.2);
    EXPECT_EQ(found.lines_left, 0U) << radius;
    for (const Eigen::Vector2d& corner : corners_of(found.arcs[0], kNearArc))
      EXPECT_NEAR((corner - Eigen::Vector2d(3, -2)).norm(), radius, 0.03);
  }
}

// A room that rapidcheck found: an arc through the wall and the few points beside it explains nearly as much.
TEST(RoundWalls, AWallBesideScatteredPointsIsNone) {
  const double floor = -1.81, ceiling = 0.66;
  test::CloudSampler sampler(626, 0.002, 201538422757);
  sampler.room({0, 0}, {3.5, 5.4}, floor, ceiling);
  sampler.wall({1.05, 0}, {1.05, 3.78}, floor, ceiling);
  sampler.clutter({Eigen::Vector3d(0.3, 0.3, floor), Eigen::Vector3d(1.3, 1.3, floor + 0.8)}, 532);
  sampler.clutter({Eigen::Vector3d(-40, -40, -20), Eigen::Vector3d(40, 40, 20)}, 10);
  sampler.turn(Eigen::Translation3d(-29.48, -11.47, 0) *
               Eigen::AngleAxisd(-33 * std::numbers::pi / 180, Eigen::Vector3d::UnitZ()));
  const auto found = segment(sampler.cloud());
  ASSERT_TRUE(found.ok());
  ASSERT_GE(found->verticals.size(), 5U);
  for (const VerticalSurface& wall : found->verticals) EXPECT_EQ(wall.curve, kNoCurve);
}

TEST(RoundWalls, ARoomWithCutCornersHasStraightWalls) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> longer(5.5, 9), turn(0, 1.5);
  for (unsigned seed = 0; seed < 6; ++seed) {
    const double a = longer(random), b = longer(random), cut = 2;
    const std::vector<Eigen::Vector2d> corners{{cut, 0},     {a - cut, 0}, {a, cut},     {a, b - cut},
                                               {a - cut, b}, {cut, b},     {0, b - cut}, {0, cut}};
    test::CloudSampler sampler(400, 0.004, 40 + seed);
    sampler.slab({0, 0}, {a, b}, 0);
    sampler.slab({0, 0}, {a, b}, 2.8);
    for (std::size_t i = 0; i < corners.size(); ++i)
      sampler.wall(corners[i], corners[(i + 1) % corners.size()], 0, 2.8);
    sampler.turn(Eigen::Isometry3d(Eigen::AngleAxisd(turn(random), Eigen::Vector3d::UnitZ())));
    const auto found = segment(sampler.cloud());
    ASSERT_TRUE(found.ok());
    EXPECT_EQ(found->verticals.size(), corners.size()) << a << " x " << b << " m";
    for (const VerticalSurface& wall : found->verticals) EXPECT_EQ(wall.curve, kNoCurve);
  }
}

TEST(RoundWalls, MisalignedScanLayersGiveOneWall) {
  Plan plan;
  plan.round({0, 0}, 9, 0.2, 0.9);
  plan.round({0.02, 0.03}, 9.08, 0.5, 1.2);
  plan.round({0, -0.02}, 8.92, 0.4, 1.3);
  const Plan::Found found = plan.find();
  ASSERT_EQ(found.arcs.size(), 1U);
  EXPECT_NEAR(found.arcs[0].radius, 9, 0.6);
  EXPECT_GT(found.lines_before, 5U);
  EXPECT_LE(found.lines_left, 1U) << "0.2 m off the arc in its middle";
}

TEST(RoundWalls, StraightWallsStayStraightAtAnyCorner) {
  const std::vector<std::pair<int, double>> polygons{{4, 5.0}, {6, 3.0}, {8, 2.0}, {8, 1.0}, {12, 1.5}};
  for (const auto& [sides, side] : polygons) {
    Plan plan;
    plan.polygon(sides, side);
    const Plan::Found found = plan.find();
    EXPECT_TRUE(found.arcs.empty()) << sides << " sides of " << side << " m";
    EXPECT_GE(found.lines_left, static_cast<std::size_t>(sides));
  }
  for (const double turn : {0.1, 0.2, 0.5}) {
    Plan plan;
    plan.straight({-4, 0}, {0, 0});
    plan.straight({0, 0}, {4 * std::cos(turn), 4 * std::sin(turn)});
    EXPECT_TRUE(plan.find().arcs.empty()) << turn << " rad";
  }
}

TEST(RoundWalls, ARoundCornerKeepsItsStraightWalls) {
  Plan plan;
  plan.straight({-5, 0}, {0, 0});
  plan.round({0, 2}, 2, -std::numbers::pi / 2, 0);
  plan.straight({2, 2}, {2, 7});
  const Plan::Found found = plan.find();
  ASSERT_EQ(found.arcs.size(), 1U);
  EXPECT_NEAR(found.arcs[0].radius, 2, 0.25);
  EXPECT_GE(found.lines_left, 2U);
}

constexpr double kRadius = 5, kWallHeight = 3;

/// A hall of `kRadius` with 90 flat pieces around it, and a doorway of 1 m at angle 0.
SemanticModel round_hall() {
  SemanticModel site;
  site.entities = {
      test::model_box("floor", EntityLabel::floor, {0, 0, -0.1}, {10.6, 10.6, 0.2}),
      test::model_box("ceiling", EntityLabel::ceiling, {0, 0, kWallHeight + 0.1}, {10.6, 10.6, 0.2})};
  constexpr int pieces = 90;
  const double length = 2 * (kRadius + 0.2) * std::tan(std::numbers::pi / pieces);
  for (int i = 0; i < pieces; ++i) {
    const double angle = 2 * std::numbers::pi * i / pieces;
    if (std::abs(std::remainder(angle, 2 * std::numbers::pi)) < 0.1) continue;
    const Eigen::Vector2d p = (kRadius + 0.1) * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    site.entities.push_back(test::model_box("wall", EntityLabel::wall, {p.x(), p.y(), kWallHeight / 2},
                                            {length, 0.2, kWallHeight}, angle + std::numbers::pi / 2));
  }
  return site;
}

TEST(RoundWalls, ARoundHallBecomesAClosedRingOfFacets) {
  const cloud::PointCloud<Cloud> cloud = test::scan_of(round_hall(), {{0.5, 0.3, 1.4}, {-2, 1, 1.4}}, 0.0175);
  const auto built = build_model(cloud, {});
  ASSERT_TRUE(built) << built.error().message;
  double length = 0;
  std::vector<Eigen::Vector2d> ends;
  for (const ModelEntity& e : built->model.entities) {
    if (e.label != EntityLabel::wall) continue;
    // The cloud's frame is that of the first scanner.
    const Eigen::Vector2d along = e.T_map_body.rotation().col(0).head<2>();
    const Eigen::Vector2d middle = e.T_map_body.translation().head<2>() + Eigen::Vector2d(0.5, 0.3);
    EXPECT_NEAR(middle.norm(), kRadius, 0.05) << e.name;
    EXPECT_LT(std::abs(along.dot(middle.normalized())), 0.12) << e.name << " runs round";
    length += e.size.x();
    for (const double side : {-0.5, 0.5}) ends.push_back(middle + side * e.size.x() * along);
  }
  EXPECT_NEAR(length, 2 * std::numbers::pi * kRadius - 1.2, 1.5);
  int open = 0;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    bool met = false;
    for (std::size_t j = 0; j < ends.size(); ++j) met = met || (j != i && (ends[i] - ends[j]).norm() < 0.01);
    open += met ? 0 : 1;
  }
  EXPECT_LE(open, 4) << "ends that meet no other's: beside the doorway, and where the ring closes";
}

TEST(RoundWalls, HaveOneHeightDespiteLowerObservations) {
  test::CloudSampler sampler(600, 0.004, 9);
  sampler.slab({-5, -5}, {5, 5}, 0);
  constexpr int pieces = 60;
  const auto at = [](int i) {
    const double angle = 1.5 * std::numbers::pi * i / pieces;
    return Eigen::Vector2d(kRadius * std::cos(angle), kRadius * std::sin(angle));
  };
  for (int i = 0; i < pieces; ++i) sampler.wall(at(i), at(i + 1), 0, i < 25 ? 3.2 : 2.4);
  cloud::PointCloud<Cloud> cloud;
  cloud.points = sampler.cloud().points;
  const auto built = build_model(cloud, {});
  ASSERT_TRUE(built) << built.error().message;
  int facets = 0;
  for (const ModelEntity& e : built->model.entities) {
    if (e.label != EntityLabel::wall || e.part_of.empty()) continue;
    EXPECT_NEAR(e.T_map_body.translation().z() + e.size.z() / 2, 3.2, 0.1) << e.name;
    ++facets;
  }
  EXPECT_GE(facets, 8);
}

}  // namespace
}  // namespace parhelion::semantic
