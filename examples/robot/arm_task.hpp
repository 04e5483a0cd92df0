// Lifts a thing and puts it into a container, as an operator does: from the front, with the hand level.
#pragma once

#include <optional>
#include <string>

#include "arm.hpp"

namespace robot {

class ArmTask {
 public:
  struct Plan {
    Point2 thing, container;    // base_link of the robot, which stands still
    double thing_height = 0;    // m
    double grip_below = 0.06;   // m under its top
    double closed = 0;          // m, of each finger, when it holds; 0: until something stops the fingers
    double container_room = 0;  // m from its middle within which the thing may be let go
  };
  explicit ArmTask(const Plan& plan);

  // Target positions from where the encoders say that the arm is; nullopt: done, or given up.
  std::optional<ArmPosture> command(const ArmPosture& encoders, double dt);
  bool is_done() const { return phase_ == Phase::done; }
  // Text of the current step; after giving up, of the step that failed.
  std::string phase() const;

 private:
  enum class Phase { rise, before, reach, close, lift, swing, lower, open, leave, done, given_up };
  struct Goal {
    double reach = 0, z = 0, turret = 0, gripper = 0;
  };
  Goal goal_of(Phase phase) const;
  // m from the turret's axis: the container's middle or, if that is out of reach, as near to it as the arm
  // comes.
  double release_range() const;
  bool has_come(const ArmPosture& encoders, double dt);

  Plan plan_;
  Phase phase_ = Phase::rise, stuck_in_ = Phase::rise;
  Goal hand_;            // on the way to the phase's goal
  double in_phase_ = 0;  // s
  double still_ = 0;     // s that the fingers have not moved
  double fingers_ = 0;   // m, when they last moved
  bool started_ = false;
};

}  // namespace robot
