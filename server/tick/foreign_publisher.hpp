// Messages from other publishers: on the server's own channels, or refused by the bus.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/authentication/signature_fault.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// Canonical channels of the outputs on which another publisher is reported: first sensor_channels(), which
/// only simulated robots publish, then those of every server.
const std::vector<std::string>& own_channels();
/// Names on the bus of MR_SCAN of lasers after their robot's first, and where the robot is simulated of SCAN.
/// Their indices follow those of own_channels() of all robots.
struct LaserOutput {
  std::size_t robot = 0;
  std::string bus;
  bool simulated_sensor = false;
};
std::vector<LaserOutput> further_laser_outputs(const Configuration& configuration);
/// Index of MR_STATUS in own_channels(): another server.
std::int64_t status_channel_index();
inline constexpr const char* kOtherServerText =
    "another server (serve, demo or play --publish) is on this bus: both process the same scans and "
    "commands, and their events are interleaved; stop one of them, or give it its own bus (--url)";

/// LoopDecision::count of a refused message on this bus channel.
std::int64_t refused_message_count(const Configuration& configuration, SignatureFault fault,
                                   std::string_view channel);

/// Another publisher sends on a channel of the server's; `channel` is an index in own_channels(), plus their
/// number for each robot before the one whose channel it is; after those of the last robot
/// further_laser_outputs() follow.
void report_foreign_message(const TickContext& context, std::int64_t channel);
/// `count`: of refused_message_count().
void report_refused_message(const TickContext& context, std::int64_t count);

}  // namespace parhelion::tick
