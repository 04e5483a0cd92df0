// Faults that are injected for the trainee to notice and to cope with.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace parhelion {

struct Fault {
  enum class Kind : std::uint8_t {
    camera_delay,    ///< frames reach a page `amount` s late, 0..0.5
    camera_loss,     ///< fraction of the frames that does not reach a page
    laser_dropouts,  ///< fraction of the beams of a simulated robot's laser without return
    low_battery,     ///< a simulated robot starts with this fraction of its charge
    dead_wheel,      ///< the wheels or the track of `side` of a simulated robot do not turn
  };
  Kind kind = Kind::camera_delay;
  double amount = 0;              ///< by kind; fractions 0..1
  bool right = false;             ///< side of dead_wheel
  double after = 0;               ///< s from the session's start
  std::optional<double> lasting;  ///< s; none: to the end

  /// Whether it is active at `age` s of the session.
  bool holds(double age) const { return age >= after && (!lasting || age < after + *lasting); }
};

inline constexpr Fault::Kind kLastFaultKind = Fault::Kind::dead_wheel;

const char* to_string(Fault::Kind kind);

/// Affects only simulated parts: never a real robot's MR_SCAN or MR_CMD. The other kinds affect a page, at
/// any level.
inline bool needs_simulated_robot(Fault::Kind kind) { return kind >= Fault::Kind::laser_dropouts; }

/// A value of the scenario that was given as a range, and the value drawn from it.
struct DrawnValue {
  std::string key;              ///< its key: "agents.0.behaviour.speed"
  std::string from, to, value;  ///< as written in the file, with units
};

}  // namespace parhelion
