// Synthetic clouds of rooms with known surfaces.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <random>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"

namespace parhelion::test {

/// Draws points on rectangles with noise along their normals. It uses its own arithmetic on the generator's
/// output, so that every library draws the same.
class CloudSampler {
 public:
  CloudSampler(double per_square_metre, double sigma, std::uint64_t seed)
      : density_(per_square_metre), sigma_(sigma), random_(seed) {}

  /// The parallelogram corner + s u + t v, s and t in [0, 1].
  void rectangle(const Eigen::Vector3d& corner, const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
    const Eigen::Vector3d normal = u.cross(v);
    const auto count = static_cast<int>(normal.norm() * density_);
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d p =
          corner + uniform() * u + uniform() * v + gaussian() * sigma_ * normal.normalized();
      cloud_.points.push_back(p.cast<float>());
    }
  }
  /// Upright over a line of the plan.
  void wall(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double low, double high) {
    rectangle({a.x(), a.y(), low}, {b.x() - a.x(), b.y() - a.y(), 0}, {0, 0, high - low});
  }
  void slab(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double z) {
    rectangle({low.x(), low.y(), z}, {high.x() - low.x(), 0, 0}, {0, high.y() - low.y(), 0});
  }
  /// Floor, ceiling and four walls.
  void room(const Eigen::Vector2d& low, const Eigen::Vector2d& high, double z_floor, double z_ceiling) {
    slab(low, high, z_floor);
    slab(low, high, z_ceiling);
    const Eigen::Vector2d a = low, b(high.x(), low.y()), c = high, d(low.x(), high.y());
    wall(a, b, z_floor, z_ceiling);
    wall(b, c, z_floor, z_ceiling);
    wall(c, d, z_floor, z_ceiling);
    wall(d, a, z_floor, z_ceiling);
  }
  /// Points anywhere in the box.
  void clutter(const Eigen::AlignedBox3d& box, int count) {
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d fraction(uniform(), uniform(), uniform());
      cloud_.points.push_back((box.min() + fraction.cwiseProduct(box.sizes())).cast<float>());
    }
  }
  void turn(const Eigen::Isometry3d& motion) {
    for (Eigen::Vector3f& p : cloud_.points) p = (motion * p.cast<double>()).cast<float>();
  }

  double uniform() { return static_cast<double>(random_() >> 11) * 0x1.0p-53; }
  double gaussian() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  }
  const cloud::PointCloud<Map>& cloud() const { return cloud_; }

 private:
  double density_, sigma_;
  std::mt19937_64 random_;
  cloud::PointCloud<Map> cloud_;
};

}  // namespace parhelion::test
