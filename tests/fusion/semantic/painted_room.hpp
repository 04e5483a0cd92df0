// Images of a made-up room whose walls are painted: a texture with known truth.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "fusion/semantic/texture/views.hpp"
#include "protocols/model.hpp"

namespace parhelion::test {

/// A room from (0, 0, 0) to (4, 3, 2.5) m with a box in it, painted with waves and stripes that differ from
/// place to place.
class PaintedRoom {
 public:
  static constexpr int kWidth = 200, kHeight = 150;

  static semantic::Pinhole camera() { return {kWidth, kHeight, 160, 160, 99.5, 74.5}; }

  /// A camera at a place (m) that looks along yaw and downwards by pitch (rad).
  template <class Optical>
  static Transform<Map, Optical> pose(const Eigen::Vector3d& place, double yaw, double pitch) {
    Eigen::Matrix3d R_base_optical;
    R_base_optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    const Eigen::Matrix3d R = (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()))
                                  .toRotationMatrix() *
                              R_base_optical;
    return {Eigen::Quaterniond(R), place};
  }

  struct Hit {
    Eigen::Vector3d point;
    double depth;  ///< m along the optical axis
    bool walker = false;
  };
  /// Somebody stands at `walker` (m); nullptr: nobody.
  static Hit cast(const Transform<Map, CameraOptical>& T, double column, double row,
                  const Eigen::Vector2d* walker = nullptr) {
    const semantic::Pinhole c = camera();
    const Eigen::Vector3d ray =
        T.rotation() * Eigen::Vector3d((column - c.cx) / c.fx, (row - c.cy) / c.fy, 1);
    const Eigen::Vector3d from = T.translation();
    double depth = leave(from, ray, kLow, kHigh);
    if (const double box = enter(from, ray, kBoxLow, kBoxHigh); box > 0) depth = std::min(depth, box);
    const double room = depth;
    if (walker != nullptr) {
      const Eigen::Vector3d low(walker->x() - 0.2, walker->y() - 0.2, 0),
          high = low + Eigen::Vector3d(0.4, 0.4, 1.7);
      if (const double somebody = enter(from, ray, low, high); somebody > 0)
        depth = std::min(depth, somebody);
    }
    return {from + depth * ray, depth, depth < room};
  }

  /// sRGB, 0..255.
  static Eigen::Vector3d paint(const Eigen::Vector3d& p) {
    const double stripes = std::sin(14 * p.x() + 5 * p.z()) * std::sin(11 * p.y() - 9 * p.z());
    return {120 + 55 * stripes + 25 * std::sin(2 * p.x() + p.z()),
            115 + 50 * stripes - 30 * std::sin(2 * p.y() - p.z()),
            110 + 40 * stripes + 30 * std::sin(p.x() - 2 * p.y())};
  }

  static Eigen::Vector3d shirt() { return {235, 40, 200}; }

