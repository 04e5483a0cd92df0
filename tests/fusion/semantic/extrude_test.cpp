#include "fusion/semantic/grid/extrude.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <limits>

#include "protocols/model_overlap.hpp"
#include "tests/fusion/semantic/rooms.hpp"

namespace parhelion::semantic {
namespace {

using Eigen::Vector2d;
using test::Wall;

void draw(pose::GridMap& map, const Wall& wall, float probability = 0.9F) {
  const Vector2d along = wall.b - wall.a;
  const int steps = static_cast<int>(along.norm() / map.resolution * 4) + 1;
  for (int i = 0; i <= steps; ++i) {
    if (float* cell = test::cell_at(map, wall.a + along * i / steps)) *cell = probability;
  }
}

void fill_free(pose::GridMap& map) { map.occupied.assign(map.occupied.size(), 0.1F); }

/// Largest distance from points of `wall` to the nearest wall box of the model.
double distance_to_model(const Wall& wall, const SemanticModel& model) {
  double worst = 0;
  for (int i = 0; i <= 50; ++i) {
    const Vector2d p = wall.a + (wall.b - wall.a) * i / 50.0;
    double nearest = std::numeric_limits<double>::infinity();
    for (const ModelEntity& entity : model.entities) {
      if (entity.label != EntityLabel::wall) continue;
      const Eigen::Vector3d q = entity.T_map_body.inverse() * Eigen::Vector3d(p.x(), p.y(), 1);
      const Vector2d outside = (q.head<2>().cwiseAbs() - entity.size.head<2>() / 2).cwiseMax(0);
      nearest = std::min(nearest, outside.norm());
    }
    worst = std::max(worst, nearest);
  }
  return worst;
}

/// Occupied cells that no box covers although a robot could come near them, or although they are numerous:
/// checked cell by cell.
std::size_t wrongly_left_out(const pose::GridMap& map, const SemanticModel& model,
                             const ExtrudeOptions& options) {
  const auto at = [&](int x, int y) {
    const bool inside = x >= 0 && y >= 0 && x < map.width && y < map.height;
    return inside ? map.occupied[static_cast<std::size_t>(y * map.width + x)] : 0.5F;
  };
  const auto centre = [&](int x, int y) {
    return Vector2d(map.x_min + (x + 0.5) * map.resolution, map.y_min + (y + 0.5) * map.resolution);
  };
  const auto covered = [&](int x, int y) {
    return std::any_of(model.entities.begin(), model.entities.end(), [&](const ModelEntity& entity) {
      const Vector2d p = centre(x, y);
      const Eigen::Vector3d q = entity.T_map_body.inverse() * Eigen::Vector3d(p.x(), p.y(), 1);
      return (q.array().abs() <= entity.size.array() / 2 + 1e-5).all();
    });
  };
  // A robot of minimum radius can be centred here: all cells within the radius are free.
  const auto standable = [&](int x, int y) {
    const int reach = static_cast<int>(options.clear_radius / map.resolution) + 1;
    for (int dy = -reach; dy <= reach; ++dy) {
      for (int dx = -reach; dx <= reach; ++dx) {
        if (std::hypot(dx, dy) * map.resolution > options.clear_radius) continue;
        const bool inside = x + dx >= 0 && y + dy >= 0 && x + dx < map.width && y + dy < map.height;
        if (inside && at(x + dx, y + dy) > static_cast<float>(options.free_below)) return false;
      }
    }
    return true;
  };
  std::size_t wrong = 0;
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      if (static_cast<double>(at(x, y)) < options.occupied_above || covered(x, y)) continue;
      const int reach = static_cast<int>(options.reach / map.resolution);
      bool near = false;
      for (int dy = -reach; !near && dy <= reach; ++dy) {
        for (int dx = -reach; !near && dx <= reach; ++dx)
          near = std::hypot(dx, dy) * map.resolution <= options.reach && standable(x + dx, y + dy) &&
                 x + dx >= 0 && y + dy >= 0 && x + dx < map.width && y + dy < map.height;
      }
      wrong += near ? 1 : 0;
    }
  }
  return wrong;
}

