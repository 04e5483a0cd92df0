// The motion of the base while its laser sweeps once.
#pragma once

#include "protocols/pose2.hpp"

namespace parhelion::pose {

struct SweepMotion {
  SweepMotion() = default;
  /// At a constant twist, unless more is known.
  SweepMotion(const Twist2& at_stamp, const Twist2& change = {}) : twist(at_stamp), acceleration(change) {}

  Twist2 twist;         ///< m/s, rad/s, body frame, at the scan's stamp
  Twist2 acceleration;  ///< of the twist, per second

  bool at_rest() const {
    const auto zero = [](const Twist2& t) { return t.vx == 0 && t.vy == 0 && t.wz == 0; };
    return zero(twist) && zero(acceleration);
  }
  /// T_stamp_then of the base, `dt` seconds after the stamp.
  Pose2 after(double dt) const {
    const double half = dt / 2;
    return moved({twist.vx + half * acceleration.vx, twist.vy + half * acceleration.vy,
                  twist.wz + half * acceleration.wz},
                 dt);
  }
};

}  // namespace parhelion::pose
