// Counts for the report.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "server/tick/percentiles.hpp"

namespace parhelion::tick {

/// Why a scan was published unchanged.
enum class Degraded : std::uint8_t {
  none,
  pose,        ///< the pose track has none; the reason gives the cause
  error,       ///< predicted error above the scenario's limit for every agent in range
  clock,       ///< the stamp disagrees with the robot's clock
  history,     ///< the history does not cover the stamp, or not yet
  unreadable,  ///< labelled a scan, but cannot be decoded
  guard,       ///< no result in time
  fault,       ///< a broken invariant; the text names it
  no_beam,     ///< not one beam has a range or is out of range: the laser is covered or broken
};
constexpr std::size_t kDegradedKinds = 9;
const char* to_string(Degraded why);

/// Refused messages of one kind: the same but for the numbers in them.
struct Refusal {
  std::string kind, text;   ///< without its numbers; of the newest
  std::uint64_t count = 0;  ///< since the start
};

struct Tally {
  std::uint64_t scans_in = 0, scans_out = 0;
  std::uint64_t scans_left_out = 0;  ///< of these, published unchanged and missing in the session log
  std::uint64_t foreign_scans = 0;   ///< messages on SCAN of another type: not forwarded, not in scans_in
  std::uint64_t scans_of_real_lasers = 0;  ///< in scans_in; a simulated laser measures agents directly
  std::uint64_t scans_without_agent = 0;   ///< of real lasers: no agent was within range
  std::uint64_t scans_all_hidden = 0;  ///< of real lasers: beams met agents, all behind what is really there
  std::array<std::uint64_t, kDegradedKinds> scans_degraded{};
  std::uint64_t scans_matched = 0, scans_not_matched = 0;  ///< to the map
  std::uint64_t beams_total = 0, beams_replaced = 0;
  std::uint64_t frames_in = 0, frames_out = 0, frames_composited = 0;
  std::uint64_t agent_frames_in = 0, agent_frames_out = 0;  ///< of agents' cameras: due, and published
  std::uint64_t refused_inputs = 0;
  std::string last_refusal;
  std::vector<Refusal> refusals;  ///< each kind, the newest last; of more than 32 the newest
  std::array<std::uint64_t, static_cast<std::size_t>(kLastEventKind) + 1> events{};  ///< by EventKind
  Percentiles pose_age_us;
  Percentiles slam_us;                              ///< SLAM's own step times from POSE_COV
  std::optional<double> radio_power, battery_left;  ///< of the trainee's simulated robot (SupplyState)
};

}  // namespace parhelion::tick
