// A robot of links and joints while it is simulated: its motors, encoders and broken joints. The parts of
// this class are articulated_robot.cpp and robot_motors.cpp (what its motors do and bear).
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/joints.hpp"
#include "protocols/world.hpp"
#include "server/simulation/robot_layout.hpp"
#include "server/simulation/robot_motion.hpp"

namespace parhelion::simulation {

/// Something that happened to a joint in a step.
struct JointIncident {
  EventKind kind = EventKind::joint_broken;
  std::string joint;
  double value = 0;                                    ///< as the event's
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, map
};

class ArticulatedRobot {
 public:
  explicit ArticulatedRobot(std::shared_ptr<const RobotModel> model);

  /// Into the physics, once.
  void enter(Physics& physics, const Transform<Map, Base>& T_map_base);
  void leave(Physics& physics);
  /// Puts it there at rest, joints whole and where they start.
  void put(Physics& physics, const Transform<Map, Base>& T_map_base);
  /// Broken joints hold again, where they start; the robot stays where it is.
  void restore(Physics& physics);

  const RobotModel& model() const { return *model_; }
  PhysicsHandle base() const { return handles_.front(); }
  bool owns(PhysicsHandle handle) const { return handle >= handles_.front() && handle <= handles_.back(); }
  /// Name of the link that a shape of one of its parts belongs to (shape < 0: of the part's first link).
  const std::string& link_name(PhysicsHandle handle, int shape) const;

  /// Positions, velocities or efforts of joints, the first that is given; velocities and efforts hold for
  /// 0.5 s. Error: unknown joints (the others are commanded), lists of other lengths, values that are not
  /// finite (then none is).
  Status command(const Joints& joints, SimulationTime now);

  /// Joints stay where they are now, whatever they were commanded.
  void hold(const Physics& physics);

  /// Wheels or tracks of these sides do not turn from now on, whatever is asked.
  void block_sides(bool left, bool right);

  /// Before a step: motors go for this motion of base_link (body frame).
  void drive(Physics& physics, const Twist2& wanted, SimulationTime now, double dt);
  /// After a step.
  void observe(Physics& physics, SimulationTime now, double dt, std::vector<JointIncident>& incidents);
  const RobotMotion& motion() const { return motion_; }
  /// W that its runners gave at their surfaces in the newest step; what pushes them gives nothing back.
  double drive_power(const Physics& physics) const;
  double mass() const;  ///< kg

  /// One for each node, ids from `first`.
  std::vector<BodyDefinition> bodies(const std::string& entity, BodyId first, BodyOwner owner) const;
  std::size_t body_count() const { return layout_.nodes.size(); }
  /// Appends them in their order.
  void append_states(BodyId first, std::uint32_t epoch, std::vector<BodyState>& bodies) const;
  /// m, map: the middle of the gripper's links at the newest step; of a model with a gripper.
  Eigen::Vector3d gripper_center() const;
  /// Links with a bumper, and those of the gripper, that touch something; cleared by observe().
  void touched(const std::string& link);

 private:
  struct Servo {
    enum class Mode : std::uint8_t { position, velocity, effort };
    Mode mode = Mode::position;
    double target = 0;
    double most_speed = 0;                ///< rad/s or m/s
    std::optional<SimulationTime> until;  ///< of velocities and efforts
    double asked = 0;                     ///< rad/s or m/s that the motor goes for now
    double speed = 0;                     ///< rad/s or m/s: of a commanded velocity, what it has come to
    std::optional<double> course;         ///< rad or m: where that would have taken the joint
    double load = 0;                      ///< N m or N, over some steps
    double stalled = 0;                   ///< s that it has been at its limit without moving
    bool overloaded = false, broken = false;
  };
  /// A joint that is geared to another, or the one that it is geared to.
  struct Gear {
    std::size_t other = 0;
    bool follows = false;
  };

  std::vector<Transform<Map, Body>> part_poses(const Transform<Map, Base>& T_map_base) const;
  Eigen::Isometry3d T_part_node(std::size_t node) const;
  void start_again();
  void drive_runners(Physics& physics, const Twist2& wanted, double dt);
  void steer(Physics& physics, double curvature, double dt);
  void drive_joint(Physics& physics, std::size_t i, SimulationTime now, double dt);
  /// What a joint's motor goes for that is commanded a velocity.
  static double keep_course(Servo& servo, const RobotJoint& joint, double position, double dt);
  /// Share of its effort that a joint has which is geared to another: none to run ahead of it. `way`: its
  /// sign is the direction.
  double geared_share(Physics& physics, std::size_t i, const JointState& state, double way, double dt) const;
  void watch_joint(Physics& physics, std::size_t i, double dt, std::vector<JointIncident>& incidents);

  std::shared_ptr<const RobotModel> model_;
  RobotLayout layout_;
  std::vector<PhysicsHandle> handles_;      // by part
  std::vector<JointHandle> joint_handles_;  // as layout_.joints
  std::vector<Servo> servos_;               // as layout_.joints
  std::vector<std::optional<Gear>> gears_;  // as layout_.joints
  std::vector<double> steering_;            // rad, by joint of the model
  std::vector<double> rolled_;              // m, by runner
  std::vector<double> turned_;              // rad, by runner: what is seen
  std::vector<double> runner_speed_;        // m/s, by runner
  std::vector<RigidState> parts_;           // at the newest step
  bool left_blocked_ = false, right_blocked_ = false;
  RobotMotion motion_;
  std::optional<SimulationTime> awake_until_;
};

}  // namespace parhelion::simulation