  static semantic::ColourView colour(const Transform<Map, CameraOptical>& T, double exposure = 1,
                                     const Eigen::Vector2d* walker = nullptr) {
    semantic::ColourView view{camera(), T, {}};
    for (int row = 0; row < kHeight; ++row) {
      for (int column = 0; column < kWidth; ++column) {
        const Hit hit = cast(T, column, row, walker);
        for (const double value : Eigen::Vector3d(exposure * (hit.walker ? shirt() : paint(hit.point))))
          view.rgb.push_back(static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 255.0))));
      }
    }
    return view;
  }

  /// With noise of triangulated depth: 3 mm at 1 m, growing with the square of the distance.
  static semantic::DepthView depth(const Transform<Map, CameraOptical>& T, std::mt19937& random,
                                   const Eigen::Vector2d* walker = nullptr) {
    semantic::DepthView view{camera(), T.as<Map, DepthOptical>(), {}};
    std::normal_distribution<double> noise;
    for (int row = 0; row < kHeight; ++row) {
      for (int column = 0; column < kWidth; ++column) {
        const double z = cast(T, column, row, walker).depth;
        view.millimetres.push_back(
            static_cast<std::uint16_t>(std::lround(1000 * (z + 0.003 * z * z * noise(random)))));
      }
    }
    return view;
  }

  /// m, from a point to the nearest surface.
  static double distance(const Eigen::Vector3d& p) {
    const double room = std::min((p - kLow).cwiseAbs().minCoeff(), (kHigh - p).cwiseAbs().minCoeff());
    const Eigen::Vector3d outside = (kBoxLow - p).cwiseMax(p - kBoxHigh);
    const double box = outside.maxCoeff() <= 0 ? -outside.maxCoeff() : outside.cwiseMax(0).norm();
    return std::min(room, box);
  }

  /// Places on a round through the room, looking across it.
  static std::vector<Transform<Map, CameraOptical>> round(int count) {
    std::vector<Transform<Map, CameraOptical>> poses;
    for (int i = 0; i < count; ++i) {
      const double turn = 2 * std::numbers::pi * i / count;
      poses.push_back(pose<CameraOptical>(
          {2 + 0.9 * std::cos(turn), 1.5 + 0.7 * std::sin(turn), 1.1 + 0.2 * std::sin(3 * turn)},
          turn + std::numbers::pi, 0.15 + 0.1 * std::cos(2 * turn)));
    }
    return poses;
  }

  static SemanticModel model() {
    SemanticModel model;
    const auto add = [&](const char* name, EntityLabel label, const Eigen::Vector3d& low,
                         const Eigen::Vector3d& high) {
      ModelEntity entity;
      entity.name = name;
      entity.label = label;
      const Eigen::Vector3d middle = (low + high) / 2;
      entity.T_map_body = {Eigen::Quaterniond::Identity(), middle};
      entity.size = high - low;
      model.entities.push_back(entity);
    };
    constexpr double t = 0.1;
    add("floor", EntityLabel::floor, {0, 0, -t}, {4, 3, 0});
    add("ceiling", EntityLabel::ceiling, {0, 0, 2.5}, {4, 3, 2.5 + t});
    add("south", EntityLabel::wall, {0, -t, 0}, {4, 0, 2.5});
    add("north", EntityLabel::wall, {0, 3, 0}, {4, 3 + t, 2.5});
    add("west", EntityLabel::wall, {-t, 0, 0}, {0, 3, 2.5});
    add("east", EntityLabel::wall, {4, 0, 0}, {4 + t, 3, 2.5});
    add("box", EntityLabel::unknown, kBoxLow, kBoxHigh);
    return model;
  }

 private:
  /// How far along the ray it leaves a box from inside.
  static double leave(const Eigen::Vector3d& from, const Eigen::Vector3d& ray, const Eigen::Vector3d& low,
                      const Eigen::Vector3d& high) {
    double depth = 1e9;
    for (int axis = 0; axis < 3; ++axis) {
      if (ray[axis] == 0) continue;
      depth = std::min(depth, ((ray[axis] > 0 ? high : low)[axis] - from[axis]) / ray[axis]);
    }
    return depth;
  }
  /// How far along the ray it enters a box; 0: it does not.
  static double enter(const Eigen::Vector3d& from, const Eigen::Vector3d& ray, const Eigen::Vector3d& low,
                      const Eigen::Vector3d& high) {
    double in = 0, out = 1e9;
    for (int axis = 0; axis < 3; ++axis) {
      const double a = (low[axis] - from[axis]) / ray[axis], b = (high[axis] - from[axis]) / ray[axis];
      in = std::max(in, std::min(a, b));
      out = std::min(out, std::max(a, b));
    }
    return in < out ? in : 0;
  }

  static inline const Eigen::Vector3d kLow{0, 0, 0}, kHigh{4, 3, 2.5};
  static inline const Eigen::Vector3d kBoxLow{1.6, 1.2, 0}, kBoxHigh{2.3, 1.7, 0.7};
};

}  // namespace parhelion::test
