// Measured, looked-through and unobserved space, against an exhaustive search; and floors that end with the
// observed area.
#include "fusion/semantic/net/evidence.hpp"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <tuple>

#include "fusion/cloud/parallel.hpp"
#include "fusion/semantic/net/observed_floors.hpp"
#include "tests/synthetic_site.hpp"

namespace parhelion::semantic {
namespace {

std::tuple<int, int, int> cube_of(const Eigen::Vector3d& p) {
  const Eigen::Vector3d i = (p / 0.1).array().floor();
  return {static_cast<int>(i.x()), static_cast<int>(i.y()), static_cast<int>(i.z())};
}

cloud::PointCloud<Map> random_views(unsigned seed, int points = 300) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-3, 3);
  cloud::PointCloud<Map> cloud;
  cloud.viewpoints = {{place(random), place(random), place(random)}, {0.05, 0.05, 0.05}};
  for (int i = 0; i < points; ++i) {
    cloud.points.emplace_back(static_cast<float>(place(random)), static_cast<float>(place(random)),
                              static_cast<float>(place(random)));
    cloud.scans.push_back(static_cast<std::uint16_t>(i % 2));
  }
  return cloud;
}

TEST(Evidence, EqualsTheReferenceSearchAlongEachRay) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    const cloud::PointCloud<Map> cloud = random_views(seed);
    const EvidenceGrid grid(cloud);
    std::set<std::tuple<int, int, int>> measured, crossed;
    for (const Eigen::Vector3f& p : cloud.points) measured.insert(cube_of(p.cast<double>()));
    std::set<std::pair<std::tuple<int, int, int>, int>> followed;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const Eigen::Vector3d eye = cloud.viewpoints[cloud.scans[i]], p = cloud.points[i].cast<double>();
      if (!followed.emplace(cube_of(p), cloud.scans[i]).second) continue;
      const auto last = cube_of(p);
      for (auto [k, before] = std::pair(0, last); k <= 20'000; ++k) {
        const auto cube = cube_of(eye + k / 20'000.0 * (p - eye));
        if (cube != before && cube != last) crossed.insert(cube);
        before = cube;
      }
    }
    for (const auto& cube : measured) crossed.erase(cube);
    EXPECT_EQ(grid.count(Evidence::measured), measured.size());
    // Steps of a fraction of a millimetre miss corners that a ray barely crosses.
    std::size_t found = 0;
    for (const auto& [x, y, z] : crossed)
      found += grid.at(0.1 * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5)) == Evidence::seen_through;
    EXPECT_EQ(found, crossed.size());
    EXPECT_LE(grid.count(Evidence::seen_through), crossed.size() * 1.02 + 5);
    EXPECT_EQ(grid.centres().size(), measured.size() + grid.count(Evidence::seen_through));
  }
}

TEST(Evidence, SpaceBehindASurfaceIsUnknown) {
  cloud::PointCloud<Map> cloud;
  cloud.viewpoints = {{0, 0, 1}};
  for (double y = -2; y <= 2; y += 0.02) {
    for (double z = 0; z <= 2; z += 0.02)
      cloud.points.emplace_back(3.F, static_cast<float>(y), static_cast<float>(z));
  }
  const EvidenceGrid grid(cloud);
  EXPECT_EQ(grid.at({1.5, 0.2, 1.1}), Evidence::seen_through);
  EXPECT_EQ(grid.at({3, 0.2, 1.1}), Evidence::measured);
  EXPECT_EQ(grid.at({3.5, 0.2, 1.1}), Evidence::unobserved);
  EXPECT_EQ(grid.at({-1, 0, 1}), Evidence::unobserved) << "nobody looked that way";
  cloud.viewpoints.clear();
  EXPECT_EQ(EvidenceGrid(cloud).at({1.5, 0.2, 1.1}), Evidence::unobserved) << "where from is not known";
}

TEST(Evidence, BeyondTheMemoryLimitSpaceStaysUnobserved) {
  const cloud::PointCloud<Map> cloud = random_views(3);
  EvidenceOptions few;
  few.max_blocks = 4;
  const EvidenceGrid bounded(cloud, few), whole(cloud);
  EXPECT_EQ(bounded.blocks(), 4U);
  EXPECT_GT(whole.blocks(), 8U);
  const cloud::PointCloud<Map> known = bounded.centres();
  for (const Eigen::Vector3f& p : known.points)
    EXPECT_EQ(bounded.at(p.cast<double>()), whole.at(p.cast<double>()));
}

