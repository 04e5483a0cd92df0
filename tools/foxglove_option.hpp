// The option --foxglove ADDR:PORT of commands that show a session.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "server/station/foxglove/foxglove_server.hpp"

namespace parhelion::tools {

/// A server for Foxglove and Lichtblick at `address`, showing `bus`. `clock`: see FoxgloveOptions. Error:
/// invalid address, or it cannot be used.
Result<std::unique_ptr<station::FoxgloveServer>> open_foxglove(const std::string& address,
                                                               std::unique_ptr<Bus> bus,
                                                               const tick::Configuration& configuration,
                                                               std::function<ArrivalTime()> clock = {});

}  // namespace parhelion::tools
