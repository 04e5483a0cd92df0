// A base station that shows a recording: pages see what was recorded, and press the keys of `play`.
#pragma once

#include <memory>
#include <string>

#include "server/runtime/play/player.hpp"
#include "server/station/base_station.hpp"
#include "tools/play/play_thread.hpp"

namespace parhelion::tools {

/// Pages act on `player` and wake `thread`; both outlive the station, and so does `hub`, on which the player
/// publishes. Error: the recording's configuration does not read, or the address cannot be used.
Result<std::unique_ptr<station::BaseStation>> open_play_station(const std::string& address, MemoryBusHub& hub,
                                                                runtime::Player& player, PlayThread& thread);

/// The marks of a recording: [{"t", "kind", "text", "bad"}].
std::string marks_json(const std::vector<runtime::RecordedMark>& marks);

}  // namespace parhelion::tools
