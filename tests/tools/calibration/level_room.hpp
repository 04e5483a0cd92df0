// Generated rooms with depth images and scans of a robot whose laser is not where it is described.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "tools/calibration/laser_level.hpp"

namespace parhelion::test {

enum class RoomStyle { boxes, office, warehouse, empty_hall };

/// What of the robot differs from its description, and how well it measures.
struct LevelTruth {
  double laser_height = 0.31, laser_pitch = 0, laser_roll = 0;  ///< m, rad, rad
  double camera_higher = 0, camera_pitch_more = 0;              ///< m, rad
  double camera_height = 0.6, camera_down = 0.2;                ///< m, rad, as described
};

/// Laser 0.12 to 0.6 m high, tilted by 1.5 degrees (1 sigma); camera 0.4 to 0.9 m high, 5 to 20 degrees down,
/// mounted to 1 cm and 0.7 degrees.
inline LevelTruth random_truth(std::uint32_t seed) {
  std::mt19937 random(seed + 7000);
  std::uniform_real_distribution<double> u(0, 1);
  std::normal_distribution<double> n;
  const auto degrees = [](double value) { return value * std::numbers::pi / 180; };
  LevelTruth truth;
  truth.laser_height = 0.12 + 0.48 * u(random);
  truth.laser_pitch = degrees(std::clamp(1.5 * n(random), -3.5, 3.5));
  truth.laser_roll = degrees(std::clamp(1.5 * n(random), -3.5, 3.5));
  truth.camera_higher = 0.01 * n(random);
  truth.camera_pitch_more = degrees(0.7 * n(random));
  truth.camera_height = 0.4 + 0.5 * u(random);
  truth.camera_down = degrees(5 + 15 * u(random));
  return truth;
}

class LevelRoom {
 public:
  LevelRoom(std::uint32_t seed, RoomStyle style) : random_(seed) {
    half_ = style == RoomStyle::warehouse    ? Eigen::Vector2d(8, 2.5)
            : style == RoomStyle::empty_hall ? Eigen::Vector2d(5, 4)
                                             : Eigen::Vector2d(4, 3);
    add(0, 0, 0, {2 * half_.x() + 2, 2 * half_.y() + 2}, -0.2, 0);
    for (const double side : {-1.0, 1.0}) {
      add(side * (half_.x() + 0.1), 0, 0, {0.2, 2 * half_.y() + 0.4}, 0, 3);
      add(0, side * (half_.y() + 0.1), 0, {2 * half_.x() + 0.4, 0.2}, 0, 3);
    }
    if (style == RoomStyle::boxes) furnish(60, [this] { box(); });
    if (style == RoomStyle::office) furnish(22, [this] { furniture(); });
    if (style == RoomStyle::warehouse) furnish(30, [this] { goods(); });
  }

  Eigen::Vector2d half() const { return half_; }

  /// m along `direction` (in units of its length) to the first surface.
  double cast(const Eigen::Vector3d& from, const Eigen::Vector3d& direction) const {
    double nearest = 1e9;
    for (const Solid& solid : solids_) {
      const Eigen::Vector2d at = solid.R_solid_map * (from.head<2>() - solid.centre);
      const Eigen::Vector2d along = solid.R_solid_map * direction.head<2>();
      double enter = 0, leave = nearest;
      const auto slab = [&](double p, double d, double low, double high) {
        const double a = (low - p) / d, b = (high - p) / d;
        enter = std::max(enter, std::min(a, b)), leave = std::min(leave, std::max(a, b));
      };
      slab(at.x(), along.x(), -solid.half.x(), solid.half.x());
      slab(at.y(), along.y(), -solid.half.y(), solid.half.y());
      slab(from.z(), direction.z(), solid.low, solid.high);
      if (enter > 0 && enter < leave) nearest = enter;
    }
    return nearest;
  }

  /// A robot at `p` does not stand in a thing.
  bool is_free(const Eigen::Vector2d& p, double radius) const {
    if (std::abs(p.x()) > half_.x() - radius || std::abs(p.y()) > half_.y() - radius) return false;
    for (std::size_t i = 5; i < solids_.size(); ++i) {
      const Eigen::Vector2d at = solids_[i].R_solid_map * (p - solids_[i].centre);
      if ((at.cwiseAbs() - solids_[i].half).cwiseMax(0).norm() < radius) return false;
    }
    return true;
  }

 private:
  struct Solid {
    Eigen::Vector2d centre, half;
    Eigen::Matrix2d R_solid_map;
    double low, high;
  };

  double draw(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }

  void add(double x, double y, double yaw, const Eigen::Vector2d& size, double low, double high) {
    solids_.push_back({{x, y}, 0.5 * size, Eigen::Rotation2Dd(-yaw).toRotationMatrix(), low, high});
  }
  /// In the frame of the thing that is being placed.
  void part(double x, double y, const Eigen::Vector2d& size, double low, double high) {
    const Eigen::Vector2d at = place_ + Eigen::Rotation2Dd(yaw_) * Eigen::Vector2d(x, y);
    add(at.x(), at.y(), yaw_, size, low, high);
  }

