// Grid maps like those of SLAM, of known buildings: noisy walls, free space along the laser's beams.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "fusion/pose/maps/grid_map.hpp"

namespace parhelion::test {

struct Wall {
  Eigen::Vector2d a, b;  ///< m
};

inline pose::GridMap unknown_map(double width, double height, double resolution = 0.05) {
  pose::GridMap map;
  map.id = "test map";
  map.resolution = resolution;
  map.x_min = -1;
  map.y_min = -2;
  map.width = static_cast<int>(std::ceil(width / resolution));
  map.height = static_cast<int>(std::ceil(height / resolution));
  map.occupied.assign(static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height), 0.5F);
  return map;
}

inline float* cell_at(pose::GridMap& map, const Eigen::Vector2d& p) {
  const int x = static_cast<int>(std::floor((p.x() - map.x_min) / map.resolution));
  const int y = static_cast<int>(std::floor((p.y() - map.y_min) / map.resolution));
  if (x < 0 || y < 0 || x >= map.width || y >= map.height) return nullptr;
  return &map.occupied[static_cast<std::size_t>(y) * static_cast<std::size_t>(map.width) +
                       static_cast<std::size_t>(x)];
}

/// Distance along the ray to the first wall, or `max`.
inline double cast(const Eigen::Vector2d& from, double angle, const std::vector<Wall>& walls, double max) {
  const Eigen::Vector2d u(std::cos(angle), std::sin(angle));
  double nearest = max;
  for (const Wall& wall : walls) {
    const Eigen::Vector2d e = wall.b - wall.a, w = wall.a - from;
    const double det = u.x() * e.y() - u.y() * e.x();
    if (std::abs(det) < 1e-12) continue;
    const double t = (w.x() * e.y() - w.y() * e.x()) / det;
    const double s = (w.x() * u.y() - w.y() * u.x()) / det;
    if (t > 0 && t < nearest && s >= 0 && s <= 1) nearest = t;
  }
  return nearest;
}

/// Scans from each position, range noise `sigma`, as occupancy counts converted to probabilities.
inline pose::GridMap scanned_map(const std::vector<Wall>& walls, const std::vector<Eigen::Vector2d>& places,
                                 double width, double height, double sigma, unsigned seed) {
  pose::GridMap map = unknown_map(width, height);
  std::vector<int> hits(map.occupied.size()), misses(map.occupied.size());
  std::mt19937 random(seed);
  const auto noise = [&] {  // Irwin-Hall: the same on every library
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += random() / 4294967296.0;
    return sum * sigma;
  };
  for (const Eigen::Vector2d& place : places) {
    for (int beam = 0; beam < 1440; ++beam) {
      const double angle = beam * 3.14159265358979 / 720;
      const double range = cast(place, angle, walls, 30);
      const double seen = range + noise();
      const Eigen::Vector2d u(std::cos(angle), std::sin(angle));
      for (double t = 0; t < seen - map.resolution; t += map.resolution / 2) {
        if (float* cell = cell_at(map, place + t * u))
          ++misses[static_cast<std::size_t>(cell - map.occupied.data())];
      }
      float* cell = range < 30 ? cell_at(map, place + seen * u) : nullptr;
      if (cell != nullptr) hits[static_cast<std::size_t>(cell - map.occupied.data())] += 3;
    }
  }
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (hits[i] + misses[i] > 0)
      map.occupied[i] = static_cast<float>(hits[i] + 0.5) / static_cast<float>(hits[i] + misses[i] + 1);
  }
  return map;
}

}  // namespace parhelion::test
