// A base station that shows a recording: pages see what was recorded, and press the keys of `play`.
#pragma once

#include <memory>
#include <string>

#include "server/hmi/station/base_station.hpp"
#include "server/play/player.hpp"
#include "tools/play/play_thread.hpp"

namespace parhelion {

/// Pages act on `player` and wake `thread`; both outlive the station, and so does `hub`, on which the player
/// publishes. Error: the recording's configuration does not read, or the address cannot be used.
Result<std::unique_ptr<BaseStation>> open_play_station(const std::string& address, MemoryBusHub& hub,
                                                       Player& player, PlayThread& thread);

/// The marks of a recording: [{"t", "kind", "text", "bad"}].
std::string marks_json(const std::vector<RecordedMark>& marks);

}  // namespace parhelion
