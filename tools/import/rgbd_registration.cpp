#include "tools/import/rgbd_registration.hpp"

#include <cmath>

#include "protocols/angle_units.hpp"
#include "tools/import/rgbd_floor.hpp"

namespace parhelion::tools {
namespace {

constexpr int kEdgeStep = 100;  ///< mm between neighbours

/// Magnitude of the Sobel gradient; 0 along the border.
std::vector<float> sobel(const GreyPixels& grey) {
  const auto width = static_cast<std::size_t>(grey.width), height = static_cast<std::size_t>(grey.height);
  std::vector<float> gradient(width * height, 0.0F);
  for (std::size_t row = 1; row + 1 < height; ++row) {
    for (std::size_t column = 1; column + 1 < width; ++column) {
      const auto at = [&](std::size_t r, std::size_t c) {
        return static_cast<float>(grey.grey[r * width + c]);
      };
      const std::size_t r = row, c = column;
      const float dx = at(r - 1, c + 1) + 2 * at(r, c + 1) + at(r + 1, c + 1) - at(r - 1, c - 1) -
                       2 * at(r, c - 1) - at(r + 1, c - 1);
      const float dy = at(r + 1, c - 1) + 2 * at(r + 1, c) + at(r + 1, c + 1) - at(r - 1, c - 1) -
                       2 * at(r - 1, c) - at(r - 1, c + 1);
      gradient[r * width + c] = std::sqrt(dx * dx + dy * dy);
    }
  }
  return gradient;
}

}  // namespace

void DepthRegistration::add(const DepthMillimetres& depth, const CameraIntrinsics& depth_camera,
                            const GreyPixels& colour) {
  Frame& frame = frames_.emplace_back();
  frame.width = colour.width;
  frame.height = colour.height;
  frame.gradient = sobel(colour);
  const auto at = [&](int row, int column) {
    return static_cast<int>(depth.mm[static_cast<std::size_t>(row) * static_cast<std::size_t>(depth.width) +
                                     static_cast<std::size_t>(column)]);
  };
  for (int row = 1; row + 1 < depth.height; ++row) {
    for (int column = 1; column + 1 < depth.width; ++column) {
      const int here = at(row, column);
      if (here == 0) continue;
      bool edge = false;
      for (const int beside :
           {at(row, column - 1), at(row, column + 1), at(row - 1, column), at(row + 1, column)}) {
        edge = edge || beside - here > kEdgeStep;
      }
      if (edge) frame.edges.push_back(depth_point(depth_camera, column, row, here * 1e-3));
    }
  }
}

double DepthRegistration::score(const CameraIntrinsics& camera,
                                const Eigen::Isometry3d& T_colour_depth) const {
  double sum = 0;
  std::size_t n = 0;
  for (const Frame& frame : frames_) {
    for (const Eigen::Vector3d& edge : frame.edges) {
      const Eigen::Vector3d p = T_colour_depth * edge;
      if (p.z() <= 0) continue;
      const long u = std::lround(camera.fx * p.x() / p.z() + camera.cx);
      const long v = std::lround(camera.fy * p.y() / p.z() + camera.cy);
      if (u < 0 || v < 0 || u >= frame.width || v >= frame.height) continue;
      sum += static_cast<double>(
          frame.gradient[static_cast<std::size_t>(v) * static_cast<std::size_t>(frame.width) +
                         static_cast<std::size_t>(u)]);
      ++n;
    }
  }
  return n == 0 ? 0 : sum / static_cast<double>(n);
}

Eigen::Isometry3d DepthRegistration::refine(const CameraIntrinsics& camera,
                                            const Eigen::Isometry3d& T_colour_depth) const {
  Eigen::Isometry3d best = T_colour_depth;
  Eigen::Isometry3d unturned = Eigen::Isometry3d::Identity();
  unturned.translation() = T_colour_depth.translation();
  double best_score = score(camera, best);
  if (const double other = score(camera, unturned); other > best_score) {
    best_score = other;
    best = unturned;
  }
  for (double step = 0.4; step > 0.02; step /= 2) {
    for (int round = 0; round < 2; ++round) {
      for (int axis = 0; axis < 3; ++axis) {
        for (const double sign : {-1.0, 1.0}) {
          Eigen::Isometry3d turned = best;
          turned.linear() =
              Eigen::AngleAxisd(sign * step * kRadiansPerDegree, Eigen::Vector3d::Unit(axis)) * best.linear();
          const double as_turned = score(camera, turned);
          if (as_turned <= best_score) continue;
          best_score = as_turned;
          best = turned;
        }
      }
    }
  }
  return best;
}

}  // namespace parhelion::tools
