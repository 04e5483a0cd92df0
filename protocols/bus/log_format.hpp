// The event log of LCM: each event is a header of 28 bytes, the channel and the payload, all big-endian.
// https://lcm-proj.github.io/lcm/content/log-file-format.html
#pragma once

#include <cstddef>
#include <cstdint>

namespace parhelion {

constexpr std::uint32_t kSyncBits = 0xEDA1DA01;
/// Sync word, event number (8 bytes), time stamp (8), length of the channel (4), length of the payload (4).
constexpr std::size_t kHeaderSize = 28;
/// Largest payload, in bytes; liblcm's own limit of a message.
constexpr std::int64_t kMaxData = std::int64_t{1} << 28;

}  // namespace parhelion
