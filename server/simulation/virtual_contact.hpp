// From TELEOP to MR_CMD: a virtual body holds the real robot back as a real one would, and a command is only
// ever reduced.
#pragma once

#include <optional>

#include "protocols/pose.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"
#include "server/simulation/simulation.hpp"

namespace parhelion::simulation {

/// Why MR_CMD is not TELEOP.
enum class HoldReason : std::uint8_t {
  none,
  contact,         ///< a virtual body is near on the way
  pose_lost,       ///< stop until the dead-man is released
  crawl,           ///< pose lost, dead-man released and pressed again: slow, without virtual contact
  silence,         ///< no TELEOP, or none for ContactLimits::silence
  invalid,         ///< TELEOP is not finite
  emergency_stop,  ///< until it is taken back and the dead-man released
};

const char* to_string(HoldReason reason);

struct VirtualContactInput {
  std::optional<TwistCommand> teleop;  ///< the newest; absent: none yet
  Duration teleop_age;                 ///< since its arrival
  bool pose_known = false;             ///< the real robot's pose is good enough for injection
  bool emergency_stop = false;         ///< somebody has stopped the robot
  Simulation::Clearance
      clearance;  ///< for teleop's twist, with limit contact_lookahead(); not read without a pose
};

/// What is remembered from one command to the next.
struct VirtualContactState {
  bool released_since_loss =
      false;             ///< the dead-man was released (TELEOP zero or silent) while the pose was lost
  bool stopped = false;  ///< and not released since the emergency stop was taken back
};

struct VirtualContactResult {
  TwistCommand command;  ///< scale * TELEOP in each component; stamp of TELEOP (0 without one)
  double scale = 0;      ///< 0..1
  HoldReason reason = HoldReason::none;
};

/// m/s of the fastest point of the footprint: what clearances and braking are computed with, so that a turn
/// on the spot counts as well.
double footprint_speed(const RobotDescription& robot, const Twist2& twist);

/// How far a clearance must look for `twist`, m: where nothing is nearer, limit() changes nothing.
double contact_lookahead(const ContactLimits& limits, const RobotDescription& robot, const Twist2& twist);

/// The scale that virtual contact allows at clearance `distance` (m) for a motion of `speed` (m/s, of the
/// footprint's fastest point): linear from slow_distance to stop_distance, and never faster than the robot
/// can brake: with reaction time r and deceleration a, v r + v^2 / (2 a) <= distance - stop_distance.
double contact_scale(const ContactLimits& limits, const RobotLimits& robot, double distance, double speed);

/// Promise 3.
VirtualContactResult limit(const ContactLimits& limits, const RobotDescription& robot,
                           const VirtualContactInput& input, VirtualContactState& state);

}  // namespace parhelion::simulation
