// Bullet behind a small interface: the only places that know it are physics*.cpp. The parts of Physics are
// physics.cpp (steps, motion, contacts), physics_bodies.cpp (bodies in and out), physics_parts.cpp (parts of
// robots and their runners) and physics_joint.cpp (joints).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/model.hpp"
#include "protocols/scene.hpp"

namespace parhelion::simulation {

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
  /// Of a robot's part: its shape that is deepest in the other body; -1: not a robot's part.
  int shape_a = -1, shape_b = -1;
  bool rolling = false;  ///< all that touches is the surface of wheels or tracks
};

constexpr double kHullMargin = 0.002;  ///< m: what Bullet adds around a convex hull

/// A shape of a robot's part.
struct PartShape {
  Shape shape;  ///< in the part's frame; not read where there is a hull
  std::vector<Eigen::Vector3d>
      hull;               ///< corners of a convex hull, m, part's frame; it ends kHullMargin outside
  double friction = 0.6;  ///< against anything
  int runner = -1;        ///< index of the runner that it is the surface of; -1: none
};

/// A wheel or track of a part: the points of its shapes move along the surface, so that friction drives the
/// part (the surface of a conveyor belt; Coulomb's law bounds it).
struct PartRunner {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitY();  ///< unit, part's frame: it rolls about this, leftwards
  double friction = 0.8;                            ///< against anything
};

/// A rigid part of a robot; parts of one robot do not touch each other.
struct PartDefinition {
  std::vector<PartShape> shapes;
  std::vector<PartRunner> runners;
  double mass = 1;                                        ///< kg
  Eigen::Vector3d center = Eigen::Vector3d::Zero();       ///< of mass, m, part's frame
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Identity();  ///< kg m^2, about the centre, axes of the part
};

/// The motion that a runner is commanded.
struct RunnerCommand {
  double speed = 0;  ///< m/s that its surface rolls with, forward
  double force = 0;  ///< N, most of its motor; 0: it rolls with the ground
  double yield = 0;  ///< m/s that the surface can be slowed down by in one step where the motor is too weak
  Eigen::Vector3d axis = Eigen::Vector3d::UnitY();  ///< as in PartRunner
};

/// What a runner did in the newest step.
struct RunnerMotion {
  double speed = 0;         ///< m/s that its surface rolled forward with
  double force = 0;         ///< N that it pushed the robot forward with
  double normal_force = 0;  ///< N that it stands on its ground with
  bool too_weak = false;    ///< its motor was at its limit
};

using JointHandle = int;

enum class PartJointKind : std::uint8_t { revolute, prismatic, ball };

struct JointDefinition {
  PartJointKind kind = PartJointKind::revolute;
  PhysicsHandle a = 0, b = 0;
  /// The joint in both parts at position 0; it turns about, or slides along, its x axis.
  Eigen::Isometry3d T_a_joint = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d T_b_joint = Eigen::Isometry3d::Identity();
  bool limited = false;
  double lower = 0, upper = 0;  ///< rad or m
};

struct JointState {
  double position = 0;  ///< rad (turns are counted) or m
  double velocity = 0;  ///< rad/s or m/s
  double effort = 0;    ///< N m or N of its motor in the newest step
  double load = 0;      ///< N m (N of one that slides) that tore at it in the newest step, all axes
  double pull = 0;      ///< N that it held its parts together with in the newest step; 0 of one that slides
};

/// A mesh made ready to collide with; takes time, and needs no Physics: another thread may make it.
struct FixedMesh;
std::shared_ptr<FixedMesh> make_fixed_mesh(const ModelMesh& mesh);

