// In which order a real laser measures its beams, as its scans of turns show it: a description that differs
// is put right for the session.
#pragma once

#include <optional>
#include <string>

#include "fusion/pose/matching/beam_order.hpp"
#include "protocols/robot.hpp"
#include "protocols/scan.hpp"
#include "server/tick/pose_path.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// Of one laser. Its memory is freed once the order is known, or is not looked for any more.
struct BeamWatch {
  std::optional<pose::BeamOrder> order;  ///< none: before the first scan, or once it has concluded
  bool concluded = false;
  std::optional<SensorTime> newest;           ///< stamp of the scan before
  std::optional<LaserDescription> corrected;  ///< none: the beams are as described, as far as is known
};

/// After a scan of a real laser was answered. `laser`: its index, see RobotDescription::laser_at(). Where the
/// order turns out to be wrong: corrects it, for the match of the first laser's scans too, and publishes
/// scans_conflict with `laser_name` as its object. From the next scan on, virtual objects are cast in the
/// true order.
void watch_beam_order(const TickContext& context, const Scan& scan, std::size_t laser,
                      const std::string& laser_name, PoseState& pose, BeamWatch& watch);

}  // namespace parhelion::tick
