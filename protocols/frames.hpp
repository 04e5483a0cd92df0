// Rigid transforms with their frames as part of the type: T_map_base * T_base_laser compiles, the other order
// does not. Frames follow REP-105, axes REP-103 (x forward, y left, z up; *_optical: z forward, x right, y
// down). Metres, radians.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace parhelion {

struct Map {};            ///< fixed to the building
struct Odom {};           ///< drifts, continuous
struct Base {};           ///< base_link of a robot, on the floor between the wheels
struct Laser {};          ///< beams lie in its xy-plane, angle 0 along x
struct CameraOptical {};  ///< z forward, x right, y down
struct DepthOptical {};   ///< the same for a separate depth camera
struct Scanner {};        ///< a 3D scanner, one frame for each scan: x forward, y left, z up
struct Cloud {};          ///< a registered cloud: the frame of its first scan, not levelled yet
struct Imu {};            ///< an inertial sensor, with its own axes
struct Body {};           ///< a rigid body of the scene
struct ShapeFrame {};     ///< a shape of a body, at its centre

/// T_a_b: transforms coordinates from B to A; B's pose in A.
template <class A, class B>
class Transform {
 public:
  Transform() : isometry_(Eigen::Isometry3d::Identity()) {}
  explicit Transform(const Eigen::Isometry3d& isometry) : isometry_(isometry) {}
  Transform(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation) : Transform() {
    isometry_.linear() = rotation.normalized().toRotationMatrix();
    isometry_.translation() = translation;
  }
  /// Planar pose: x, y in metres, yaw in radians about z.
  static Transform planar(double x, double y, double yaw, double z = 0) {
    return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ())), {x, y, z}};
  }

  const Eigen::Isometry3d& isometry() const { return isometry_; }
  Eigen::Vector3d translation() const { return isometry_.translation(); }
  Eigen::Matrix3d rotation() const { return isometry_.linear(); }
  Eigen::Quaterniond quaternion() const { return Eigen::Quaterniond(isometry_.linear()); }
  /// Heading of B's x axis in A's xy-plane, radians in (-pi, pi].
  double yaw() const { return std::atan2(isometry_(1, 0), isometry_(0, 0)); }
  bool finite() const { return isometry_.matrix().allFinite(); }

  /// B, moved by a vector given in A, m.
  Transform moved_by(const Eigen::Vector3d& offset) const {
    return Transform(Eigen::Isometry3d(Eigen::Translation3d(offset) * isometry_));
  }
  /// The same numbers as T_c_d: valid only where the frame C coincides with A, and D with B. A name or a
  /// comment at the call explains why they do.
  template <class C, class D>
  Transform<C, D> as() const {
    return Transform<C, D>(isometry_);
  }

  Transform<B, A> inverse() const { return Transform<B, A>(isometry_.inverse(Eigen::Isometry)); }
  template <class C>
  Transform<A, C> operator*(const Transform<B, C>& T_b_c) const {
    return Transform<A, C>(isometry_ * T_b_c.isometry());
  }
  /// A point given in B, in A.
  Eigen::Vector3d operator*(const Eigen::Vector3d& p_b) const { return isometry_ * p_b; }

 private:
  Eigen::Isometry3d isometry_;
};

/// Position linear, rotation along the shortest arc; s = 0 gives a, s = 1 gives b; extrapolates beyond.
template <class A, class B>
Transform<A, B> interpolate(const Transform<A, B>& a, const Transform<A, B>& b, double s) {
  const Eigen::Quaterniond q_a = a.quaternion();
  return {q_a.slerp(s, b.quaternion()), a.translation() + s * (b.translation() - a.translation())};
}

/// The equivalent angle in (-pi, pi].
inline double wrap_angle(double angle) {
  const double wrapped = std::remainder(angle, 2 * std::numbers::pi);
  return wrapped <= -std::numbers::pi ? wrapped + 2 * std::numbers::pi : wrapped;
}

/// Motion in the plane, in the body's own frame: m/s forward, m/s to the left, rad/s counter-clockwise.
struct Twist2 {
  double vx = 0;
  double vy = 0;
  double wz = 0;
};

}  // namespace parhelion
