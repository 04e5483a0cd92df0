// Publishes over the network without receiving: it has neither a receiving socket nor a thread.
#pragma once

#include <memory>
#include <string>

#include "protocols/bus/bus.hpp"

namespace parhelion {

/// As open_network_bus(), but receive() and subscribe() are errors.
Result<std::unique_ptr<Bus>> open_network_speaker(const std::string& url);

}  // namespace parhelion
