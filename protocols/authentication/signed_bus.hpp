// A bus whose messages are signed.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "protocols/authentication/keys.hpp"
#include "protocols/authentication/signature.hpp"
#include "protocols/bus/bus.hpp"

namespace parhelion {

struct RefusedMessage {
  SignatureFault fault;
  std::string_view channel;  ///< valid during the call
  std::string_view sender;   ///< as the message says; empty: unknown
};

/// Signs what it publishes. Receives only what `keys` accept, without the trailers; calls
/// `refused(RefusedMessage)` in the receiving thread for the others. `refused` may be empty.
std::unique_ptr<Bus> sign(std::unique_ptr<Bus> bus, const Keys& keys,
                          std::function<void(const RefusedMessage&)> refused);

}  // namespace parhelion
