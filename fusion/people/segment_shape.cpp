#include "fusion/people/segment_shape.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "fusion/people/segments.hpp"

namespace parhelion::people {
namespace {

constexpr double kMaxRadius = 0.5;  // m: a flatter arc is a straight line

/// Algebraic fit of a circle (Kasa 1976), in coordinates about the mean.
void fit_circle(std::span<const Return> returns, SegmentShape& shape) {
  shape.circle_radius = kMaxRadius;
  shape.circle_residual = shape.roughness;
  if (returns.size() < 4) return;
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const Return& each : returns) {
    const Eigen::Vector2d p = each.p - shape.center;
    const Eigen::Vector3d row(p.x(), p.y(), 1);
    A += row * row.transpose();
    b += row * p.squaredNorm();
  }
  Eigen::Matrix3d inverse;
  bool invertible = false;
  A.computeInverseWithCheck(inverse, invertible, 1e-14);
  if (!invertible) return;
  const Eigen::Vector3d solution = inverse * b;
  const Eigen::Vector2d center = solution.head<2>() / 2;
  const double radius = std::sqrt(std::max(solution[2] + center.squaredNorm(), 0.0));
  if (!(radius < kMaxRadius)) return;
  double sum = 0;
  for (const Return& each : returns) {
    const double off = (each.p - shape.center - center).norm() - radius;
    sum += off * off;
  }
  shape.circle_radius = radius;
  shape.circle_residual = std::sqrt(sum / static_cast<double>(returns.size()));
}

/// m that a return lies in front of the line through two others, as seen from the laser.
class Line {
 public:
  Line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& eye) : a_(a) {
    const Eigen::Vector2d chord = b - a;
    normal_ = {-chord.y(), chord.x()};
    if (normal_.norm() > 1e-9) normal_.normalize();
    if (normal_.dot(eye - a) < 0) normal_ = -normal_;
  }
  double in_front(const Eigen::Vector2d& p) const { return normal_.dot(p - a_); }

 private:
  Eigen::Vector2d a_, normal_;
};

/// Of the returns from `first` to `last` the one that is farthest in front of the line between these two;
/// `first` where none is.
std::size_t foremost(std::span<const Return> returns, std::size_t first, std::size_t last,
                     const Eigen::Vector2d& eye) {
  const Line line(returns[first].p, returns[last].p, eye);
  std::size_t best = first;
  double max_front = 0;
  for (std::size_t k = first + 1; k < last; ++k) {
    const double front = line.in_front(returns[k].p);
    if (front <= max_front) continue;
    max_front = front;
    best = k;
  }
  return best;
}

/// How deep the deepest valley is, m: two legs have one, a bin has none. The convex hull (quickhull) after
/// two steps is near enough.
double concavity(std::span<const Return> returns, const Eigen::Vector2d& eye) {
  const std::size_t last = returns.size() - 1, middle = foremost(returns, 0, last, eye);
  const std::size_t corners[] = {0, foremost(returns, 0, middle, eye), middle,
                                 foremost(returns, middle, last, eye), last};
  double deepest = 0;
  for (std::size_t c = 1; c < std::size(corners); ++c) {
    if (corners[c] < corners[c - 1] + 2) continue;
    const Line line(returns[corners[c - 1]].p, returns[corners[c]].p, eye);
    for (std::size_t k = corners[c - 1] + 1; k < corners[c]; ++k)
      deepest = std::max(deepest, -line.in_front(returns[k].p));
  }
  return deepest;
}

}  // namespace

SegmentShape shape_of(std::span<const Return> returns, const Eigen::Vector2d& eye) {
  SegmentShape shape;
  const auto n = static_cast<double>(returns.size());
  for (const Return& each : returns) shape.center += each.p / n;
  double xx = 0, xy = 0, yy = 0;
  const Eigen::Vector2d chord = returns.back().p - returns.front().p;
  Eigen::Vector2d normal(-chord.y(), chord.x());
  if (normal.norm() > 1e-9) normal.normalize();
  if (normal.dot(eye - shape.center) < 0) normal = -normal;
  for (const Return& each : returns) {
    const Eigen::Vector2d p = each.p - shape.center;
    xx += p.x() * p.x() / n;
    xy += p.x() * p.y() / n;
    yy += p.y() * p.y() / n;
    shape.radius = std::max(shape.radius, p.norm());
    shape.depth = std::max(shape.depth, normal.dot(each.p - returns.front().p));
  }
  const double half = (xx - yy) / 2;
  shape.roughness = std::sqrt(std::max((xx + yy) / 2 - std::sqrt(half * half + xy * xy), 0.0));
  shape.concavity = concavity(returns, eye);
  fit_circle(returns, shape);
  return shape;
}

}  // namespace parhelion::people
