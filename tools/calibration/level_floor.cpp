#include "tools/calibration/level_floor.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace parhelion::tools {
namespace {

constexpr double kFloorWithin = 0.2;  // m, of z = 0
constexpr double kFloorRange = 4;     // m

/// z = offset + slope_x x + slope_y y of the floor under the robot.
struct FloorPlane {
  double offset = 0, slope_x = 0, slope_y = 0;
  double at(const Eigen::Vector3d& p) const { return offset + slope_x * p.x() + slope_y * p.y(); }
};

std::optional<FloorPlane> fit_floor(const std::vector<Eigen::Vector3d>& points) {
  constexpr std::size_t kMinPoints = 500;
  constexpr double kMinSpread = 0.15;  // m, 1 sigma
  FloorPlane plane;
  for (const double gate : {kFloorWithin, 0.1, 0.05, 0.03, 0.03}) {
    Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    std::size_t count = 0;
    for (const Eigen::Vector3d& p : points) {
      if (std::abs(p.z() - plane.at(p)) > gate) continue;
      const Eigen::Vector3d row(1, p.x(), p.y());
      a += row * row.transpose();
      b += row * p.z();
      ++count;
    }
    if (count < kMinPoints) return std::nullopt;
    const double n = static_cast<double>(count);
    const auto spread = [&](int k) {
      return std::sqrt(std::max(0.0, a(k, k) / n - std::pow(a(0, k) / n, 2)));
    };
    if (spread(1) < kMinSpread || spread(2) < kMinSpread) return std::nullopt;
    const Eigen::Vector3d x = a.ldlt().solve(b);
    plane = {x[0], x[1], x[2]};
  }
  return plane;
}

}  // namespace

double depth_at(const render::DepthPixels& image, int u, int v) {
  const auto index =
      static_cast<std::size_t>(v) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(u);
  return 1e-3 * static_cast<double>(image.millimetres[index]);
}

std::optional<Eigen::Isometry3d> level_by_floor(const std::vector<render::DepthPixels>& images,
                                                const render::Lens& lens,
                                                const Eigen::Isometry3d& T_base_optical) {
  if (images.empty()) return std::nullopt;
  constexpr int kSamples = 20;  // each way
  const int width = images.front().width, height = images.front().height;
  const int step_u = 1 + width / kSamples, step_v = 1 + height / kSamples;
  std::vector<Eigen::Vector3d> points;
  for (int v = 0; v < height; v += step_v) {
    for (int u = 0; u < width; u += step_u) {
      const auto direction = lens.unproject({u, v});
      if (!direction || !(direction->z() > 0)) continue;
      for (const render::DepthPixels& image : images) {
        const double z = depth_at(image, u, v);
        if (!(z > 0 && z < kFloorRange)) continue;
        const Eigen::Vector3d point = T_base_optical * Eigen::Vector3d(*direction * (z / direction->z()));
        if (std::abs(point.z()) < kFloorWithin) points.push_back(point);
      }
    }
  }
  const auto floor = fit_floor(points);
  if (!floor) return std::nullopt;
  // The plane's normal becomes vertical, its point below the base's origin the origin.
  const Eigen::Vector3d up = Eigen::Vector3d(-floor->slope_x, -floor->slope_y, 1).normalized();
  Eigen::Isometry3d T_level_base = Eigen::Isometry3d::Identity();
  T_level_base.linear() = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  T_level_base.translation() = T_level_base.linear() * Eigen::Vector3d(0, 0, -floor->offset);
  Eigen::Isometry3d levelled = T_level_base * T_base_optical;
  levelled.translation().head<2>() = T_base_optical.translation().head<2>();
  return levelled;
}

}  // namespace parhelion::tools
