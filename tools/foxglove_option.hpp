// --foxglove ADDR:PORT of the commands that show a session.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "server/hmi/foxglove/foxglove_server.hpp"

namespace parhelion {

/// A server for Foxglove and Lichtblick at `address`, of what is on `bus`. `clock`: as FoxgloveOptions has
/// it. Error: no such address, or it cannot be used.
Result<std::unique_ptr<FoxgloveServer>> open_foxglove(const std::string& address, std::unique_ptr<Bus> bus,
                                                      const Configuration& configuration,
                                                      std::function<ArrivalTime()> clock = {});

}  // namespace parhelion