void expect_sound(const pose::GridMap& map, const SemanticModel& model, const ExtrudeOptions& options) {
  const auto figures = measure_extrusion(map, model, options);
  EXPECT_GE(figures.covered_cells, figures.occupied_cells * 99 / 100);
  EXPECT_EQ(wrongly_left_out(map, model, options), 0U);
  EXPECT_FALSE(find_overlap(model.entities));
  const auto again = parse_model(to_yaml(model), "model.yaml");
  EXPECT_TRUE(again) << again.error().message;
  EXPECT_EQ(model.map_id, map.id);
}

TEST(Extrude, AStraightWallBecomesOneThinBox) {
  pose::GridMap map = test::unknown_map(8, 6);
  fill_free(map);
  const Wall wall{{0, 1}, {5, 1}};
  draw(map, wall);
  const auto model = extrude(map, {});
  ASSERT_TRUE(model) << model.error().message;
  ASSERT_EQ(model->entities.size(), 2U) << "the wall and the floor";
  const ModelEntity& box = model->entities[0];
  EXPECT_EQ(box.label, EntityLabel::wall);
  EXPECT_NEAR(box.size.x(), 5, 1.1 * map.resolution);
  EXPECT_NEAR(box.size.y(), map.resolution, 0.005);
  EXPECT_DOUBLE_EQ(box.size.z(), 2.5);
  EXPECT_NEAR(std::remainder(box.T_map_body.yaw(), std::numbers::pi), 0, 1e-3);
  EXPECT_NEAR(box.T_map_body.translation().y(), 1, map.resolution);
  EXPECT_DOUBLE_EQ(box.T_map_body.translation().z(), 1.25);
  EXPECT_LE(distance_to_model(wall, *model), map.resolution);
  expect_sound(map, *model, {});
}

TEST(Extrude, WallsAtAnyAngleAreRecoveredWithinACell) {
  for (int degrees = 0; degrees < 180; degrees += 7) {
    pose::GridMap map = test::unknown_map(12, 12);
    fill_free(map);
    const double yaw = degrees * std::numbers::pi / 180;
    const Vector2d middle(5, 4), half(4.5 * std::cos(yaw), 4.5 * std::sin(yaw));
    const Wall wall{middle - half, middle + half};
    draw(map, wall);
    const auto model = extrude(map, {});
    ASSERT_TRUE(model) << model.error().message;
    const auto figures = measure_extrusion(map, *model, {});
    EXPECT_LE(figures.walls, 2U) << degrees << " degrees";
    EXPECT_LE(distance_to_model(wall, *model), map.resolution) << degrees << " degrees";
    EXPECT_NEAR(std::remainder(model->entities[0].T_map_body.yaw() - yaw, std::numbers::pi), 0, 0.01)
        << degrees;
    expect_sound(map, *model, {});
  }
}

TEST(Extrude, ADoorStaysOpen) {
  pose::GridMap map = test::unknown_map(10, 6);
  fill_free(map);
  draw(map, {{0, 1}, {3, 1}});
  draw(map, {{3.8, 1}, {7, 1}});
  const auto model = extrude(map, {});
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(measure_extrusion(map, *model, {}).walls, 2U);
  for (const ModelEntity& entity : model->entities) {
    if (entity.label == EntityLabel::floor) continue;
    const Eigen::Vector3d p = entity.T_map_body.inverse() * Eigen::Vector3d(3.4, 1.02, 1);
    EXPECT_TRUE((p.array().abs() > entity.size.array() / 2).any()) << entity.name << " closes the door";
  }
}

TEST(Extrude, AHoleOfOneCellIsBridged) {
  pose::GridMap map = test::unknown_map(10, 6);
  draw(map, {{0, 1.02}, {3, 1.02}});
  draw(map, {{3.1, 1.02}, {7, 1.02}});
  const auto model = extrude(map, {});
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(measure_extrusion(map, *model, {}).walls, 1U);
}

