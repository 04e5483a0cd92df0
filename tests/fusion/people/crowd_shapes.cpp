#include "tests/fusion/people/crowd_shapes.hpp"

#include <cmath>
#include <limits>

namespace parhelion::test {
namespace {

using Eigen::Vector2d;
constexpr double kInf = std::numeric_limits<double>::infinity();

double hit_line(const Shape& s, const Vector2d& o, const Vector2d& d) {
  const Vector2d e = s.b - s.a, f = s.a - o;
  const double det = d.x() * e.y() - d.y() * e.x();
  if (std::abs(det) < 1e-12) return kInf;
  const double t = (f.x() * e.y() - f.y() * e.x()) / det, u = (f.x() * d.y() - f.y() * d.x()) / det;
  return t > 0 && u >= 0 && u <= 1 ? t : kInf;
}

double hit_ellipse(const Shape& s, const Vector2d& o, const Vector2d& d) {
  const double c = std::cos(s.yaw), n = std::sin(s.yaw);
  const Vector2d f = o - s.a;
  const Vector2d p((c * f.x() + n * f.y()) / s.b.x(), (-n * f.x() + c * f.y()) / s.b.y());
  const Vector2d q((c * d.x() + n * d.y()) / s.b.x(), (-n * d.x() + c * d.y()) / s.b.y());
  const double A = q.squaredNorm(), B = p.dot(q), C = p.squaredNorm() - 1;
  const double discriminant = B * B - A * C;
  if (discriminant < 0 || C < 0) return kInf;
  const double t = (-B - std::sqrt(discriminant)) / A;
  return t > 0 ? t : kInf;
}

}  // namespace

Shape disc(const Vector2d& center, double radius, Source source, int person) {
  return {Shape::Kind::ellipse, center, {radius, radius}, 0, source, person, 1};
}

Shape ellipse(const Pose2& pose, const Vector2d& half_axes, Source source, int person) {
  return {Shape::Kind::ellipse, pose.position(), half_axes, pose.yaw, source, person, 1};
}

Shape line(const Vector2d& a, const Vector2d& b, Source source, double visible) {
  return {Shape::Kind::line, a, b, 0, source, -1, visible};
}

void add_box(std::vector<Shape>& shapes, const Pose2& pose, double x, double y, Source source, int person) {
  const Vector2d corners[] = {pose * Vector2d(x / 2, y / 2), pose * Vector2d(-x / 2, y / 2),
                              pose * Vector2d(-x / 2, -y / 2), pose * Vector2d(x / 2, -y / 2)};
  for (int k = 0; k < 4; ++k) {
    shapes.push_back(line(corners[k], corners[(k + 1) % 4], source));
    shapes.back().person = person;
  }
}

double hit(const Shape& s, const Vector2d& o, const Vector2d& d) {
  return s.kind == Shape::Kind::line ? hit_line(s, o, d) : hit_ellipse(s, o, d);
}

}  // namespace parhelion::test
