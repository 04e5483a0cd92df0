#include "fusion/semantic/slice.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::semantic {
namespace {

constexpr double kFloor = 0.05;  ///< m, points this near to the floor's height belong to it
constexpr std::size_t kMaxRays = 4'000'000;

struct Evidence {
  std::uint32_t hits = 0;
  bool floor = false, crossed = false;
};

class Slicer {
 public:
  Slicer(const SliceOptions& options, pose::GridMap& map) : options_(options), map_(map) {
    cells_.resize(static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height));
  }

  void add(const Eigen::Vector3d& p) {
    Evidence* cell = at(p.x(), p.y());
    if (cell == nullptr) return;
    const double z = p.z() - options_.floor;
    if (std::abs(z - options_.height) <= options_.band) ++cell->hits;
    if (std::abs(z) <= kFloor) cell->floor = true;
  }

  /// The part of a line of sight within the band, shortened by a cell at its end.
  void cross(const Eigen::Vector3d& eye, const Eigen::Vector3d& p) {
    const double low = options_.floor + options_.height - options_.band, high = low + 2 * options_.band;
    const Eigen::Vector3d ray = p - eye;
    double from = 0, to = 1 - map_.resolution / std::max(ray.norm(), map_.resolution);
    if (ray.z() == 0) {
      if (eye.z() < low || eye.z() > high) return;
    } else {
      const double a = (low - eye.z()) / ray.z(), b = (high - eye.z()) / ray.z();
      from = std::max(from, std::min(a, b));
      to = std::min(to, std::max(a, b));
    }
    const double length = ray.head<2>().norm();
    const double step = length > 0 ? map_.resolution / 2 / length : 1;
    for (double t = from; t <= to; t += step) {
      if (Evidence* cell = at(eye.x() + t * ray.x(), eye.y() + t * ray.y())) cell->crossed = true;
    }
  }

  std::size_t write() {
    std::size_t occupied = 0;
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      const Evidence& cell = cells_[i];
      const bool solid = cell.hits >= options_.min_points;
      map_.occupied[i] = solid ? 1.F : (cell.floor || cell.crossed) && cell.hits == 0 ? 0.F : 0.5F;
      occupied += solid;
    }
    return occupied;
  }

 private:
  Evidence* at(double x, double y) {
    const double column = std::floor((x - map_.x_min) / map_.resolution),
                 row = std::floor((y - map_.y_min) / map_.resolution);
    if (!(column >= 0 && column < map_.width && row >= 0 && row < map_.height)) return nullptr;
    return &cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(map_.width) +
                   static_cast<std::size_t>(column)];
  }

  const SliceOptions& options_;
  pose::GridMap& map_;
  std::vector<Evidence> cells_;
};

/// nullptr: unknown.
const Eigen::Vector3d* viewpoint_of(const cloud::PointCloud<Map>& cloud, std::size_t point) {
  const std::size_t scan = cloud.scans.empty() ? 0 : cloud.scans[point];
  return scan < cloud.viewpoints.size() ? &cloud.viewpoints[scan] : nullptr;
}

}  // namespace

Result<pose::GridMap> slice(const cloud::PointCloud<Map>& cloud, const SliceOptions& options) {
  if (!(options.resolution > 0 && options.band > 0 && options.height > 0))
    return Error{"slice: expected height > 0 m, band > 0 m and resolution > 0 m"};
  Eigen::AlignedBox2d extent;
  for (const Eigen::Vector3f& p : cloud.points) {
    const double z = static_cast<double>(p.z()) - options.floor;
    if (z > -kFloor && z < options.height + options.band) extent.extend(Eigen::Vector2d(p.x(), p.y()));
  }
  if (extent.isEmpty()) return Error{"slice: no point between the floor and the laser's height"};
  pose::GridMap map;
  map.resolution = options.resolution;
  const Eigen::Vector2d low = (extent.min() / map.resolution).array().floor() - 2;
  const Eigen::Vector2d cells = (extent.max() / map.resolution).array().floor() + 3 - low.array();
  if (!(cells.prod() <= 1e8))
    return Error{"slice: a map of " + std::to_string(cells.x()) + " by " + std::to_string(cells.y()) +
                 " cells is too large; at most 1e8 in all"};
  map.x_min = low.x() * map.resolution;
  map.y_min = low.y() * map.resolution;
  map.width = static_cast<int>(cells.x());
  map.height = static_cast<int>(cells.y());
  map.occupied.assign(static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height), 0.5F);
  Slicer slicer(options, map);
  const std::size_t stride = 1 + cloud.size() / kMaxRays;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    const Eigen::Vector3d* eye = viewpoint_of(cloud, i);
    if (eye != nullptr && (p - *eye).norm() < options.min_range) continue;
    slicer.add(p);
    if (eye != nullptr && i % stride == 0) slicer.cross(*eye, p);
  }
  if (slicer.write() == 0)
    return Error{"slice: no surface at the laser's height of " + std::to_string(options.height) +
                 " m over the floor"};
  return map;
}

}  // namespace parhelion::semantic