TEST(Extrude, ClutterBecomesSmallSolidBoxesAndBlocksStayWhole) {
  pose::GridMap map = test::unknown_map(10, 10);
  fill_free(map);
  *test::cell_at(map, {1.02, 1.02}) = 1;
  for (int x = 0; x < 20; ++x) {
    for (int y = 0; y < 14; ++y) *test::cell_at(map, {4.02 + 0.05 * x, 4.02 + 0.05 * y}) = 1;
  }
  ExtrudeOptions options;
  options.floor = false;
  const auto model = extrude(map, options);
  ASSERT_TRUE(model) << model.error().message;
  ASSERT_EQ(model->entities.size(), 2U);
  for (const ModelEntity& entity : model->entities) EXPECT_EQ(entity.label, EntityLabel::unknown);
  expect_sound(map, *model, options);
  const auto figures = measure_extrusion(map, *model, options);
  EXPECT_NEAR(figures.box_area, 281 * 0.0025, 1e-9);
  EXPECT_EQ(figures.box_area_over_free, 0);
}

/// An office: outer walls, a corridor with rooms and door openings, one slanted wall, two round pillars.
std::vector<Wall> office() {
  std::vector<Wall> walls{{{0, 0}, {20, 0}}, {{20, 0}, {20, 10}}, {{20, 10}, {0, 10}}, {{0, 10}, {0, 0}}};
  for (int room = 0; room < 5; ++room) {
    const double x = 4.0 * room;
    walls.push_back({{x, 4}, {x + 1.2, 4}});
    walls.push_back({{x + 2.1, 4}, {x + 4, 4}});
    if (room > 0) walls.push_back({{x, 0}, {x, 4}});
  }
  walls.push_back({{14, 10}, {20, 7}});
  for (const Vector2d& pillar : {Vector2d(5, 7), Vector2d(10, 7)}) {
    for (int i = 0; i < 12; ++i) {
      const auto corner = [&](int k) {
        return Vector2d(pillar + 0.25 * Vector2d(std::cos(k * 0.5235987756), std::sin(k * 0.5235987756)));
      };
      walls.push_back({corner(i), corner(i + 1)});
    }
  }
  return walls;
}

TEST(Extrude, AScannedOfficeIsRecoveredFromNoise) {
  std::vector<Vector2d> places;
  for (int i = 0; i < 18; ++i) places.emplace_back(1 + i, i % 2 == 0 ? 5.2 : 8.3);
  for (int room = 0; room < 5; ++room)
    places.emplace_back(4.0 * room + 1.5, 2), places.emplace_back(4.0 * room + 2.7, 1);
  const auto walls = office();
  for (const double sigma : {0.01, 0.03}) {
    const pose::GridMap map = test::scanned_map(walls, places, 23, 14, sigma, 5);
    const auto model = extrude(map, {});
    ASSERT_TRUE(model) << model.error().message;
    expect_sound(map, *model, {});
    const auto figures = measure_extrusion(map, *model, {});
    std::printf(
        "noise %.2f m: %zu occupied cells, %zu walls, %zu unknown, %.1f m2 of boxes, %.1f %% over free "
        "cells\n",
        sigma, figures.occupied_cells, figures.walls, figures.unknown, figures.box_area,
        100 * figures.box_area_over_free / figures.box_area);
    EXPECT_LT(figures.box_area_over_free, 0.25 * figures.box_area);
    EXPECT_LT(figures.walls + figures.unknown, figures.occupied_cells / 8);
    for (std::size_t i = 0; i < 19; ++i) {
      EXPECT_LE(distance_to_model(walls[i], *model), 2 * map.resolution + 3 * sigma) << "wall " << i;
    }
  }
}

