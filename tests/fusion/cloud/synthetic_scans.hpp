// Scans of a synthetic building of boxes and planes: a range for each direction, with noise from a
// counter-keyed generator.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace parhelion::test {

using Boxes = std::vector<Eigen::AlignedBox3d>;

/// 8 x 6 x 3 m with a table, a cupboard, a pillar and a step in a wall: without symmetry.
inline Boxes furnished_room() {
  const auto box = [](double x0, double y0, double z0, double x1, double y1, double z1) {
    return Eigen::AlignedBox3d(Eigen::Vector3d(x0, y0, z0), Eigen::Vector3d(x1, y1, z1));
  };
  return {box(-4, -3, -1.4, 4, 3, -1.3),      box(-4, -3, 1.6, 4, 3, 1.7),
          box(-4.1, -3, -1.3, -4, 3, 1.6),    box(4, -3, -1.3, 4.1, 3, 1.6),
          box(-4, -3.1, -1.3, 4, -3, 1.6),    box(-4, 3, -1.3, 4, 3.1, 1.6),
          box(1, 1, -0.6, 2.6, 2, -0.5),      box(-4, 1.5, -1.3, -3.4, 2.8, .8),
          box(2.2, -2.4, -1.3, 2.6, -2, 1.6), box(-2.5, -3, -1.3, -0.5, -2.6, 1.6)};
}

/// A corridor 3 m wide around a block, 60 m along its centre line, with unevenly spaced pillars and doorways.
inline Boxes ring_corridor() {
  const auto box = [](double x0, double y0, double z0, double x1, double y1, double z1) {
    return Eigen::AlignedBox3d(Eigen::Vector3d(x0, y0, z0), Eigen::Vector3d(x1, y1, z1));
  };
  Boxes boxes{box(-12, -9, -1.2, 12, 9, -1.1),   box(-12, -9, 1.5, 12, 9, 1.6),
              box(-12.1, -9, -1.1, -12, 9, 1.5), box(12, -9, -1.1, 12.1, 9, 1.5),
              box(-12, -9.1, -1.1, 12, -9, 1.5), box(-12, 9, -1.1, 12, 9.1, 1.5),
              box(-9, -6, -1.1, 9, 6, 1.5)};
  std::mt19937 generator(5);
  std::uniform_real_distribution<double> along(-11, 11), across(-8, 8), size(0.2, 0.5);
  for (int i = 0; i < 12; ++i) {
    const double x = along(generator), y = across(generator), s = size(generator);
    const double top = i % 3 == 0 ? 0 : 1.5;
    boxes.push_back(i % 2 == 0 ? box(x, -9, -1.1, x + 2 * s, -9 + s, top)
                               : box(x, 9 - s, -1.1, x + 2 * s, 9, top));
    boxes.push_back(i % 2 == 0 ? box(-12, y, -1.1, -12 + s, y + 2 * s, top)
                               : box(12 - s, y, -1.1, 12, y + 2 * s, top));
  }
  return boxes;
}

/// m along the ray from outside, infinite where it misses.
inline double hit(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& from, const Eigen::Vector3d& ray) {
  double enter = -std::numeric_limits<double>::infinity(), leave = -enter;
  for (int axis = 0; axis < 3; ++axis) {
    double a = (box.min()[axis] - from[axis]) / ray[axis], b = (box.max()[axis] - from[axis]) / ray[axis];
    if (a > b) std::swap(a, b);
    enter = std::max(enter, a);
    leave = std::min(leave, b);
  }
  return enter <= leave && enter > 0 ? enter : std::numeric_limits<double>::infinity();
}

/// The scan of a scanner at `T` (its pose in the building), in its own frame: `rings` elevations from -70 to
/// 70 degrees, three times as many azimuths.
inline std::vector<Eigen::Vector3f> scan(const Boxes& boxes, const Eigen::Isometry3d& T, int rings,
                                         double noise, unsigned seed, double longest = 30) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> error;  // times noise, which may be 0
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < rings; ++i) {
    const double elevation = (140.0 * i / (rings - 1) - 70) * std::numbers::pi / 180;
    for (int j = 0; j < 3 * rings; ++j) {
      const double azimuth = 2 * std::numbers::pi * j / (3 * rings) + 1e-3;
      const Eigen::Vector3d ray(std::cos(elevation) * std::cos(azimuth),
                                std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
      double range = longest;
      for (const Eigen::AlignedBox3d& box : boxes)
        range = std::min(range, hit(box, T.translation(), T.linear() * ray));
      const double e = noise * error(generator);
      if (range < longest) points.push_back(((range + e) * ray).cast<float>());
    }
  }
  return points;
}

inline Eigen::Isometry3d pose(double x, double y, double z, double yaw, double pitch = 0, double roll = 0) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() =
      (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  T.translation() = Eigen::Vector3d(x, y, z);
  return T;
}

}  // namespace parhelion::test
