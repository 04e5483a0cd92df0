// Bullet behind a small interface: only physics*.cpp use it. Physics is implemented in physics.cpp (steps,
// motion, contacts), physics_bodies.cpp (adding and removing bodies), physics_parts.cpp (parts of robots and
// their runners), physics_joint.cpp (joints) and physics_kinematic.cpp (parts of real robots).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/model.hpp"
#include "protocols/scene.hpp"

namespace parhelion::simulation {

/// A rigid body in the solver; handles are assigned in ascending order and never reused.
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
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map frame, at the deepest penetration
  double impulse = 0;                                  ///< N s, normal, summed over the contact's points
  /// Of a robot's part: its shape with the deepest penetration; -1: not a robot's part.
  int shape_a = -1, shape_b = -1;
  bool rolling = false;  ///< only surfaces of wheels or tracks touch
};

constexpr double kHullMargin = 0.002;  ///< m: margin that Bullet adds around a convex hull

/// A shape of a robot's part.
struct PartShape {
  Shape shape;  ///< in the part's frame; unused if there is a hull
  std::vector<Eigen::Vector3d>
      hull;               ///< vertices of a convex hull, m, part's frame; it collides kHullMargin outside
  double friction = 0.6;  ///< against anything
  int runner = -1;        ///< index of the runner with this surface; -1: none
};

/// A wheel or track of a part: the surface of its shapes moves, so that friction drives the part (like a
/// conveyor belt; bounded by Coulomb's law).
struct PartRunner {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitY();  ///< unit, part's frame: axis of rotation, pointing left
  double friction = 0.8;                            ///< against anything
};

/// A rigid part of a robot; parts of one robot do not collide with each other.
struct PartDefinition {
  std::vector<PartShape> shapes;
  std::vector<PartRunner> runners;
  double mass = 1;                                        ///< kg
  Eigen::Vector3d center = Eigen::Vector3d::Zero();       ///< of mass, m, part's frame
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Identity();  ///< kg m^2, about the centre, axes of the part
};

/// Command of a runner.
struct RunnerCommand {
  double speed = 0;  ///< m/s of its surface, forward
  double force = 0;  ///< N, maximum of its motor; 0: it rolls freely
  double yield = 0;  ///< m/s, maximum slowdown of the surface in one step when the motor is too weak
  Eigen::Vector3d axis = Eigen::Vector3d::UnitY();  ///< as in PartRunner
};

/// Motion of a runner in the newest step.
struct RunnerMotion {
  double speed = 0;         ///< m/s of its surface, forward
  double force = 0;         ///< N, forward force on the robot
  double normal_force = 0;  ///< N, normal force on the ground
  bool too_weak = false;    ///< its motor was at its limit
};

using JointHandle = int;

enum class PartJointKind : std::uint8_t { revolute, prismatic, ball };

struct JointDefinition {
  PartJointKind kind = PartJointKind::revolute;
  PhysicsHandle a = 0, b = 0;
  /// The joint frame in both parts at position 0; x is the axis of rotation or sliding.
  Eigen::Isometry3d T_a_joint = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_b_joint = Eigen::Isometry3d::Identity();
  bool limited = false;
  double lower = 0, upper = 0;  ///< rad or m
};

struct JointState {
  double position = 0;  ///< rad (turns are counted) or m
  double velocity = 0;  ///< rad/s or m/s
  double effort = 0;    ///< N m or N of its motor in the newest step
  double load = 0;      ///< N m (N for a sliding joint), load over all axes in the newest step
  double pull = 0;      ///< N, constraint force in the newest step; 0 for a sliding joint
};

/// A mesh prepared for collision; expensive, and independent of Physics: another thread may prepare it.
struct FixedMesh;
std::shared_ptr<FixedMesh> make_fixed_mesh(const ModelMesh& mesh);

/// Rigid bodies at a fixed step (btDiscreteDynamicsWorld in double precision). Origins of movable bodies are
/// at the centre of their underside. Deterministic: the same calls give the same states, bit for bit.
class Physics {
 public:
  /// `step`, s. Joints between parts of robots are solved exactly; for comparison, `sweeps` > 0 iterates over
  /// them and over contacts in turn.
  explicit Physics(double step, int sweeps = 0);
  ~Physics();
  Physics(const Physics&) = delete;
  Physics& operator=(const Physics&) = delete;

