// Which heights of each plan cell hold points. Internal to the semantic net.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"

namespace parhelion::semantic {

/// Layers of 5 cm over plan cells of 0.25 m (more on very large sites). Immutable after construction.
class SiteColumns {
 public:
  explicit SiteColumns(const cloud::PointCloud<Map>& cloud);

  double cell() const { return cell_; }
  int width() const { return cells_.x(); }
  /// Cell of a point; clamped to the site.
  std::uint32_t cell_of(const Eigen::Vector3f& p) const;
  bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < cells_.x() && y < cells_.y(); }
  std::uint32_t index(int x, int y) const { return static_cast<std::uint32_t>(y * cells_.x() + x); }
  /// Whether a layer that lies within [low, high] (m) holds points.
  bool occupied(std::uint32_t cell, double low, double high) const;

 private:
  static constexpr double kLayer = 0.05;  ///< m
  double cell_ = 0.25, z_low_ = 0;
  Eigen::Vector2f low_ = Eigen::Vector2f::Zero();
  Eigen::Vector2i cells_ = Eigen::Vector2i::Zero();
  std::size_t chunks_ = 1;  ///< of a column
  std::vector<std::uint64_t> layers_;
};

}  // namespace parhelion::semantic
