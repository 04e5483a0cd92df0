// Instants in int64 nanoseconds, tagged with their clock, so that clocks are never mixed by accident.
#pragma once

#include <compare>
#include <cstdint>

namespace parhelion {

/// A time span, nanoseconds. Independent of the clock.
struct Duration {
  std::int64_t ns = 0;
  auto operator<=>(const Duration&) const = default;
  double seconds() const { return static_cast<double>(ns) * 1e-9; }
  double microseconds() const { return static_cast<double>(ns) * 1e-3; }
  Duration operator+(Duration d) const { return {ns + d.ns}; }
  Duration operator-(Duration d) const { return {ns - d.ns}; }
  Duration operator-() const { return {-ns}; }
};

constexpr Duration nanoseconds(std::int64_t n) { return {n}; }
constexpr Duration microseconds(std::int64_t n) { return {n * 1'000}; }
constexpr Duration milliseconds(std::int64_t n) { return {n * 1'000'000}; }
/// Rounded to the nearest nanosecond.
constexpr Duration seconds(double s) { return {static_cast<std::int64_t>(s * 1e9 + (s < 0 ? -0.5 : 0.5))}; }

struct SensorClock {};      ///< the sensor's clock: `utime` on the wire
struct ArrivalClock {};     ///< the server's stamp of an input; strictly increasing; a log event's timestamp
struct SimulationClock {};  ///< instant of a physics state, on the axis of ArrivalClock
struct WallClock {};        ///< read in the inbox and for measuring durations only

/// An instant of one clock, nanoseconds since the epoch.
template <class Clock>
struct Stamp {
  std::int64_t ns = 0;
  auto operator<=>(const Stamp&) const = default;
  Stamp operator+(Duration d) const { return {ns + d.ns}; }
  Stamp operator-(Duration d) const { return {ns - d.ns}; }
  Duration operator-(Stamp other) const { return {ns - other.ns}; }
  /// As on the wire (microseconds, towards negative infinity).
  std::int64_t utime() const { return ns >= 0 ? ns / 1000 : -((-ns + 999) / 1000); }
  static constexpr Stamp from_utime(std::int64_t us) { return {us * 1000}; }
};

using SensorTime = Stamp<SensorClock>;
using ArrivalTime = Stamp<ArrivalClock>;
using SimulationTime = Stamp<SimulationClock>;
using WallTime = Stamp<WallClock>;

/// Physics uses the axis of arrival: the only conversion between clocks without an offset.
constexpr SimulationTime simulation_time(ArrivalTime t) { return {t.ns}; }

}  // namespace parhelion
