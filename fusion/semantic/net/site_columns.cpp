#include "fusion/semantic/net/site_columns.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "fusion/cloud/floor_index.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kMaxCells = 8e6;
constexpr double kTallest = 100;  ///< m

}  // namespace

SiteColumns::SiteColumns(const cloud::PointCloud<Map>& cloud) {
  Eigen::AlignedBox3f bounds;
  for (const Eigen::Vector3f& p : cloud.points) bounds.extend(p);
  if (bounds.isEmpty()) return;
  low_ = bounds.min().head<2>();
  const Eigen::Vector2d size = bounds.sizes().head<2>().cast<double>();
  while (size.x() * size.y() / (cell_ * cell_) > kMaxCells) cell_ *= 2;
  cells_ = (size / cell_).array().floor().cast<int>() + 1;
  z_low_ = static_cast<double>(bounds.min().z());
  const double height = std::min(kTallest, static_cast<double>(bounds.sizes().z()));
  chunks_ = static_cast<std::size_t>(height / kLayer / 64) + 1;
  layers_.assign(static_cast<std::size_t>(cells_.x()) * static_cast<std::size_t>(cells_.y()) * chunks_, 0);
  for (const Eigen::Vector3f& p : cloud.points) {
    const double layer = (static_cast<double>(p.z()) - z_low_) / kLayer;
    if (layer < 0 || layer >= 64.0 * static_cast<double>(chunks_)) continue;
    const auto k = static_cast<std::size_t>(layer);
    layers_[cell_of(p) * chunks_ + k / 64] |= std::uint64_t{1} << (k % 64);
  }
}

std::uint32_t SiteColumns::cell_of(const Eigen::Vector3f& p) const {
  const Eigen::Vector2d at = (p.head<2>() - low_).cast<double>() / cell_;
  return index(std::clamp(cloud::floor_index(at.x()), 0, cells_.x() - 1),
               std::clamp(cloud::floor_index(at.y()), 0, cells_.y() - 1));
}

bool SiteColumns::occupied(std::uint32_t cell, double low, double high) const {
  const auto from = static_cast<long>(std::ceil((low - z_low_) / kLayer - 1e-6));
  const auto to = std::min(static_cast<long>(std::floor((high - z_low_) / kLayer + 1e-6)),
                           64 * static_cast<long>(chunks_));
  for (long k = std::max(from, 0L); k < to; ++k) {
    const std::uint64_t word = layers_[cell * chunks_ + static_cast<std::size_t>(k / 64)];
    if ((word >> (k % 64) & 1) != 0) return true;
  }
  return false;
}

}  // namespace parhelion::semantic
