// Messages from other publishers on the server's own channels.
#pragma once

#include <cstdint>

#include "protocols/channel_map.hpp"

namespace parhelion::tick {

/// Represents the channel on which servers publish their status, beside the indices in sensor_channels().
inline std::int64_t status_channel_index() { return static_cast<std::int64_t>(sensor_channels().size()); }
inline constexpr const char* kOtherServerText =
    "another server (serve, demo or play --publish) is on this bus: both process the same scans and "
    "commands, and their events are interleaved; stop one of them, or give it its own bus (--url)";

}  // namespace parhelion::tick
