#include "tools/foxglove_option.hpp"

#include <utility>

#include "server/station/base_station.hpp"

namespace parhelion::tools {

Result<std::unique_ptr<station::FoxgloveServer>> open_foxglove(const std::string& address,
                                                               std::unique_ptr<Bus> bus,
                                                               const tick::Configuration& configuration,
                                                               std::function<ArrivalTime()> clock) {
  const auto where = station::parse_host_port(address);
  if (!where) return where.error();
  station::FoxgloveOptions options;
  options.host = where->host;
  options.port = where->port;
  options.clock = std::move(clock);
  return station::FoxgloveServer::open(std::move(bus), configuration, options);
}

}  // namespace parhelion::tools
