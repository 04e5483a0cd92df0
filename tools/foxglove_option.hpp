// --foxglove ADDR:PORT of the commands that show a session.
#pragma once

#include <memory>
#include <string>

#include "server/hmi/foxglove/foxglove_server.hpp"

namespace parhelion {

/// A server for Foxglove and Lichtblick at `address`, of what is on `bus`. Error: no such address, or it
/// cannot be used.
Result<std::unique_ptr<FoxgloveServer>> open_foxglove(const std::string& address, std::unique_ptr<Bus> bus,
                                                      const Configuration& configuration);

}  // namespace parhelion