/// Rigid bodies at a fixed step (btDiscreteDynamicsWorld in double precision). Origins of movable bodies are
/// on their underside, centred. Deterministic: the same calls give the same states, bit for bit.
class Physics {
 public:
  /// `step`, s. Joints between parts of robots are solved exactly; otherwise, for comparison, in `sweeps`
  /// over them and over contacts, each in turn.
  explicit Physics(double step, int sweeps = 0);
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
  /// The same, of boxes that are held together (in the body's frame, m).
  PhysicsHandle add_free(const std::vector<Shape>& boxes, double mass,
                         const Transform<Map, Body>& T_map_body);
  /// Stays upright and at its height; moved in the plane by drive() and by what pushes it.
  PhysicsHandle add_upright(ShapeKind kind, const Eigen::Vector3d& size, double mass,
                            const Transform<Map, Body>& T_map_body);
  /// A leaf that hangs in a wall: touches what moves, not the building; its origin is its centre.
  PhysicsHandle add_leaf(const Eigen::Vector3d& size, double mass, const Transform<Map, Body>& T_map_body);
  /// It hangs no longer: from now on it lies on floors and against walls.
  void drop_leaf(PhysicsHandle handle);
  /// Touches nothing and never moves: what a leaf's hinge is fixed to.
  PhysicsHandle add_anchor(const Transform<Map, Body>& T_map_body);
  /// Goes where it is put and pushes the others: a convex footprint, extruded to `height`.
  PhysicsHandle add_kinematic(const std::vector<Eigen::Vector2d>& footprint, double height);
  /// Parts of one robot, in their order.
  std::vector<PhysicsHandle> add_parts(const std::vector<PartDefinition>& parts,
                                       const std::vector<Transform<Map, Body>>& T_map_part);
  /// Moves a shape of a part (a wheel that is steered).
  void move_shape(PhysicsHandle part, std::size_t shape, const Transform<Body, ShapeFrame>& T_body_shape);
  /// From the next step on.
  void run(PhysicsHandle part, std::size_t runner, const RunnerCommand& command);
  RunnerMotion runner(PhysicsHandle part, std::size_t runner) const;
  /// Sleeping parts do not move, and are not stepped; touching and commanding wakes them.
  void keep_awake(PhysicsHandle part, bool awake);
  JointHandle add_joint(const JointDefinition& definition);
  /// Its motor goes for `velocity` (rad/s or m/s) with at most `effort` (N m or N), from the next step on.
  void drive_joint(JointHandle joint, double velocity, double effort);
  /// A joint that does not hold: its parts go their own ways.
  void release_joint(JointHandle joint, bool released);
  /// After a teleport: the position that the parts have, for the counting of turns.
  void restart_joint(JointHandle joint, double position);
  JointState joint_state(JointHandle joint) const;
  void remove_joint(JointHandle joint);
  void remove(PhysicsHandle handle);

  /// Puts a body there, at rest, without any memory of where it was.
  void teleport(PhysicsHandle handle, const Transform<Map, Body>& T_map_body);
  /// Puts a body there, moving like this.
  void set_motion(PhysicsHandle handle, const RigidState& motion);
  /// A kinematic body's pose and velocity at the coming step. The velocity is what others are pushed with: it
  /// is not taken from the difference of two poses.
  void move_kinematic(PhysicsHandle handle, const Transform<Map, Body>& T_map_body,
                      const Eigen::Vector3d& velocity, const Eigen::Vector3d& rotation_rate);
  /// A fixed body that is moved after all; from the first call on it is a kinematic one.
  void move_fixed(PhysicsHandle handle, const Transform<Map, Body>& T_map_body,
                  const Eigen::Vector3d& velocity, const Eigen::Vector3d& rotation_rate);
  /// A suspended body touches nothing.
  void suspend(PhysicsHandle handle, bool suspended);
  /// Wheels or feet of an upright body: changes its velocity (body frame) towards `twist` by what friction
  /// with the floor allows in one step.
  void drive(PhysicsHandle handle, const Twist2& twist, double friction);
  /// The same of a body that is stepped elsewhere.
  static void drive(RigidState& rigid, const Twist2& twist, double friction, double step);

  void step();
  RigidState state(PhysicsHandle handle) const;
  /// Of the newest step, in the solver's order (deterministic); contacts with floors are left out.
  const std::vector<PhysicsContact>& contacts() const;

 private:
  struct World;
  std::unique_ptr<World> world_;
};

}  // namespace parhelion::simulation
