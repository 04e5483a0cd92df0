#include "tools/foxglove_option.hpp"

#include "server/hmi/station/base_station.hpp"

namespace parhelion {

Result<std::unique_ptr<FoxgloveServer>> open_foxglove(const std::string& address, std::unique_ptr<Bus> bus,
                                                      const Configuration& configuration) {
  const auto where = parse_host_port(address);
  if (!where) return where.error();
  FoxgloveOptions options;
  options.host = where->host;
  options.port = where->port;
  return FoxgloveServer::open(std::move(bus), configuration, options);
}

}  // namespace parhelion
