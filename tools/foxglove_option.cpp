#include "tools/foxglove_option.hpp"

#include <utility>

#include "server/hmi/station/base_station.hpp"

namespace parhelion {

Result<std::unique_ptr<FoxgloveServer>> open_foxglove(const std::string& address, std::unique_ptr<Bus> bus,
                                                      const Configuration& configuration,
                                                      std::function<ArrivalTime()> clock) {
  const auto where = parse_host_port(address);
  if (!where) return where.error();
  FoxgloveOptions options;
  options.host = where->host;
  options.port = where->port;
  options.clock = std::move(clock);
  return FoxgloveServer::open(std::move(bus), configuration, options);
}

}  // namespace parhelion