  template <class Place>
  void furnish(int count, const Place& place) {
    for (int i = 0; i < count; ++i) {
      do place_ = {draw(-half_.x(), half_.x()) * 0.92, draw(-half_.y(), half_.y()) * 0.92};
      while (place_.norm() < 1.2);
      yaw_ = draw(-3, 3);
      place();
    }
  }

  void box() {
    const double low = draw(0, 1) < 0.25 ? draw(0.2, 0.6) : 0;
    part(0, 0, {draw(0.2, 0.8), draw(0.2, 0.8)}, low, low + draw(0.1, 0.7));
  }
  void legs(const Eigen::Vector2d& size, double thickness, double top) {
    for (const double x : {-0.5, 0.5})
      for (const double y : {-0.5, 0.5})
        part(x * (size.x() - thickness), y * (size.y() - thickness), {thickness, thickness}, 0, top);
  }
  void furniture() {
    const double kind = draw(0, 1);
    if (kind < 0.2) {  // a table
      const Eigen::Vector2d size(draw(0.8, 1.6), draw(0.6, 0.9));
      const double top = draw(0.45, 0.78);
      part(0, 0, size, top - 0.03, top);
      legs(size, 0.05, top - 0.03);
    } else if (kind < 0.5) {  // a chair
      const double seat = draw(0.4, 0.5);
      part(0, 0, {0.42, 0.42}, seat - 0.05, seat);
      part(-0.2, 0, {0.03, 0.42}, seat, seat + 0.45);
      legs({0.42, 0.42}, 0.04, seat - 0.05);
    } else if (kind < 0.65) {  // a shelf
      const double board = draw(0.25, 0.42), width = draw(0.6, 1.2);
      part(-0.15, 0, {0.02, width}, 0, 1.8);
      for (const double y : {-0.5, 0.5}) part(0, y * width, {0.3, 0.02}, 0, 1.8);
      for (double z = 0.08; z < 1.8; z += board) part(0, 0, {0.3, width}, z - 0.02, z);
    } else if (kind < 0.75) {  // a sofa
      const double seat = draw(0.35, 0.45), width = draw(1.2, 1.9);
      part(0, 0, {0.8, width}, 0.1, seat);
      part(-0.35, 0, {0.15, width}, seat, seat + 0.4);
    } else {  // a bin, a crate, a drawer unit
      part(0, 0, {draw(0.2, 0.5), draw(0.25, 0.6)}, 0, draw(0.15, 0.65));
    }
  }
  void goods() {
    const double kind = draw(0, 1);
    if (kind < 0.4) {  // a pallet with a load
      part(0, 0, {0.8, 1.2}, 0.1, 0.144);
      for (const double y : {-0.55, 0.0, 0.55}) part(0, y, {0.8, 0.1}, 0, 0.1);
      if (draw(0, 1) < 0.6) part(0, 0, {draw(0.5, 0.8), draw(0.6, 1.2)}, 0.144, 0.144 + draw(0.1, 1));
    } else if (kind < 0.6) {  // a rack
      const double width = draw(1, 2), first = draw(0.1, 0.4);
      legs({0.6, width}, 0.08, 2);
      for (double z = first; z < 2; z += 0.6) part(0, 0, {0.6, width}, z - 0.06, z);
    } else if (kind < 0.8) {  // steps
      const double rise = draw(0.12, 0.2);
      for (int i = 0; i < 3; ++i) part(0.28 * i, 0, {0.28, 0.8}, 0, rise * (i + 1));
    } else {
      part(0, 0, {draw(0.3, 0.7), draw(0.3, 0.7)}, 0, draw(0.15, 1.2));
    }
  }

