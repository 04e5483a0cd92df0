// A base station that shows a recording: pages display it and control its playback.
#pragma once

#include <memory>
#include <string>

#include "server/runtime/play/player.hpp"
#include "server/station/base_station.hpp"
#include "tools/play/play_thread.hpp"

namespace parhelion::tools {

/// Pages control `player` and wake `thread`; both outlive the station, and so does `hub`, on which the player
/// publishes. Error: the recording's configuration cannot be read, or the address cannot be used.
Result<std::unique_ptr<station::BaseStation>> open_play_station(const std::string& address, MemoryBusHub& hub,
                                                                runtime::Player& player, PlayThread& thread);

/// The marks of a recording: [{"t", "kind", "text", "bad"}].
std::string marks_json(const std::vector<runtime::RecordedMark>& marks);

}  // namespace parhelion::tools
