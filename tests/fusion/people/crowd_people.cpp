#include "tests/fusion/people/crowd_people.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace parhelion::test {
namespace {

using Eigen::Vector2d;
constexpr double kPi = std::numbers::pi;
constexpr double kTrunk = 0.7;  // m above the floor, from where on legs are one

/// -1..1: a leg that swings evenly.
double even_stride(double phase) { return std::sin(phase); }

/// -1..1: on the ground for six tenths of the time, where it goes back as fast as the body goes on.
double planted_stride(double phase) {
  const double turns = phase / (2 * kPi), t = turns - std::floor(turns);
  if (t < 0.6) return 1 - 2 * t / 0.6;
  const double s = (t - 0.6) / 0.4;
  return -1 + 2 * s * s * (3 - 2 * s);
}

struct Body {
  const Walker& walker;
  double height;  // m
  int id;
  Pose2 pose;  // with the sway
  double speed;
};

void add_trunk(std::vector<Shape>& shapes, const Body& body) {
  const Walker& walker = body.walker;
  const Vector2d ahead(std::cos(body.pose.yaw), std::sin(body.pose.yaw)), left(-ahead.y(), ahead.x());
  shapes.push_back(
      ellipse(body.pose, {walker.body_depth / 2, walker.body_width / 2}, Source::person, body.id));
  const double swing = 0.25 * std::min(body.speed, 1.0) * std::sin(walker.phase);
  for (const double side : {-1.0, 1.0})
    shapes.push_back(
        disc(body.pose.position() + left * side * (walker.body_width / 2 + 0.03) + ahead * side * swing,
             0.045, Source::person, body.id));
}

void add_legs(std::vector<Shape>& shapes, const Body& body) {
  const Walker& walker = body.walker;
  const double length = walker.planted ? 1.2 * step_length(body.speed) : step_length(body.speed);
  // The swing of a leg is smaller towards the hip.
  const double reach =
      length / 2 * std::min(body.speed / 0.3, 1.0) * std::clamp(1 - (body.height - 0.1) / 1.1, 0.2, 1.0);
  const double radius = walker.leg_radius + 0.02 * std::min(body.height / 0.5, 1.0);
  for (const double side : {-1.0, 1.0}) {
    const double phase = walker.phase + (side > 0 ? 0 : kPi);
    const double stride = walker.planted ? planted_stride(phase) : even_stride(phase);
    const double still = 1 - std::min(body.speed / 0.3, 1.0);
    const Vector2d at(reach * stride + side * (walker.weight + walker.ahead * still),
                      side * std::max(walker.stance, radius));
    shapes.push_back(disc(body.pose * at, radius, Source::person, body.id));
  }
}

void add_seated(std::vector<Shape>& shapes, const Body& body) {
  const Walker& walker = body.walker;
  if (body.height > kTrunk) return add_trunk(shapes, body);
  if (body.height > 0.47) return add_box(shapes, body.pose, 0.5, 0.4, Source::person, body.id);
  for (const double side : {-1.0, 1.0})
    shapes.push_back(disc(body.pose * Vector2d(0.27 + side * walker.ahead, side * walker.stance * 1.1),
                          walker.leg_radius, Source::person, body.id));
}

void add_wheels(std::vector<Shape>& shapes, const Body& body, const Vector2d& at, double radius,
                Source source) {
  const double off = body.height - radius;
  if (std::abs(off) >= radius) return;
  const double length = 2 * std::sqrt(radius * radius - off * off);
  for (const double side : {-1.0, 1.0}) {
    const Vector2d wheel = body.pose * Vector2d(at.x(), side * at.y());
    add_box(shapes, {wheel.x(), wheel.y(), body.pose.yaw}, length, 0.035, source,
            source == Source::person ? body.id : -1);
  }
}

void add_tubes(std::vector<Shape>& shapes, const Body& body, const Vector2d& at, Source source) {
  for (const double side : {-1.0, 1.0})
    shapes.push_back(disc(body.pose * Vector2d(at.x(), side * at.y()), 0.013, source,
                          source == Source::person ? body.id : -1));
}

void add_wheelchair(std::vector<Shape>& shapes, const Body& body) {
  add_wheels(shapes, body, {-0.1, 0.28}, 0.3, Source::person);
  add_wheels(shapes, body, {0.3, 0.2}, 0.09, Source::person);
  if (body.height > 0.2 && body.height < 0.9) add_tubes(shapes, body, {-0.28, 0.2}, Source::person);
  add_seated(shapes, body);
}

/// The tops of what is pushed are boxes; below, there are wheels and tubes.
void add_aid(std::vector<Shape>& shapes, const Body& body) {
  const auto box = [&](double x, double length, double width, double low, double high) {
    if (body.height < low || body.height > high) return;
    const Vector2d at = body.pose * Vector2d(x, 0);
    add_box(shapes, {at.x(), at.y(), body.pose.yaw}, length, width, Source::aid);
  };
  switch (body.walker.aid) {
    case Aid::frame:
      add_wheels(shapes, body, {0.15, 0.27}, 0.1, Source::aid);
      add_wheels(shapes, body, {0.65, 0.26}, 0.1, Source::aid);
      if (body.height > 0.18 && body.height < 0.9) {
        add_tubes(shapes, body, {0.2, 0.27}, Source::aid);
        if (body.height < 0.75) add_tubes(shapes, body, {0.65 - 0.4 * body.height, 0.26}, Source::aid);
      }
      return box(0.4, 0.22, 0.4, 0.52, 0.62);
    case Aid::pram:
      add_wheels(shapes, body, {0.4, 0.27}, 0.14, Source::aid);
      add_wheels(shapes, body, {0.95, 0.25}, 0.1, Source::aid);
      return box(0.68, 0.7, 0.36, 0.25, 0.95);
    case Aid::trolley:
      add_wheels(shapes, body, {0.4, 0.26}, 0.06, Source::aid);
      add_wheels(shapes, body, {1.05, 0.2}, 0.06, Source::aid);
      if (body.height > 0.1 && body.height < 0.4) {
        add_tubes(shapes, body, {0.4, 0.24}, Source::aid);
        add_tubes(shapes, body, {1.0, 0.2}, Source::aid);
      }
      return box(0.75, 0.8, 0.48, 0.4, 1.0);
    case Aid::wheelchair:
    case Aid::none:
      return;
  }
}

}  // namespace

double step_length(double speed) { return 0.35 + 0.28 * speed; }

Vector2d seen_at(const Walker& walker) {
  const double before = walker.sits ? 0.2 : walker.aid == Aid::wheelchair ? 0.1 : 0;
  const Vector2d ahead(std::cos(walker.heading), std::sin(walker.heading));
  return walker.position + walker.sway + before * ahead;
}

void add_walker(std::vector<Shape>& shapes, const Walker& walker, double height, int id) {
  const Vector2d center = walker.position + walker.sway;
  const Body body{walker, height, id, {center.x(), center.y(), walker.heading}, walker.velocity.norm()};
  add_aid(shapes, body);
  if (walker.aid == Aid::wheelchair) return add_wheelchair(shapes, body);
  if (walker.sits) return add_seated(shapes, body);
  if (height > kTrunk) return add_trunk(shapes, body);
  if (walker.skirt) {
    shapes.push_back(ellipse(body.pose, walker.coat, Source::person, id));
    return;
  }
  add_legs(shapes, body);
}

}  // namespace parhelion::test
