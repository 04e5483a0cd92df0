// The links of a real robot, at the positions of its encoders: kinematic bodies that push and touch virtual
// things.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "protocols/scene.hpp"
#include "protocols/world.hpp"
#include "server/simulation/physics/physics.hpp"
#include "server/simulation/robots/robot_layout.hpp"

namespace parhelion::simulation {

/// A link of the gripper.
struct TwinFinger {
  std::size_t part = 0;
  std::vector<Eigen::Vector3d> corners;  ///< of its shapes' boxes, m, part's frame
};

class RobotTwin {
 public:
  explicit RobotTwin(std::shared_ptr<const RobotModel> model);

  /// Adds it to the physics, suspended; call once.
  void enter(Physics& physics);
  const RobotModel& model() const { return *model_; }
  PhysicsHandle base() const { return handles_.front(); }
  const std::vector<PhysicsHandle>& handles() const { return handles_; }  ///< by part
  bool owns(PhysicsHandle handle) const { return handle >= handles_.front() && handle <= handles_.back(); }

  /// Joints that need an encoder: those that move a part and do not mimic another; indices in the model.
  const std::vector<std::size_t>& encoded() const { return encoded_; }
  /// From the next move() on. Joints that mimic another follow it.
  void set_posture(JointPosture posture);
  const JointPosture& posture() const { return posture_; }
  /// Sets the positions of joints that mimic another.
  void follow_leaders(std::vector<double>& values, bool are_velocities) const;

  /// The base in the coming step; the other parts by the posture. Untouchable: without contacts.
  void move(Physics& physics, const RigidState& base, bool touchable);
  void suspend(Physics& physics);
  /// By part, at the newest step.
  const std::vector<RigidState>& parts() const { return parts_; }
  /// By part, with the base in this pose and joints at these positions.
  void place(const Transform<Map, Base>& T_map_base, std::span<const double> positions,
             std::vector<Transform<Map, Body>>& T_map_part) const;
  /// Whether a joint moves this part.
  bool moves(std::size_t joint, std::size_t part) const { return moves_[joint][part]; }
  /// m a radian, or 1 where it slides: no point that the joint moves is faster than this times its velocity.
  double reach(std::size_t joint) const { return reach_[joint]; }
  /// m: no point of the robot is farther from base_link's origin, in any posture.
  double reach() const { return base_reach_; }

  /// At most the first two links of the gripper; none: it does not grip.
  const std::vector<TwinFinger>& fingers() const { return fingers_; }
  bool is_finger(std::size_t part) const;
  /// Whether a joint moves one finger against the other.
  bool grips(std::size_t joint) const;

  /// N m or N: weight of the parts and of `load` kg at `center` (m, map) that the joint bears, against
  /// gravity.
  double bears(std::size_t joint, double load, const Eigen::Vector3d& center) const;

  /// One body for each node, ids from `first`.
  std::vector<std::shared_ptr<const BodyDefinition>> bodies(const std::string& entity, BodyId first) const;
  std::size_t body_count() const { return layout_.nodes.size(); }
  /// Appends the body states in order.
  void append_states(BodyId first, std::uint32_t epoch, std::vector<BodyState>& bodies) const;

 private:
  Eigen::Isometry3d T_part_node(std::size_t node) const;
  void find_reaches();
  void find_fingers();

  std::shared_ptr<const RobotModel> model_;
  RobotLayout layout_;
  std::vector<PhysicsHandle> handles_;  // by part
  std::vector<std::size_t> encoded_;
  std::vector<std::vector<bool>> moves_;  // by joint and part
  std::vector<double> reach_;             // by joint
  double base_reach_ = 0;
  std::vector<TwinFinger> fingers_;
  JointPosture posture_;
  std::vector<RigidState> parts_;
  std::vector<Transform<Map, Body>> poses_;  // reused memory
};

}  // namespace parhelion::simulation
