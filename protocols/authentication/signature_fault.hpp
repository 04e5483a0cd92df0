// Why a signed message is not accepted.
#pragma once

#include <cstddef>
#include <cstdint>

namespace parhelion {

/// Why a message was refused.
enum class SignatureFault : std::uint8_t {
  not_signed,
  unknown_sender,
  wrong_channel,  ///< the sender may not publish there
  bad_signature,  ///< changed on the way, or made with another secret
  wrong_time,     ///< older or newer than Keys::clock permits, or from before the receiver's start
  replayed,       ///< received before, too far behind the newest, or overtaken (must_be_in_order())
  too_many_runs,  ///< the sender has started too often within Keys::clock
};
constexpr std::size_t kSignatureFaults = 7;
/// As words that follow "was".
const char* to_string(SignatureFault fault);

}  // namespace parhelion