RC_GTEST_PROP(Extrude, AnyMapIsCoveredWithoutOverlap, ()) {
  pose::GridMap map = test::unknown_map(*rc::gen::inRange(1, 60) * 0.05, *rc::gen::inRange(1, 60) * 0.05);
  const int mode = *rc::gen::inRange(0, 3);
  const unsigned seed = *rc::gen::arbitrary<unsigned>();
  std::mt19937 random(seed);
  for (float& cell : map.occupied) {
    cell = mode == 0 ? static_cast<float>(random() % 1000) / 1000.F : random() % 16 == 0 ? 0.9F : 0.2F;
  }
  for (int i = mode == 2 ? 5 : 0; i > 0; --i) {
    const auto point = [&] {
      return Vector2d(map.x_min + random() % 60 * 0.05, map.y_min + random() % 60 * 0.05);
    };
    draw(map, {point(), point()});
  }
  map.occupied[0] = 1;
  const auto model = extrude(map, {});
  RC_ASSERT(model.ok());
  const auto figures = measure_extrusion(map, *model, {});
  RC_ASSERT(wrongly_left_out(map, *model, {}) == 0U);
  RC_ASSERT(!find_overlap(model->entities));
  RC_ASSERT(to_yaml(*extrude(map, {})) == to_yaml(*model));
  ExtrudeOptions all;
  all.min_support = 1;
  const auto whole = extrude(map, all);
  RC_ASSERT(whole.ok());
  const auto whole_figures = measure_extrusion(map, *whole, all);
  RC_ASSERT(whole_figures.covered_cells == figures.occupied_cells);
}

TEST(Extrude, UnreachableSpecklesAreOmitted) {
  pose::GridMap map = test::unknown_map(12, 6);
  // A known room of 3 m by 3 m, and a ray of one cell's width through its window.
  for (double x = 0.5; x < 3.5; x += 0.05) {
    for (double y = 0.5; y < 3.5; y += 0.05) *test::cell_at(map, {x + 0.02, y + 0.02}) = 0.1F;
  }
  for (double x = 3.5; x < 9; x += 0.05) *test::cell_at(map, {x + 0.02, 2.02}) = 0.1F;
  *test::cell_at(map, {2.02, 2.02}) = 0.9F;  // a leg in the room
  *test::cell_at(map, {3.77, 2.52}) = 0.9F;  // just behind the wall: a robot at the window may be near
  *test::cell_at(map, {9.02, 2.02}) = 0.9F;  // where the ray ended
  *test::cell_at(map, {8.02, 2.07}) = 0.9F;  // beside the ray
  for (int i = 0; i < 4; ++i) *test::cell_at(map, {7.02 + 0.05 * i, 2.5}) = 0.9F;  // few, but not a speck
  ExtrudeOptions options;
  options.floor = false;
  options.min_wall_length = 1;
  auto model = extrude(map, options);
  ASSERT_TRUE(model) << model.error().message;
  EXPECT_EQ(wrongly_left_out(map, *model, options), 0U);
  auto figures = measure_extrusion(map, *model, options);
  EXPECT_EQ(figures.occupied_cells, 8U);
  EXPECT_EQ(figures.covered_cells, 6U);
  options.min_support = 1;
  model = extrude(map, options);
  EXPECT_EQ(measure_extrusion(map, *model, options).covered_cells, 8U);
}

TEST(Extrude, RefusesInvalidMapsAndOptions) {
  pose::GridMap map = test::unknown_map(2, 2);
  EXPECT_THAT(extrude(map, {}).error().message, ::testing::HasSubstr("no occupied cell"));
  map.occupied[3] = 1;
  ExtrudeOptions options;
  options.height = 0;
  EXPECT_THAT(extrude(map, options).error().message, ::testing::HasSubstr("0 m < height"));
  options = {};
  options.min_support = 0;
  EXPECT_THAT(extrude(map, options).error().message, ::testing::HasSubstr("min_support >= 1"));
  map.occupied.pop_back();
  EXPECT_THAT(extrude(map, {}).error().message, ::testing::HasSubstr("expected width x height"));
  map = test::unknown_map(2, 2);
  map.resolution = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(extrude(map, {}));
}

}  // namespace
}  // namespace parhelion::semantic