  /// A box that never moves; `floor`: ground to walk on, not an obstacle.
  PhysicsHandle add_fixed_box(const Transform<Map, Body>& T_map_body, const Eigen::Vector3d& size,
                              bool floor);
  /// Fixed triangles (map frame, m) that collide from both sides; at least one. Moves the contents out of
  /// `mesh`.
  PhysicsHandle add_fixed_mesh(FixedMesh& mesh);
  /// An infinite floor at height z, m.
  PhysicsHandle add_floor(double z);
  /// A free body under gravity: a box (full lengths) or an upright cylinder (diameter, diameter, height).
  PhysicsHandle add_free(ShapeKind kind, const Eigen::Vector3d& size, double mass,
                         const Transform<Map, Body>& T_map_body);
  /// The same, of rigidly connected boxes (in the body's frame, m).
  PhysicsHandle add_free(const std::vector<Shape>& boxes, double mass,
                         const Transform<Map, Body>& T_map_body);
  /// Stays upright and at its height; moved in the plane by drive() and by contacts.
  PhysicsHandle add_upright(ShapeKind kind, const Eigen::Vector3d& size, double mass,
                            const Transform<Map, Body>& T_map_body);
  /// A door leaf: collides with movable bodies, not with the building; its origin is its centre.
  PhysicsHandle add_leaf(const Eigen::Vector3d& size, double mass, const Transform<Map, Body>& T_map_body);
  /// Releases a leaf from its hinge: from now on it collides with floors and walls.
  void drop_leaf(PhysicsHandle handle);
  /// A fixed body without collisions, for a leaf's hinge.
  PhysicsHandle add_anchor(const Transform<Map, Body>& T_map_body);
  /// A kinematic body that pushes others: a convex footprint, extruded to `height`.
  PhysicsHandle add_kinematic(const std::vector<Eigen::Vector2d>& footprint, double height);
  /// The same for the parts of a real robot, in order: their shapes only.
  std::vector<PhysicsHandle> add_kinematic_parts(const std::vector<PartDefinition>& parts);
  /// Of a free body in a gripper of kinematic parts, with which it has no contacts then.
  enum class Carried {
    no,
    slipping,  ///< it moves under gravity
    held,      ///< it has no weight: set_velocity() moves it
  };
  void move_held(PhysicsHandle handle, Carried carried);
  /// Velocity of a free body's origin in the coming step, m/s and rad/s, map frame.
  void set_velocity(PhysicsHandle handle, const Eigen::Vector3d& velocity,
                    const Eigen::Vector3d& rotation_rate);
  /// A body at a pose that need not be its own.
  struct Placed {
    PhysicsHandle handle = 0;
    Transform<Map, Body> T_map_body;
  };
  /// m between two bodies, at most `limit`; negative: their penetration. Round shapes and corners of boxes
  /// count as rounded by a tenth of their half size. Gilbert, Johnson and Keerthi, IEEE J-RA 1988.
  double distance(const Placed& a, const Placed& b, double limit) const;
  /// Adds the parts of one robot, in order.
  std::vector<PhysicsHandle> add_parts(const std::vector<PartDefinition>& parts,
                                       const std::vector<Transform<Map, Body>>& T_map_part);
  /// Moves a shape of a part (a steered wheel).
  void move_shape(PhysicsHandle part, std::size_t shape, const Transform<Body, ShapeFrame>& T_body_shape);
  /// Commands a runner from the next step on.
  void run(PhysicsHandle part, std::size_t runner, const RunnerCommand& command);
  RunnerMotion runner(PhysicsHandle part, std::size_t runner) const;
  /// Sleeping parts do not move and are not stepped; contacts and commands wake them.
  void keep_awake(PhysicsHandle part, bool awake);
  JointHandle add_joint(const JointDefinition& definition);
  /// Drives the motor towards `velocity` (rad/s or m/s) with at most `effort` (N m or N), from the next step
  /// on.
  void drive_joint(JointHandle joint, double velocity, double effort);
  /// A released joint has no effect: its parts move independently.
  void release_joint(JointHandle joint, bool released);
  /// After a teleport: sets the position that the parts have, for the counting of turns.
  void restart_joint(JointHandle joint, double position);
  JointState joint_state(JointHandle joint) const;
  void remove_joint(JointHandle joint);
  void remove(PhysicsHandle handle);

  /// Moves a body there, at rest, and clears its contact history.
  void teleport(PhysicsHandle handle, const Transform<Map, Body>& T_map_body);
  /// Sets a body's pose and velocities.
  void set_motion(PhysicsHandle handle, const RigidState& motion);
  /// A kinematic body's pose and velocity at the coming step. The velocity pushes others: it is not derived
  /// from the difference of two poses.
  void move_kinematic(PhysicsHandle handle, const Transform<Map, Body>& T_map_body,
                      const Eigen::Vector3d& velocity, const Eigen::Vector3d& rotation_rate);
  /// Moves a fixed body; the first call makes it kinematic.
  void move_fixed(PhysicsHandle handle, const Transform<Map, Body>& T_map_body,
                  const Eigen::Vector3d& velocity, const Eigen::Vector3d& rotation_rate);
  /// A suspended body has no contacts.
  void suspend(PhysicsHandle handle, bool suspended);
  /// Wheels or feet of an upright body: changes its velocity (body frame) towards `twist` by at most the
  /// effect of floor friction in one step.
  void drive(PhysicsHandle handle, const Twist2& twist, double friction);
  /// The same for a body outside the solver.
  static void drive(RigidState& rigid, const Twist2& twist, double friction, double step);

  void step();
  RigidState state(PhysicsHandle handle) const;
  /// Of the newest step, in the solver's order (deterministic); without contacts with floors.
  const std::vector<PhysicsContact>& contacts() const;

 private:
  struct World;
  std::unique_ptr<World> world_;
};

}  // namespace parhelion::simulation