TEST(Evidence, AtTheHeightsAskedForIsAsOfTheWhole) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    for (const bool seen_from : {true, false}) {
      cloud::PointCloud<Map> cloud = random_views(seed, 3000);
      if (!seen_from) cloud.viewpoints.clear(), cloud.scans.clear();
      EvidenceOptions options;
      options.asked = {{-2.05, -1.8}, {1.0, 1.0}, {7, 8}};
      const EvidenceGrid whole(cloud);
      for (const int threads : {1, 4})
        cloud::with_threads(threads, [&] {
          const EvidenceGrid part(cloud, options);
          const Evidence saved = seen_from ? Evidence::seen_through : Evidence::measured;
          EXPECT_LT(part.count(saved), whole.count(saved));
          std::mt19937 random(seed);
          std::uniform_real_distribution<double> place(-3.2, 3.2);
          for (int i = 0; i < 20'000; ++i) {
            const HeightRange& range = options.asked[static_cast<std::size_t>(i % 3)];
            const double z = std::uniform_real_distribution<double>(range.low, range.high)(random);
            const Eigen::Vector3d p(place(random), place(random), z);
            ASSERT_EQ(part.at(p), whole.at(p)) << p.transpose();
          }
        });
    }
  }
}

TEST(Evidence, OfAllHeightsWhereMemoryMayNotSuffice) {
  const cloud::PointCloud<Map> cloud = random_views(3);
  EvidenceOptions few, asked;
  few.max_blocks = asked.max_blocks = 4;
  asked.asked = {{-2.05, -1.8}};
  EXPECT_EQ(EvidenceGrid(cloud, asked).centres().points, EvidenceGrid(cloud, few).centres().points);
}

SemanticModel one_floor() {
  SemanticModel model;
  model.entities = {test::model_box("floor 1", EntityLabel::floor, {0, 0, -0.05}, {12, 8, 0.1}),
                    test::model_box("wall 1", EntityLabel::wall, {0, 4, 1}, {12, 0.1, 2})};
  model.relations = {{RelationKind::under, "floor 1", "wall 1", 1}};
  return model;
}

double floor_area(const SemanticModel& model, double x_low, double x_high) {
  double area = 0;
  for (const ModelEntity& e : model.entities) {
    const double x = e.T_map_body.translation().x();
    const double half = std::abs(e.T_map_body.rotation()(0, 0)) > 0.5 ? e.size.x() / 2 : e.size.y() / 2;
    const double overlap = std::min(x + half, x_high) - std::max(x - half, x_low);
    if (e.label == EntityLabel::floor && overlap > 0) area += overlap * e.size.x() * e.size.y() / (2 * half);
  }
  return area;
}

bool covered(const SemanticModel& model, EntityLabel label, double x, double y, double shrunk) {
  return std::any_of(model.entities.begin(), model.entities.end(), [&](const ModelEntity& e) {
    const Eigen::Vector3d p = e.T_map_body.inverse() * Eigen::Vector3d(x, y, e.T_map_body.translation().z());
    return e.label == label && std::abs(p.x()) < e.size.x() / 2 - shrunk &&
           std::abs(p.y()) < e.size.y() / 2 - shrunk;
  });
}

/// Two observed halls, x < -1 and x > 1; the space between them was not observed.
cloud::PointCloud<Map> two_halls(double spacing, bool sight) {
  cloud::PointCloud<Map> cloud;
  if (sight) cloud.viewpoints = {{-3, 0, 1.3}, {3, 0, 1.3}};
  for (double x = -6; x <= 6; x += spacing) {
    for (double y = -4; y <= 4; y += spacing) {
      if (std::abs(x) < 1) continue;
      cloud.points.emplace_back(static_cast<float>(x), static_cast<float>(y), 0.F);
      if (sight) cloud.scans.push_back(x > 0);
    }
  }
  return cloud;
}

TEST(ObservedFloors, CoverOnlyObservedSpace) {
  for (const bool sight : {false, true}) {
    SemanticModel model = one_floor();
    cut_floors(EvidenceGrid(two_halls(0.05, sight)), model);
    EXPECT_NEAR(floor_area(model, -6, -1), 40, 3);
    EXPECT_NEAR(floor_area(model, 1, 6), 40, 3);
    EXPECT_LT(floor_area(model, -0.75, 0.75), 0.01);
    EXPECT_TRUE(parse_model(to_yaml(model), "model").ok());
    EXPECT_EQ(model.relations.size(), 1U);
    EXPECT_EQ(model.entities[0].name, "floor 1");
    EXPECT_EQ(model.entities[1].part_of, "floor 1");
  }
}

TEST(ObservedFloors, HaveNoGapsBetweenScanLinesThatRaysCrossed) {
  cloud::PointCloud<Map> cloud;  // rings, 0.5 m apart far out
  cloud.viewpoints = {{0, 0, 0.5}};
  for (double r = 0.3; r < 4; r += 0.1 + 0.1 * r) {
    for (double a = 0; a < 6.28; a += 0.02)
      cloud.points.emplace_back(static_cast<float>(r * std::cos(a)), static_cast<float>(r * std::sin(a)),
                                0.F);
  }
  SemanticModel seen = one_floor(), blind = one_floor();
  cut_floors(EvidenceGrid(cloud), seen);
  cloud.viewpoints.clear();
  cut_floors(EvidenceGrid(cloud), blind);
  EXPECT_GT(floor_area(seen, -6, 6), 0.85 * 3.14 * 3.7 * 3.7);
  EXPECT_LT(floor_area(blind, -6, 6), floor_area(seen, -6, 6));
}

