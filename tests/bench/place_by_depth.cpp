#include "tests/bench/place_by_depth.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "fusion/semantic/texture/depth_raster.hpp"

namespace parhelion::bench {
namespace {

constexpr int kRounds = 20;
constexpr int kPixelStep = 4;
constexpr double kFarthest = 4;     ///< m; structured light is too noisy beyond
constexpr double kPartner = 0.15;   ///< m between what was measured and the surface: more is another thing
constexpr double kMinPairs = 1000;  ///< fewer do not say where the camera was

using Vector6 = Eigen::Matrix<double, 6, 1>;

struct Equations {
  Eigen::Matrix<double, 6, 6> H = Eigen::Matrix<double, 6, 6>::Zero();
  Vector6 g = Vector6::Zero();
  double pairs = 0;
};

/// m, one sigma of a Kinect's depth, and of the surface.
double noise_at(double depth) { return 0.005 + 0.005 * depth * depth; }

Equations equations_of(const semantic::DepthView& view, const semantic::QuadSurface& surface,
                       const Eigen::Isometry3d& T_map_optical) {
  Equations sum;
  const auto seen = semantic::see(surface, view.camera, Transform<Map, CameraOptical>(T_map_optical));
  for (int row = 0; row < view.camera.height; row += kPixelStep) {
    for (int column = 0; column < view.camera.width; column += kPixelStep) {
      const std::size_t at = view.camera.at(column, row);
      const double depth = view.millimetres[at] * 1e-3;
      if (depth <= 0 || depth > kFarthest || seen[at].depth <= 0) continue;
      if (std::abs(static_cast<double>(seen[at].depth) - depth) > kPartner) continue;
      const Eigen::Vector3d ray((column - view.camera.cx) / view.camera.fx,
                                (row - view.camera.cy) / view.camera.fy, 1);
      const Eigen::Vector3d p_map = T_map_optical * Eigen::Vector3d(depth * ray);
      const Eigen::Vector3d on_surface =
          quad_point(surface, seen[at].quad, seen[at].s, seen[at].t).cast<double>();
      const Eigen::Vector3d normal = quad_normal(surface, seen[at].quad).normalized().cast<double>();
      const double error = normal.dot(p_map - on_surface), off = error / (2 * noise_at(depth));
      const double weight = 1 / ((1 + off * off) * noise_at(depth) * noise_at(depth));
      Vector6 J;
      J << normal, (p_map - T_map_optical.translation()).cross(normal);
      sum.H += weight * J * J.transpose();
      sum.g += weight * error * J;
      sum.pairs += 1;
    }
  }
  return sum;
}

}  // namespace

Transform<Map, DepthOptical> place_by_depth(const semantic::DepthView& view,
                                            const semantic::QuadSurface& surface) {
  Eigen::Isometry3d T = view.T_map_optical.isometry();
  for (int round = 0; round < kRounds; ++round) {
    const Equations equations = equations_of(view, surface, T);
    if (equations.pairs < kMinPairs) return view.T_map_optical;
    const Vector6 step = -equations.H.ldlt().solve(equations.g);
    if (!step.allFinite()) return view.T_map_optical;
    const Eigen::Vector3d turn = step.tail<3>();
    if (turn.norm() > 0) T.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * T.linear();
    T.translation() += step.head<3>();
  }
  return Transform<Map, DepthOptical>(T);
}

}  // namespace parhelion::bench
