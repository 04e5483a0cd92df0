// Scans that contradict the robot description, or the scans before them: another number of beams, other
// angles, beams in reverse order, or two publishers on the channel.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "protocols/scan.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// Of one laser, by stamps and content of its scans alone.
struct ScanWatch {
  enum Conflict : std::uint8_t { beams, order, publishers };

  /// Beams as they should be: of the description, or of the first scan where the description has none of its
  /// own.
  struct Form {
    std::size_t beams = 0;
    double angle_min = 0, angle_increment = 0;  ///< rad
  };
  std::optional<Form> expected;
  bool described = false;            ///< `expected` is of the description
  std::vector<float> before;         ///< m, ranges of the scan before
  std::optional<SensorTime> newest;  ///< stamp of the scan before
  // The scans since the last count.
  std::size_t counted = 0, not_newer = 0;
  SensorTime first, last;  ///< least and greatest stamp
  /// Arrival of the last scan with each conflict; none: not yet.
  std::array<std::optional<SimulationTime>, 3> conflict_seen;
};

/// After a scan that could be decoded: publishes scans_conflict once when a conflict begins, and again only
/// after it was absent for 5 s. Event::object is `laser_name`. Scans whose beams have angles of their own are
/// not compared: their number may differ.
void watch_scans(const TickContext& context, const Scan& scan, std::size_t laser,
                 const std::string& laser_name, ScanWatch& watch);

}  // namespace parhelion::tick