TEST(ObservedFloors, AnUnseenFloorIsRemovedWithItsRelations) {
  SemanticModel model = one_floor();
  cloud::PointCloud<Map> elsewhere;
  elsewhere.points = {{50, 50, 0}};
  cut_floors(EvidenceGrid(elsewhere), model);
  ASSERT_EQ(model.entities.size(), 1U);
  EXPECT_EQ(model.entities[0].name, "wall 1");
  EXPECT_TRUE(model.relations.empty());
}

TEST(ObservedFloors, EndWhereRaysPassBelowThem) {
  // A landing at z = 0 from x = -2 to 0, ground 0.85 m under it, both seen from above; its box is too large.
  cloud::PointCloud<Map> cloud;
  cloud.viewpoints = {{3, 0, 1.2}, {-4, 3, 1.2}};
  for (double x = -6; x <= 6; x += 0.04) {
    for (double y = -4; y <= 4; y += 0.04) {
      const double z = x > -2 && x < 0 && std::abs(y) < 2 ? 0 : -0.85;
      for (std::uint16_t scan = 0; scan < 2; ++scan) {
        const Eigen::Vector3d eye = cloud.viewpoints[scan], p(x, y, z);
        const Eigen::Vector3d over = eye + eye.z() / (eye.z() - z) * (p - eye);  // sight crosses z = 0
        if (z < 0 && over.x() > -2 && over.x() < 0 && std::abs(over.y()) < 2) continue;
        cloud.points.push_back(p.cast<float>());
        cloud.scans.push_back(scan);
      }
    }
  }
  SemanticModel model = one_floor();
  cut_floors(EvidenceGrid(cloud), model);
  double area = 0, landing = 0;
  for (const ModelEntity& e : model.entities) {
    if (e.label == EntityLabel::floor) area += e.size.x() * e.size.y();
  }
  for (double x = -1.95; x < 0; x += 0.1) {
    for (double y = -1.95; y < 2; y += 0.1) landing += covered(model, EntityLabel::floor, x, y, 0) ? 0.01 : 0;
  }
  EXPECT_NEAR(landing, 8, 0.2);
  EXPECT_LT(area, 8 + 12 * 0.3);  // the landing hides the area next to it
}

/// Four steps up to `top`, turned by `yaw`.
void add_flight(SemanticModel& model, double yaw, double top) {
  const Transform<Map, Body> T_map_flight = Transform<Map, Body>::planar(-3, 0.3, yaw);
  for (int i = 0; i < 4; ++i) {
    const double height = top - 0.17 * (3 - i);
    ModelEntity step = test::model_box("step " + std::to_string(i + 1), EntityLabel::stairs, {0, 0, 0}, {});
    step.T_map_body = T_map_flight * Transform<Body, Body>::planar(0.3 * i, 0, 0, height - 1);
    step.size = {0.3, 1.5, 2};
    step.part_of = "stairs 1";
    model.entities.push_back(step);
  }
}

TEST(ObservedFloors, EndAtTheStairsThatLeadUpToThem) {
  const EvidenceGrid evidence(two_halls(0.05, false));
  for (const double yaw : {0.0, 0.3, 1.2, 3.0}) {
    SemanticModel model = one_floor();
    add_flight(model, yaw, 0.01);
    cut_floors(evidence, model);
    int hanging = 0, gap = 0;
    for (double x = -5.9; x < -1.1; x += 0.02) {
      for (double y = -3.9; y < 3.9; y += 0.02) {
        const bool floor = covered(model, EntityLabel::floor, x, y, 0);
        hanging += floor && covered(model, EntityLabel::stairs, x, y, 0.06) ? 1 : 0;
        gap += !floor && !covered(model, EntityLabel::stairs, x, y, -0.06) ? 1 : 0;
      }
    }
    EXPECT_LE(hanging, 40) << yaw;  // single cells of 5 cm
    EXPECT_LE(gap, 40) << yaw;
  }
}

TEST(ObservedFloors, ContinueUnderAndHighAboveAFlight) {
  const EvidenceGrid evidence(two_halls(0.05, false));
  SemanticModel bare = one_floor();
  cut_floors(evidence, bare);
  for (const double top : {0.17 * 4, -2.0}) {
    SemanticModel model = one_floor();
    add_flight(model, 0.3, top);
    cut_floors(evidence, model);
    EXPECT_DOUBLE_EQ(floor_area(model, -6, -1), floor_area(bare, -6, -1)) << top;
  }
}

}  // namespace
}  // namespace parhelion::semantic
