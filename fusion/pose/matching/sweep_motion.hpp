// The motion of the base while its laser sweeps once.
#pragma once

#include <algorithm>
#include <cstddef>

#include "protocols/pose2.hpp"
#include "protocols/scan.hpp"

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

/// When a sweep begins and ends, from the scan's stamp.
struct SweepSpan {
  Duration begin, end;
};

/// Of a scan of so many beams, at least one. The passes of an interlaced scan begin and end with different
/// beams.
inline SweepSpan sweep_span(const LaserDescription& laser, std::size_t beams) {
  SweepSpan span{laser.beam_time(0, beams), laser.beam_time(0, beams)};
  const std::size_t passes = std::min(beams, static_cast<std::size_t>(std::max(laser.passes, 1)));
  for (std::size_t i = 0; i < passes; ++i) {
    const Duration first = laser.beam_time(i, beams), last = laser.beam_time(beams - 1 - i, beams);
    span.begin = std::min({span.begin, first, last});
    span.end = std::max({span.end, first, last});
  }
  return span;
}

}  // namespace parhelion::pose
