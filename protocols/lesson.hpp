// What goes wrong on purpose, for the trainee to notice and to cope with.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace parhelion {

struct Lesson {
  enum class Kind : std::uint8_t {
    camera_delay,    ///< frames come to a page `amount` s late, 0..0.5
    camera_loss,     ///< that share of the frames does not come to a page
    laser_dropouts,  ///< that share of the beams of a simulated robot's laser sees nothing
    low_battery,     ///< a simulated robot has that share of its charge left, at the start
    dead_wheel,      ///< the wheels or the track of `side` do not turn, of a simulated robot
  };
  Kind kind = Kind::camera_delay;
  double amount = 0;              ///< by kind; shares 0..1
  bool right = false;             ///< side of dead_wheel
  double after = 0;               ///< s from the session's start
  std::optional<double> lasting;  ///< s; none: to the end

  /// At `age` s of the session.
  bool holds(double age) const { return age >= after && (!lasting || age < after + *lasting); }
};

inline constexpr Lesson::Kind kLastLessonKind = Lesson::Kind::dead_wheel;

const char* to_string(Lesson::Kind kind);

/// Acts on what is simulated: never on a real robot's MR_SCAN or MR_CMD. The others act on a page, at any
/// level.
inline bool needs_simulated_robot(Lesson::Kind kind) { return kind >= Lesson::Kind::laser_dropouts; }

/// A value of the scenario that was given as a range, and what was drawn from it.
struct DrawnValue {
  std::string key;              ///< where: "agents.0.behaviour.speed"
  std::string from, to, value;  ///< as they stand in the file: with units
};

}  // namespace parhelion
