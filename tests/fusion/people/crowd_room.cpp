#include "tests/fusion/people/crowd_room.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace parhelion::test {
namespace {

using Eigen::Vector2d;
constexpr double kPi = std::numbers::pi;

}  // namespace

Vector2d Room::place(Random& random) const {
  return {random.uniform(0.5, width_ - 0.5), random.uniform(0.5, depth_ - 0.5)};
}

void Room::add_walls(bool glass, Random& random) {
  const Vector2d corners[] = {{0, 0}, {width_, 0}, {width_, depth_}, {0, depth_}};
  for (int k = 0; k < 4; ++k)
    add_doorway(corners[k], corners[(k + 1) % 4], glass && k == 1 ? 0.15 : 1, random);
  const int pillars = random.integer(0, 3);
  for (int i = 0; i < pillars; ++i) {
    const Vector2d at = place(random);
    test::add_box(walls_, {at.x(), at.y(), 0}, 0.4, 0.4, Source::building);
    add_obstacle(at, 0.3);
  }
}

/// A wall with a doorway: posts that stand out, and a room behind it.
void Room::add_doorway(const Vector2d& a, const Vector2d& b, double visible, Random& random) {
  const Vector2d along = (b - a).normalized();
  const Vector2d inward(-along.y(), along.x());
  const double door = random.uniform(0.2, 0.7) * (b - a).norm();
  walls_.push_back(line(a, a + along * door, Source::building, visible));
  walls_.push_back(line(a + along * (door + 0.9), b, Source::building, visible));
  for (const double s : {door, door + 0.9}) {
    walls_.push_back(line(a + along * s, a + along * s + inward * 0.08, Source::building));
    walls_.push_back(line(a + along * (s - 0.05) + inward * 0.08, a + along * (s + 0.05) + inward * 0.08,
                          Source::building));
  }
  walls_.push_back(
      line(a + along * door - inward * 1.5, a + along * (door + 0.9) - inward * 1.5, Source::building));
}

void Room::add_round(const Shape& shape) {
  furniture_.push_back(shape);
  add_obstacle(shape.a, shape.b.x());
}

void Room::add_box(Random& random) {
  const Vector2d at = place(random);
  const double x = random.uniform(0.15, 0.9), y = random.uniform(0.15, 0.9);
  test::add_box(furniture_, {at.x(), at.y(), random.uniform(0, kPi)}, x, y, Source::furniture);
  add_obstacle(at, std::hypot(x, y) / 2);
}

void Room::add_chair(const Vector2d& at, double yaw, Random& random) {
  const Pose2 pose{at.x(), at.y(), yaw};
  add_obstacle(at, 0.35);
  if (laser_height_ > 0.9) return;  // under the beams
  if (laser_height_ > 0.5) {        // its back
    furniture_.push_back(line(pose * Vector2d(-0.2, -0.2), pose * Vector2d(-0.2, 0.2), Source::furniture));
    return;
  }
  if (random.chance(0.3)) return add_five_feet(pose, random);
  const double x = random.uniform(0.36, 0.5) / 2, y = random.uniform(0.36, 0.5) / 2;
  const double radius = random.uniform(0.01, 0.028);
  for (const double sx : {-x, x})
    for (const double sy : {-y, y})
      furniture_.push_back(disc(pose * Vector2d(sx, sy), radius, Source::furniture));
}

/// On a column.
void Room::add_five_feet(const Pose2& pose, Random& random) {
  const int feet = 5;
  furniture_.push_back(disc(pose.position(), random.uniform(0.025, 0.04), Source::furniture));
  if (laser_height_ > 0.12) return;
  for (int k = 0; k < feet; ++k)
    furniture_.push_back(
        disc(pose * (0.3 * Vector2d(std::cos(2 * kPi * k / feet), std::sin(2 * kPi * k / feet))), 0.03,
             Source::furniture));
}

void Room::add_table(const Vector2d& at, Random& random) {
  const Pose2 pose{at.x(), at.y(), random.uniform(0, 2 * kPi)};
  const double x = random.uniform(0.7, 1.8) / 2, y = random.uniform(0.6, 0.9) / 2;
  add_obstacle(at, std::hypot(x, y));
  if (laser_height_ > 0.75) return;
  const bool square = random.chance(0.5);
  const double size = random.uniform(0.03, 0.09);
  for (const double sx : {-x, x}) {
    for (const double sy : {-y, y}) {
      const Vector2d leg = pose * Vector2d(sx * 0.9, sy * 0.9);
      if (square)
        test::add_box(furniture_, {leg.x(), leg.y(), pose.yaw}, size, size, Source::furniture);
      else
        furniture_.push_back(disc(leg, size / 2, Source::furniture));
    }
  }
}

bool Room::is_free(const Vector2d& p, double clearance) const {
  if (p.x() < clearance || p.y() < clearance || p.x() > width_ - clearance || p.y() > depth_ - clearance)
    return false;
  return std::all_of(obstacles_.begin(), obstacles_.end(), [&](const Obstacle& each) {
    return (each.center - p).norm() > each.radius + clearance;
  });
}

Pose2 Room::free_pose(Random& random) const {
  for (int k = 0; k < 200; ++k) {
    const Vector2d p = place(random);
    if (is_free(p, 0.35)) return {p.x(), p.y(), random.uniform(0, 2 * kPi)};
  }
  return {width_ / 2, depth_ / 2, 0};
}

bool Room::path_is_free(const Vector2d& a, const Vector2d& b, double clearance) const {
  const int n = static_cast<int>((b - a).norm() / 0.1) + 1;
  for (int k = 1; k <= n; ++k)
    if (!is_free(a + (b - a) * k / n, clearance)) return false;
  return true;
}

std::optional<Vector2d> Room::next_target(const Vector2d& from, double clearance, Random& random) const {
  for (int k = 0; k < 20; ++k) {
    const Vector2d p = place(random);
    if ((p - from).norm() > 0.8 && path_is_free(from, p, clearance)) return p;
  }
  return std::nullopt;
}

}  // namespace parhelion::test