  std::mt19937 random_;
  Eigen::Vector2d half_, place_ = Eigen::Vector2d::Zero();
  double yaw_ = 0;
  std::vector<Solid> solids_;
};

inline Eigen::Isometry3d level_pose(double x, double y, double z, double pitch, double roll, double yaw) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(x, y, z);
  pose.linear() =
      (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  return pose;
}

/// As described: laser level and 0.25 m high.
inline RobotDescription level_robot(const LevelTruth& truth) {
  RobotDescription robot;
  LaserDescription& laser = robot.laser.emplace();
  laser.T_base_laser = Transform<Base, Laser>(level_pose(0.2, 0, 0.25, 0, 0, 0));
  laser.convention.range_max = 20;
  DepthCameraDescription& depth = robot.depth.emplace();
  depth.intrinsics.width = 160, depth.intrinsics.height = 120;
  depth.intrinsics.fx = depth.intrinsics.fy = 120;
  depth.intrinsics.cx = 79.5, depth.intrinsics.cy = 59.5;
  Eigen::Matrix3d R_body_optical;
  R_body_optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  Eigen::Isometry3d optical = level_pose(0.1, 0.05, truth.camera_height, truth.camera_down, 0, 0);
  optical.linear() = optical.linear() * R_body_optical;
  depth.T_base_optical = Transform<Base, DepthOptical>(optical);
  return robot;
}

/// A depth image with noise that grows with the square of the range, pixels between two surfaces at edges,
/// and nothing beyond 6 m.
inline render::DepthPixels level_image(const LevelRoom& room, const Eigen::Isometry3d& T_map_optical,
                                       const CameraIntrinsics& c, std::mt19937& random) {
  std::normal_distribution<double> noise;
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<double> z;
  for (int v = 0; v < c.height; ++v) {
    for (int u = 0; u < c.width; ++u) {
      const Eigen::Vector3d ray((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1);
      z.push_back(room.cast(T_map_optical.translation(), T_map_optical.linear() * ray));
    }
  }
  render::DepthPixels image{c.width, c.height, {}};
  for (std::size_t i = 0; i < z.size(); ++i) {
    double depth = z[i];
    const std::size_t beside = uniform(random) < 0.5 ? i + 1 : i + static_cast<std::size_t>(c.width);
    if (beside < z.size() && std::abs(z[beside] - depth) > 0.1) {
      const double kind = uniform(random);
      if (kind < 0.3) depth += uniform(random) * (z[beside] - depth);
      if (kind > 0.9) depth = 0;
    }
    depth += 0.003 * depth * depth * noise(random);
    image.millimetres.push_back(depth > 0 && depth < 6 ? static_cast<std::uint16_t>(1e3 * depth) : 0);
  }
  return image;
}

/// Adds images and scans of a drive from place to place.
inline void drive_level(std::uint32_t seed, RoomStyle style, const LevelTruth& truth,
                        tools::LaserLevelFit& fit, int images = 100) {
  const LevelRoom room(seed, style);
  std::mt19937 random(seed + 1000);
  std::normal_distribution<double> noise;
  std::uniform_real_distribution<double> uniform(-1, 1);
  const RobotDescription described = level_robot(truth);
  Eigen::Isometry3d laser = described.laser->T_base_laser.isometry();
  laser.translation().z() = truth.laser_height;
  laser.linear() = level_pose(0, 0, 0, truth.laser_pitch, truth.laser_roll, 0).linear() * laser.linear();
  Eigen::Isometry3d camera = described.depth->T_base_optical.isometry();
  camera.translation().z() += truth.camera_higher;
  camera.linear() = level_pose(0, 0, 0, truth.camera_pitch_more, 0, 0).linear() * camera.linear();
  struct Taken {
    render::DepthPixels image;
    Scan scan;
    Pose2 T_map_image, T_map_scan;
  };
  std::vector<Taken> taken;
  Eigen::Vector2d at(0, 0);
  double yaw = uniform(random) * 3;
  for (int i = 0; i < images; ++i) {
    // Forward where that is free, else a turn.
    const Eigen::Vector2d next = at + 0.15 * Eigen::Vector2d(std::cos(yaw), std::sin(yaw));
    if (room.is_free(next, 0.3))
      at = next, yaw += 0.15 * uniform(random);
    else
      yaw += 0.35;
    const Eigen::Isometry3d base = level_pose(at.x(), at.y(), 0, 0, 0, yaw);
    const auto image = level_image(room, base * camera, described.depth->intrinsics, random);
    // The robot moves by a few centimetres until the scan, and its path is known to 5 mm and 3 mrad.
    const Pose2 moved{0.02, -0.01, 0.01};
    const Pose2 T_map_image{at.x(), at.y(), yaw};
    const Pose2 error{0.005 * noise(random), 0.005 * noise(random), 0.003 * noise(random)};
    const Eigen::Isometry3d at_scan = base * level_pose(moved.x, moved.y, 0, 0, 0, moved.yaw) * laser;
    Scan scan;
    scan.angle_min = -1.2F;
    scan.angle_increment = 0.01F;
    for (int beam = 0; beam <= 240; ++beam) {
      const double angle = -1.2 + 0.01 * beam;
      const double range = room.cast(at_scan.translation(),
                                     at_scan.linear() * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0));
      scan.ranges.push_back(static_cast<float>(range + 0.01 * noise(random)));
    }
    taken.push_back({image, scan, T_map_image, T_map_image * moved * error});
  }
  for (std::size_t i = 0; i < taken.size(); ++i) {
    std::vector<tools::PlacedScan> scans;
    for (const int apart : {0, -20, -10, 10, 20}) {
      const std::size_t j = i + static_cast<std::size_t>(apart);
      if (j < taken.size()) scans.push_back({&taken[j].scan, taken[j].T_map_scan});
    }
    fit.add(taken[i].image, taken[i].T_map_image, scans);
  }
}

}  // namespace parhelion::test
