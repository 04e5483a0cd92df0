#include "fusion/cloud/symmetric3.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace parhelion::cloud {
namespace {

/// The smallest root of x^3 - a x^2 + b x - c with real, non-negative roots. From 0, Newton's steps approach
/// it from below without overshoot.
double smallest_root(double a, double b, double c) {
  constexpr int max_steps = 40;  // a triple root is approached by thirds
  double x = 0;
  for (int i = 0; i < max_steps; ++i) {
    const double value = ((x - a) * x + b) * x - c, slope = (3 * x - 2 * a) * x + b;
    if (!(slope > 0) || !(value < 0)) break;
    const double step = value / slope;
    x -= step;
    if (-step <= 1e-5 * x) break;  // the next step would be quadratically smaller
  }
  return x;
}

/// Normal of the plane spanned by the rows of a singular symmetric matrix.
Eigen::Vector3d null_vector(const Eigen::Vector3d& d, const Eigen::Vector3d& o) {
  const Eigen::Vector3d rows[3] = {{d.x(), o.x(), o.y()}, {o.x(), d.y(), o.z()}, {o.y(), o.z(), d.z()}};
  Eigen::Vector3d best = rows[0].cross(rows[1]);
  for (const Eigen::Vector3d& other : {rows[0].cross(rows[2]), rows[1].cross(rows[2])}) {
    if (other.squaredNorm() > best.squaredNorm()) best = other;
  }
  if (best.squaredNorm() > 1e-24) return best.normalized();
  // The rows are collinear: any perpendicular vector is valid.
  Eigen::Vector3d line = rows[0];
  for (const Eigen::Vector3d& other : {rows[1], rows[2]}) {
    if (other.squaredNorm() > line.squaredNorm()) line = other;
  }
  if (!(line.squaredNorm() > 1e-24)) return Eigen::Vector3d::UnitZ();
  return line.unitOrthogonal();
}

}  // namespace

SmallestEigen smallest_eigen(const Eigen::Vector3d& diagonal, const Eigen::Vector3d& beside) {
  const double trace = diagonal.sum();
  if (!(trace > 0)) return {0, 0, Eigen::Vector3d::UnitZ()};
  const Eigen::Vector3d d = diagonal / trace, o = beside / trace;
  const double minors = d.x() * d.y() + d.x() * d.z() + d.y() * d.z() - o.squaredNorm();
  const double determinant = d.x() * (d.y() * d.z() - o.z() * o.z()) -
                             o.x() * (o.x() * d.z() - o.z() * o.y()) +
                             o.y() * (o.x() * o.z() - d.y() * o.y());
  const double smallest = smallest_root(1, minors, determinant);
  // The other two have this sum and this product.
  const double sum = 1 - smallest, product = std::max(0.0, minors - smallest * sum);
  const double greatest = sum / 2 + std::sqrt(std::max(0.0, sum * sum / 4 - product));
  const Eigen::Vector3d vector = null_vector(d.array() - smallest, o);
  return {smallest * trace, std::max(smallest, product / greatest) * trace, vector};
}

}  // namespace parhelion::cloud
