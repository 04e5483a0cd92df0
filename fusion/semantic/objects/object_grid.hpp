// The points that are no part of the building, in cubes sorted into columns of the plan. Internal to the
// objects.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "fusion/cloud/point_cloud.hpp"
#include "protocols/model.hpp"

namespace parhelion::semantic {

inline constexpr std::uint32_t kNone = ~std::uint32_t{0};

/// A cube that holds points.
struct ObjectCube {
  Eigen::Vector3i at = Eigen::Vector3i::Zero();
  std::uint32_t begin = 0, end = 0;  ///< of its points, in ObjectGrid::points()
  float z = 0;                       ///< m, mean height of its points
};

/// Immutable after construction. Cubes are sorted by y, x, z: those of a column follow each other.
class ObjectGrid {
 public:
  /// Points labelled unknown. `cell`: m.
  ObjectGrid(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels,
             const std::vector<ModelEntity>& entities, double cell);

  static constexpr double kFar = 1e6;  ///< cubes from the origin: points farther away are left out

  double cell() const { return cell_; }
  const std::vector<ObjectCube>& cubes() const { return cubes_; }
  std::span<const std::uint32_t> points_of(std::uint32_t cube) const {
    return std::span(points_).subspan(cubes_[cube].begin, cubes_[cube].end - cubes_[cube].begin);
  }
  /// The cubes [first, last) of a column; empty where it holds none.
  std::pair<std::uint32_t, std::uint32_t> column(int x, int y) const;
  /// Index of the cube at that place; kNone: empty.
  std::uint32_t find(const Eigen::Vector3i& at) const;
  /// m, height of the cube's middle over the floor below it.
  double height(std::uint32_t cube) const { return static_cast<double>(cubes_[cube].z) - floor_[cube]; }
  double floor(std::uint32_t cube) const { return floor_[cube]; }
  Eigen::Vector2d plan(std::uint32_t cube) const {
    return cell_ * (cubes_[cube].at.head<2>().cast<double>().array() + 0.5);
  }

 private:
  void find_floors(const std::vector<ModelEntity>& entities);
  static std::uint64_t key_of(int x, int y) {
    return static_cast<std::uint64_t>(static_cast<std::uint32_t>(y)) << 32 | static_cast<std::uint32_t>(x);
  }

  double cell_;
  std::vector<ObjectCube> cubes_;
  std::vector<std::uint32_t> points_;  ///< of the cloud, by cube
  std::vector<double> floor_;          ///< m, per cube
  std::unordered_map<std::uint64_t, std::pair<std::uint32_t, std::uint32_t>> columns_;
};

}  // namespace parhelion::semantic
