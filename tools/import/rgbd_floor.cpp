#include "tools/import/rgbd_floor.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

#include "protocols/angle_units.hpp"

namespace parhelion::tools {
namespace {

constexpr int kStride = 8;     ///< pixels between points
constexpr int kBaseline = 4;   ///< pixels to the neighbours used for the normal
constexpr double kBin = 0.02;  ///< m

}  // namespace

void SurfacePoints::add(const DepthMillimetres& depth, const CameraIntrinsics& camera,
                        const Eigen::Isometry3d& T_world_depth) {
  constexpr double farthest = 4;  // m; a Kinect's noise grows with the square of depth
  const auto at = [&](int column, int row) {
    const double z = depth.mm[static_cast<std::size_t>(row) * static_cast<std::size_t>(depth.width) +
                              static_cast<std::size_t>(column)] *
                     1e-3;
    return depth_point(camera, column, row, z);
  };
  for (int row = kBaseline; row + kBaseline < depth.height; row += kStride) {
    for (int column = kBaseline; column + kBaseline < depth.width; column += kStride) {
      const Eigen::Vector3d p = at(column, row);
      const Eigen::Vector3d across = at(column + kBaseline, row) - at(column - kBaseline, row);
      const Eigen::Vector3d down = at(column, row + kBaseline) - at(column, row - kBaseline);
      const double max_gap = 0.1 * p.z();
      const bool hole = p.z() == 0 || p.z() > farthest || across.norm() > max_gap || down.norm() > max_gap;
      const Eigen::Vector3d normal = down.cross(across);
      if (hole || normal.norm() < 1e-9) continue;
      points_.push_back(T_world_depth * p);
      normals_.push_back(T_world_depth.linear() * normal.normalized());
    }
  }
}

std::optional<Eigen::Vector3d> SurfacePoints::refine_up(const Eigen::Vector3d& guess) const {
  constexpr std::size_t enough = 200;
  Eigen::Vector3d up = guess.normalized();
  // From a wide window to a narrow one, so that a rough guess converges to the densest direction near it.
  for (const double window : {40.0, 30.0, 20.0, 15.0, 12.0, 12.0, 12.0, 12.0}) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::size_t n = 0;
    for (const Eigen::Vector3d& normal : normals_) {
      if (normal.dot(up) < std::cos(window * kRadiansPerDegree)) continue;
      sum += normal;
      ++n;
    }
    if (n < enough) return std::nullopt;
    up = sum.normalized();
  }
  return up;
}

std::optional<double> SurfacePoints::lowest_layer(const Eigen::Vector3d& up) const {
  constexpr double supported = 0.03;
  constexpr std::size_t enough = 100;
  std::map<long, std::size_t> layers;
  std::vector<double> heights;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (normals_[i].dot(up) < std::cos(20 * kRadiansPerDegree)) continue;
    heights.push_back(points_[i].dot(up));
    ++layers[std::lround(heights.back() / kBin)];
  }
  const auto count = [&](long layer) {
    std::size_t n = 0;
    for (long near = layer - 1; near <= layer + 1; ++near) {
      const auto found = layers.find(near);
      n += found == layers.end() ? 0 : found->second;
    }
    return n;
  };
  std::size_t densest = 0;
  for (const auto& layer : layers) densest = std::max(densest, count(layer.first));
  const double min_count = std::max(static_cast<double>(enough), supported * static_cast<double>(densest));
  for (const auto& layer : layers) {
    if (static_cast<double>(count(layer.first)) < min_count) continue;
    long peak = layer.first;
    while (count(peak + 1) > count(peak)) ++peak;
    return static_cast<double>(peak) * kBin;
  }
  return std::nullopt;
}

std::optional<SurfacePoints::Floor> SurfacePoints::find_floor(const Eigen::Vector3d& up) const {
  constexpr double widest_lean = 5 * kRadiansPerDegree, wide = 0.5;
  const auto layer = lowest_layer(up);
  if (!layer) return std::nullopt;
  Floor floor{up.normalized(), *layer, 0};
  // The band narrows as the plane converges, since an inclined plane needs a wide one first.
  for (const double within : {0.10, 0.07, 0.05, 0.04, 0.04}) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
    double n = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const bool level = normals_[i].dot(floor.up) > std::cos(20 * kRadiansPerDegree);
      if (!level || std::abs(points_[i].dot(floor.up) - floor.height) > within) continue;
      sum += points_[i];
      products += points_[i] * points_[i].transpose();
      n += 1;
    }
    if (n < 10) break;
    const Eigen::Vector3d mean = sum / n;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(products / n - mean * mean.transpose());
    Eigen::Vector3d normal = spread.eigenvectors().col(0);
    if (normal.dot(up) < 0) normal = -normal;
    const bool wide_enough = spread.eigenvalues()(1) > wide * wide / 12;
    if (wide_enough && normal.dot(up) > std::cos(widest_lean)) floor.up = normal;
    floor.height = mean.dot(floor.up);
  }
  floor.leveled = std::acos(std::clamp(floor.up.dot(up.normalized()), -1.0, 1.0));
  return floor;
}

}  // namespace parhelion::tools
