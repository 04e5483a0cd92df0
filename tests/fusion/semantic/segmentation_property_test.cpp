// Random rooms: their surfaces are found, wherever the room is and however it was measured.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <sstream>

#include "fusion/semantic/segmentation/segmentation.hpp"
#include "tests/fusion/semantic/clouds.hpp"

namespace parhelion::semantic {
namespace {

using test::CloudSampler;

/// Clouds are large: a few in every run, many in a long one.
void check(const auto& property) {
  rc::detail::TestParams parameters = rc::detail::configuration().testParams;
  parameters.maxSuccess = std::getenv("PARHELION_LONG") != nullptr ? 200 : 6;
  parameters.disableShrinking = true;
  const auto result = rc::detail::checkProperty(rc::detail::toProperty(property), {}, parameters);
  std::ostringstream message;
  rc::detail::printResultMessage(result, message);
  EXPECT_TRUE(result.template is<rc::detail::SuccessResult>()) << message.str();
}

struct Built {
  std::vector<std::pair<Eigen::Vector2d, Eigen::Vector2d>> walls;  // in the map
  double floor = 0, ceiling = 0;
  cloud::PointCloud<Map> cloud;
};

/// A room with one inner wall, anywhere in the plan, with clutter like furniture and outliers.
Built random_room() {
  const double length = *rc::gen::inRange(35, 140) / 10.0, depth = *rc::gen::inRange(30, 90) / 10.0;
  const double yaw = *rc::gen::inRange(-180, 180) * std::numbers::pi / 180;
  const Eigen::Vector2d place(*rc::gen::inRange(-3000, 3000) / 100.0, *rc::gen::inRange(-3000, 3000) / 100.0);
  Built built;
  built.floor = *rc::gen::inRange(-300, 300) / 100.0;
  built.ceiling = built.floor + *rc::gen::inRange(230, 400) / 100.0;
  CloudSampler sampler(*rc::gen::inRange(250, 900), *rc::gen::inRange(0, 12) / 1000.0,
                       *rc::gen::arbitrary<std::uint64_t>());
  sampler.room({0, 0}, {length, depth}, built.floor, built.ceiling);
  const double inner = length * *rc::gen::inRange(30, 70) / 100.0;
  sampler.wall({inner, 0}, {inner, depth * 0.7}, built.floor, built.ceiling);
  const double side = std::min(1.0, depth / 4);
  sampler.clutter(
      {Eigen::Vector3d(0.3, 0.3, built.floor), Eigen::Vector3d(0.3 + side, 0.3 + side, built.floor + 0.8)},
      *rc::gen::inRange(0, 1500));
  sampler.clutter({Eigen::Vector3d(-40, -40, -20), Eigen::Vector3d(40, 40, 20)}, *rc::gen::inRange(0, 300));
  const Eigen::Isometry3d T_map_room =
      Eigen::Translation3d(place.x(), place.y(), 0) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
  sampler.turn(T_map_room);
  const std::vector<Eigen::Vector2d> p = {{0, 0},     {length, 0}, {length, depth},
                                          {0, depth}, {inner, 0},  {inner, depth * 0.7}};
  const auto in_map = [&](std::size_t i) -> Eigen::Vector2d {
    return (T_map_room * Eigen::Vector3d(p[i].x(), p[i].y(), 0)).head<2>();
  };
  for (const auto& [a, b] :
       std::vector<std::pair<std::size_t, std::size_t>>{{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}})
    built.walls.emplace_back(in_map(a), in_map(b));
  built.cloud = sampler.cloud();
  return built;
}

/// m between the wall's ends and the nearest surface's line and ends, and degrees between them.
void expect_found(const Segmentation& found, const std::pair<Eigen::Vector2d, Eigen::Vector2d>& wall) {
  const auto& [a, b] = wall;
  const Eigen::Vector2d along = (b - a).normalized();
  for (const VerticalSurface& s : found.verticals) {
    const Eigen::Vector2d d = (s.end - s.start).normalized();
    const auto across = [&](const Eigen::Vector2d& q) {
      return std::abs(d.x() * (q.y() - s.start.y()) - d.y() * (q.x() - s.start.x()));
    };
    if (std::abs(d.x() * along.y() - d.y() * along.x()) > std::sin(0.5 * std::numbers::pi / 180)) continue;
    if (across(a) > 0.02 || across(b) > 0.02) continue;
    const double t0 = along.dot(s.start - a), t1 = along.dot(s.end - a);
    if (std::min(t0, t1) > 0.08 || std::max(t0, t1) < (b - a).norm() - 0.08) continue;
    return;
  }
  RC_FAIL("a wall of " + std::to_string((b - a).norm()) + " m was not found among " +
          std::to_string(found.verticals.size()) + " surfaces");
}

std::string words(const Segmentation& found) {
  std::ostringstream text;
  for (const HorizontalSurface& s : found.horizontals) text << s.z << " m (" << s.area << " m2), ";
  return text.str();
}

TEST(SegmentationOfRandomRooms, FindsTheirWallsFloorAndCeiling) {
  check([] {
    const Built built = random_room();
    const auto found = segment(built.cloud);
    RC_ASSERT(found.ok());
    for (const auto& wall : built.walls) expect_found(*found, wall);
    for (const double z : {built.floor, built.ceiling}) {
      const auto it =
          std::find_if(found->horizontals.begin(), found->horizontals.end(),
                       [&](const HorizontalSurface& s) { return std::abs(s.z - z) < 0.01 && s.area > 4; });
      if (it == found->horizontals.end())
        RC_FAIL("nothing at " + std::to_string(z) + " m among " + words(*found));
      RC_ASSERT(it->faces_down == (z == built.ceiling));
    }
  });
}

/// m, the largest distance of a wall's line in one from the same line in the other.
double largest_shift(const Segmentation& one, const Segmentation& other, const Eigen::Vector2d& shift) {
  double largest = 0;
  for (const VerticalSurface& s : one.verticals) {
    if ((s.end - s.start).norm() < 2) continue;
    double nearest = 1e9;
    for (const VerticalSurface& o : other.verticals) {
      const double same = std::max((s.start + shift - o.start).norm(), (s.end + shift - o.end).norm());
      const double turned = std::max((s.start + shift - o.end).norm(), (s.end + shift - o.start).norm());
      nearest = std::min({nearest, same, turned});
    }
    largest = std::max(largest, nearest);
  }
  return largest;
}

TEST(SegmentationOfRandomRooms, DoesNotDependOnTheTileOrigin) {
  check([] {
    CloudSampler sampler(250, 0.004, 11);
    sampler.room({-6, -4}, {9, 7}, 0, 2.6);
    sampler.wall({1, -4}, {1, 5}, 0, 2.6);
    const auto before = segment(sampler.cloud());
    const Eigen::Vector2d shift(*rc::gen::inRange(-1000, 1000) / 100.0,
                                *rc::gen::inRange(-1000, 1000) / 100.0);
    cloud::PointCloud<Map> moved = sampler.cloud();
    for (Eigen::Vector3f& p : moved.points) p.head<2>() += shift.cast<float>();
    const auto after = segment(moved);
    RC_ASSERT(before.ok() && after.ok());
    RC_ASSERT(before->verticals.size() == 5U);
    RC_ASSERT(after->verticals.size() == 5U);
    RC_ASSERT(largest_shift(*before, *after, shift) < 2 * SegmentationOptions().pixel);
  });
}

TEST(SegmentationOfRandomRooms, FindsStairsInAnyOrientation) {
  check([] {
    const double rise = *rc::gen::inRange(14, 20) / 100.0, tread = *rc::gen::inRange(26, 34) / 100.0;
    const double wide = *rc::gen::inRange(9, 20) / 10.0;
    const double yaw = *rc::gen::inRange(0, 360) * std::numbers::pi / 180;
    constexpr int steps = 6;
    CloudSampler sampler(4000, 0.003, 5);
    sampler.slab({-3, -2}, {0, 3}, 0);
    for (int i = 0; i < steps; ++i) {
      sampler.wall({i * tread, 0}, {i * tread, wide}, i * rise, (i + 1) * rise);
      sampler.slab({i * tread, 0}, {(i + 1) * tread, wide}, (i + 1) * rise);
    }
    sampler.turn(Eigen::Isometry3d(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())));
    const auto found = segment(sampler.cloud());
    RC_ASSERT(found.ok());
    for (int i = 1; i <= steps; ++i) {
      RC_ASSERT(
          std::any_of(found->horizontals.begin(), found->horizontals.end(), [&](const HorizontalSurface& s) {
            return std::abs(s.z - i * rise) < 0.01 && s.area > 0.4 * tread * wide;
          }));
    }
    RC_ASSERT(found->parallels.size() == 1U);
    const ParallelSet& set = found->parallels.front();
    RC_ASSERT(set.members.size() >= 4U);
    RC_ASSERT(std::abs(set.spacing - tread) < 0.02);
    RC_ASSERT(set.direction.dot(Eigen::Vector2d(std::cos(yaw), std::sin(yaw))) >
              std::cos(3 * std::numbers::pi / 180));
  });
}

}  // namespace
}  // namespace parhelion::semantic
