// Publishes over the network, and hears nothing: without a socket that packets are copied to, or a thread.
#pragma once

#include <memory>
#include <string>

#include "protocols/bus/bus.hpp"

namespace parhelion {

/// As open_network_bus(); receive() and subscribe() of it are errors.
Result<std::unique_ptr<Bus>> open_network_speaker(const std::string& url);

}  // namespace parhelion
