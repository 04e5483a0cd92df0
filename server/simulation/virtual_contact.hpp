// From TELEOP to MR_CMD: virtual bodies limit the real robot's motion as real ones would, and a command is
// only ever reduced.
#pragma once

#include <optional>

#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"
#include "protocols/twist_command.hpp"
#include "server/simulation/simulation.hpp"

namespace parhelion::simulation {

/// Why MR_CMD differs from TELEOP.
enum class SpeedLimitReason : std::uint8_t {
  none,
  contact,            ///< a virtual body is close on the path
  localization_lost,  ///< stop until the dead-man is released
  crawl,              ///< pose lost, dead-man released and pressed again: slow, without virtual contact
  silence,            ///< no TELEOP, or none for ContactLimits::silence
  invalid,            ///< TELEOP is not finite
  emergency_stop,     ///< until it is released and the dead-man was released
  robot_limits,       ///< TELEOP is faster than the robot's description allows
  scans_silent,       ///< the robot's laser has fallen silent: until it scans again
  two_drivers,        ///< TELEOP of two consoles at once: until one of them has let go
  not_released,  ///< the cause of a stop is over, or the server has started: until the dead-man is released
};

const char* to_string(SpeedLimitReason reason);

struct VirtualContactInput {
  std::optional<TwistCommand> teleop;    ///< the newest; absent: none yet
  Duration teleop_age;                   ///< since its arrival
  bool pose_known = false;               ///< the real robot's pose is good enough for injection
  bool localization_lost = false;        ///< it has not been for so long that this counts as a loss
  bool emergency_stop = false;           ///< the emergency stop is active
  std::optional<SpeedLimitReason> stop;  ///< scans_silent or two_drivers, while it lasts
  bool own_stop = false;                 ///< `teleop` is the server's stop, not the trainee's
  Simulation::Clearance
      clearance;  ///< for teleop's twist, with limit contact_lookahead(); unused without a pose
};

/// State from one command to the next.
struct VirtualContactState {
  bool released_since_loss =
      false;  ///< the dead-man was released (TELEOP zero or silent) while the pose was lost
  /// The newest cause of a stop since which the dead-man was not released; none: it was.
  SpeedLimitReason held = SpeedLimitReason::none;
};

struct VirtualContactResult {
  TwistCommand command;  ///< scale * TELEOP in each component; stamp of TELEOP (0 without one)
  double scale = 0;      ///< 0..1
  SpeedLimitReason reason = SpeedLimitReason::none;
};

/// m/s of the footprint's fastest point: used for clearances and braking, so that a turn on the spot counts
/// too.
double footprint_speed(const RobotDescription& robot, const Twist2& twist);

/// The largest fraction of `twist`, at most 1, at which neither speed nor yaw rate exceeds the robot's
/// limits.
double limits_scale(const RobotLimits& robot, const Twist2& twist);

/// Required range of the clearance for `twist` within the robot's limits, m: farther obstacles do not affect
/// limit().
double contact_lookahead(const ContactLimits& limits, const RobotDescription& robot, const Twist2& twist);

/// The scale that virtual contact allows at clearance `distance` (m) for a motion of `speed` (m/s, of the
/// footprint's fastest point): linear from slow_distance to stop_distance, and never faster than the robot
/// can brake: with reaction time r and deceleration a, v r + v^2 / (2 a) <= distance - stop_distance.
double contact_scale(const ContactLimits& limits, const RobotLimits& robot, double distance, double speed);

/// Promise 3: one scale for all components, for the robot's limits and for what is in its way. After a stop,
/// whatever its cause, nothing moves before the dead-man was released. A pose that is missing for a moment
/// only (not `localization_lost`) stops the robot without that.
VirtualContactResult limit(const ContactLimits& limits, const RobotDescription& robot,
                           const VirtualContactInput& input, VirtualContactState& state);

}  // namespace parhelion::simulation
