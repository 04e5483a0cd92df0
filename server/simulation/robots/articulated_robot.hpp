// A simulated robot of links and joints: its motors, encoders and broken joints. Implemented in
// articulated_robot.cpp and robot_motors.cpp (motors and joint loads).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/joints.hpp"
#include "protocols/world.hpp"
#include "server/simulation/robots/robot_layout.hpp"
#include "server/simulation/robots/robot_motion.hpp"

namespace parhelion::simulation {

/// An event of a joint in a step.
struct JointIncident {
  EventKind kind = EventKind::joint_broken;
  std::string joint;
  double value = 0;                                    ///< value of the event
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map
};

class ArticulatedRobot {
 public:
  explicit ArticulatedRobot(std::shared_ptr<const RobotModel> model);

  /// Adds it to the physics; call once.
  void enter(Physics& physics, const Transform<Map, Base>& T_map_base);
  void leave(Physics& physics);
  /// Moves it there at rest, with intact joints at their start positions.
  void put(Physics& physics, const Transform<Map, Base>& T_map_base);
  /// Repairs broken joints at their start positions; the robot keeps its pose.
  void restore(Physics& physics);

  const RobotModel& model() const { return *model_; }
  PhysicsHandle base() const { return handles_.front(); }
  bool owns(PhysicsHandle handle) const { return handle >= handles_.front() && handle <= handles_.back(); }
  /// Name of the link that owns a shape of one of its parts (shape < 0: the part's first link).
  const std::string& link_name(PhysicsHandle handle, int shape) const;

  /// Commands positions, velocities or efforts of joints, the first that is given; velocities and efforts
  /// hold for 0.5 s. Error: unknown joints (the others are commanded), lists of different lengths, non-finite
  /// values (then none is commanded).
  Status command(const Joints& joints, SimulationTime now);

  /// Holds all joints at their current positions, whatever was commanded.
  void hold(const Physics& physics);

  /// Blocks the wheels or tracks of these sides, whatever is commanded.
  void block_sides(bool left, bool right);

  /// Before a step: drives the motors for this motion of base_link (body frame).
  void drive(Physics& physics, const Twist2& wanted, SimulationTime now, double dt);
  /// After a step.
  void observe(Physics& physics, SimulationTime now, double dt, std::vector<JointIncident>& incidents);
  const RobotMotion& motion() const { return motion_; }
  /// W delivered by its runners at their surfaces in the newest step; no recuperation.
  double drive_power(const Physics& physics) const;
  double mass() const;  ///< kg

  /// One body for each node, ids from `first`.
  std::vector<BodyDefinition> bodies(const std::string& entity, BodyId first, BodyOwner owner) const;
  std::size_t body_count() const { return layout_.nodes.size(); }
  /// Appends the body states in order.
  void append_states(BodyId first, std::uint32_t epoch, std::vector<BodyState>& bodies) const;
  /// m, map: the centre of the gripper's links at the newest step; for models with a gripper.
  Eigen::Vector3d gripper_center() const;
  /// Marks a link with a bumper or of the gripper as touching; cleared by observe().
  void touched(const std::string& link);

 private:
  struct Servo {
    enum class Mode : std::uint8_t { position, velocity, effort };
    Mode mode = Mode::position;
    double target = 0;
    double max_speed = 0;                 ///< rad/s or m/s
    std::optional<SimulationTime> until;  ///< of velocities and efforts
    double asked = 0;                     ///< rad/s or m/s, current motor command
    double speed = 0;                     ///< rad/s or m/s: current value of a ramped velocity command
    std::optional<double> course;         ///< rad or m: its integral, the position setpoint
    double load = 0;                      ///< N m or N, averaged over some steps
    double stalled = 0;                   ///< s at its limit without motion
    bool overloaded = false, broken = false;
  };
  /// Gearing of a joint: its position is ratio * that of the other joint of the pair + offset.
  struct Gear {
    std::size_t other = 0;
    bool follows = false;
    double ratio = 1, offset = 0;
  };

  std::vector<Transform<Map, Body>> part_poses(const Transform<Map, Base>& T_map_base) const;
  Eigen::Isometry3d T_part_node(std::size_t node) const;
  void start_again();
  void drive_runners(Physics& physics, const Twist2& wanted, double dt);
  void steer(Physics& physics, double curvature, double dt);
  void drive_joint(Physics& physics, std::size_t i, SimulationTime now, double dt);
  /// Motor speed for a commanded velocity, with correction of the position.
  static double keep_course(Servo& servo, const RobotJoint& joint, double position, double dt);
  /// Fraction of its effort available to a geared joint: 0 where it would run ahead of the other. Of
  /// `direction` only the sign counts.
  double geared_fraction(Physics& physics, std::size_t i, const JointState& state, double direction,
                         double dt) const;
  void watch_joint(Physics& physics, std::size_t i, double dt, std::vector<JointIncident>& incidents);

  std::shared_ptr<const RobotModel> model_;
  RobotLayout layout_;
  std::vector<PhysicsHandle> handles_;      // by part
  std::vector<JointHandle> joint_handles_;  // parallel to layout_.joints
  std::vector<Servo> servos_;               // parallel to layout_.joints
  std::vector<std::optional<Gear>> gears_;  // parallel to layout_.joints
  std::vector<double> steering_;            // rad, by joint of the model
  std::vector<double> rolled_;              // m, by runner
  std::vector<double> turned_;              // rad, by runner, for display
  std::vector<double> runner_speed_;        // m/s, by runner
  std::vector<RigidState> parts_;           // at the newest step
  bool left_blocked_ = false, right_blocked_ = false;
  RobotMotion motion_;
  std::optional<SimulationTime> awake_until_;
};

}  // namespace parhelion::simulation
