// Bullet behind a small interface: the only place that knows it is physics.cpp.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/model.hpp"
#include "protocols/scene.hpp"

namespace parhelion {

/// A rigid body in the solver; numbers are given out in ascending order and never used again.
using PhysicsHandle = int;

struct RigidState {
  Transform<Map, Body> T_map_body;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();       ///< m/s, map frame, of the body's origin
  Eigen::Vector3d rotation_rate = Eigen::Vector3d::Zero();  ///< rad/s, map frame
};

/// Two bodies that touched in the newest step; a < b.
struct PhysicsContact {
  PhysicsHandle a = 0;
  PhysicsHandle b = 0;
  Eigen::Vector3d position =
      Eigen::Vector3d::Zero();  ///< m, map frame, where the bodies are deepest in each other
  double impulse = 0;           ///< N s, normal, summed over the contact's points
};

/// A mesh made ready to collide with; takes time, and needs no Physics: another thread may make it.
struct FixedMesh;
std::shared_ptr<FixedMesh> make_fixed_mesh(const ModelMesh& mesh);

/// Rigid bodies at a fixed step (btDiscreteDynamicsWorld in double precision). Origins of movable bodies are
/// on their underside, centred. Deterministic: the same calls give the same states, bit for bit.
class Physics {
 public:
  explicit Physics(double step);  ///< s
  ~Physics();
  Physics(const Physics&) = delete;
  Physics& operator=(const Physics&) = delete;

  /// A box that never moves; `floor`: walked on, not bumped into.
  PhysicsHandle add_fixed_box(const Transform<Map, Body>& T_map_body, const Eigen::Vector3d& size,
                              bool floor);
  /// Triangles (map frame, m) that never move and stop what comes from either side; at least one. Takes what
  /// is in `mesh`.
  PhysicsHandle add_fixed_mesh(FixedMesh& mesh);
  /// An infinite floor at height z, m.
  PhysicsHandle add_floor(double z);
  /// Moves freely under gravity: a box (full lengths) or an upright cylinder (diameter, diameter, height).
  PhysicsHandle add_free(ShapeKind kind, const Eigen::Vector3d& size, double mass,
                         const Transform<Map, Body>& T_map_body);
  /// Stays upright and at its height; moved in the plane by drive() and by what pushes it.
  PhysicsHandle add_upright(ShapeKind kind, const Eigen::Vector3d& size, double mass,
                            const Transform<Map, Body>& T_map_body);
  /// Goes where it is put and pushes the others: a convex footprint, extruded to `height`.
  PhysicsHandle add_kinematic(const std::vector<Eigen::Vector2d>& footprint, double height);
  void remove(PhysicsHandle handle);

  /// Puts a body there, at rest, without any memory of where it was.
  void teleport(PhysicsHandle handle, const Transform<Map, Body>& T_map_body);
  /// A kinematic body's pose and velocity at the coming step. The velocity is what others are pushed with: it
  /// is not taken from the difference of two poses.
  void move_kinematic(PhysicsHandle handle, const Transform<Map, Body>& T_map_body,
                      const Eigen::Vector3d& velocity, const Eigen::Vector3d& rotation_rate);
  /// A suspended body touches nothing.
  void suspend(PhysicsHandle handle, bool suspended);
  /// Wheels or feet of an upright body: changes its velocity (body frame) towards `twist` by what friction
  /// with the floor allows in one step.
  void drive(PhysicsHandle handle, const Twist2& twist, double friction);

  void step();
  RigidState state(PhysicsHandle handle) const;
  /// Of the newest step, in the solver's order (deterministic); contacts with floors are left out.
  const std::vector<PhysicsContact>& contacts() const;

 private:
  struct World;
  std::unique_ptr<World> world_;
};

}  // namespace parhelion
