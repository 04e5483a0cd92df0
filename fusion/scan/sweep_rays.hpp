// The rays of a sweep in the map frame, and rotations at a constant rate over it.
#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "fusion/scan/ray_caster.hpp"

namespace parhelion::scan {

/// R_a_b(s) between two orientations along the shortest arc, as in interpolate(): R_start * Rot(axis, s *
/// angle).
class RotationSweep {
 public:
  RotationSweep() = default;
  RotationSweep(const Eigen::Matrix3d& R_start, const Eigen::Matrix3d& R_end);

  double angle() const { return angle_; }                ///< rad, 0..pi
  const Eigen::Vector3d& axis() const { return axis_; }  ///< in b
  Eigen::Matrix3d at(double s) const;

 private:
  Eigen::Matrix3d R_start_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d axis_ = Eigen::Vector3d::UnitZ();
  double angle_ = 0;
  // R_start * K and R_start * K^2, K the cross product with the axis.
  Eigen::Matrix3d across_ = Eigen::Matrix3d::Zero(), back_ = Eigen::Matrix3d::Zero();
};

/// Rays of one sweep. Memory is reused from sweep to sweep.
class SweepRays {
 public:
  void set(const LaserMotion& laser, const BeamSet& beams);

  std::size_t size() const { return origin_.size(); }
  double time(std::size_t i) const { return double{time_[i]}; }
  const Eigen::Vector3d& origin(std::size_t i) const { return origin_[i]; }        ///< map, m
  const Eigen::Vector3d& direction(std::size_t i) const { return direction_[i]; }  ///< map, unit length

  /// The laser half-way through the sweep, and its rotation from there: half of the whole angle, and the
  /// largest tilt of its plane within that; rad.
  const Eigen::Vector3d& start() const { return start_; }
  const Eigen::Vector3d& end() const { return end_; }
  const Eigen::Matrix3d& R_map_middle() const { return R_map_middle_; }
  double half_turn() const { return half_turn_; }
  double half_tilt() const { return half_tilt_; }

 private:
  /// Whether the rays are those of this sweep; bodies and building are cast one after the other over the same
  /// rays.
  bool holds(const LaserMotion& laser, const BeamSet& beams) const;
  bool holds_angles(const BeamSet& beams) const;
  void set_angles(const BeamSet& beams);

  Eigen::Matrix4d T_start_ = Eigen::Matrix4d::Zero(), T_end_ = Eigen::Matrix4d::Zero();
  float angle_min_ = 0, angle_increment_ = 0;
  std::vector<float> angles_;  ///< of beams that are not evenly spaced
  std::vector<Eigen::Vector3d> direction_laser_;
  std::vector<float> time_;
  std::vector<Eigen::Vector3d> origin_, direction_;
  Eigen::Vector3d start_ = Eigen::Vector3d::Zero(), end_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_map_middle_ = Eigen::Matrix3d::Identity();
  double half_turn_ = 0, half_tilt_ = 0;
};

}  // namespace parhelion::scan
