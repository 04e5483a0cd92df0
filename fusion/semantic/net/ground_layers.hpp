// The upper sides of floors, ramps and low things as layers of plan cells, with the slope around each.
// Internal to the semantic net.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"

namespace parhelion::semantic {

/// Sums over points, from which the plane z = z0 + slope * (x, y) follows by least squares.
struct PlaneSums {
  double count = 0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();

  void add(const Eigen::Vector3d& p);
  PlaneSums& operator+=(const PlaneSums& other);
  Eigen::Vector3d mean() const { return sum / count; }
};

struct SlopedPlane {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< m, on the plane
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();   ///< m of height per metre along x and y
  double rms = 0;                                    ///< m, of the points' heights over it

  double height(const Eigen::Vector2d& p) const { return centre.z() + slope.dot(p - centre.head<2>()); }
};

/// nullopt: the points are too few, or in a row.
std::optional<SlopedPlane> plane_through(const PlaneSums& sums);

class GroundLayers {
 public:
  static constexpr double kCell = 0.25;  ///< m, of the plan

  struct Layer {
    int x = 0, y = 0;  ///< plan cell
    PlaneSums sums;
    double floor = 0;                   ///< number of its points labelled floor
    std::optional<SlopedPlane> around;  ///< through it and the layers of the eight cells around
    double z() const { return sums.sum.z() / sums.count; }
    bool is_floor() const { return 2 * floor > sums.count; }
  };

  /// Of the points labelled floor or unknown; what is higher than two slices of 10 cm is no layer.
  GroundLayers(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels);

  const std::vector<Layer>& layers() const { return layers_; }          ///< by cell, ascending height
  std::pair<std::uint32_t, std::uint32_t> in_cell(int x, int y) const;  ///< first and end of its layers
  static Eigen::Vector2i cell_of(const Eigen::Vector2d& p) { return (p / kCell).array().floor().cast<int>(); }
  /// Calls visit(layer) for the layers of the eight cells around one.
  template <class Visit>
  void for_each_beside(const Layer& layer, Visit&& visit) const {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (dx == 0 && dy == 0) continue;
        const auto [first, end] = in_cell(layer.x + dx, layer.y + dy);
        for (std::uint32_t i = first; i < end; ++i) visit(i);
      }
    }
  }

 private:
  static std::uint64_t key(int x, int y) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32 | static_cast<std::uint32_t>(y);
  }
  void find_slopes();

  std::vector<Layer> layers_;
  std::unordered_map<std::uint64_t, std::pair<std::uint32_t, std::uint32_t>> cells_;
};

}  // namespace parhelion::semantic
