#include "tools/foxglove_option.hpp"

#include <sstream>
#include <utility>

#include "server/station/base_station.hpp"

namespace parhelion::tools {

Result<std::unique_ptr<station::FoxgloveServer>> open_foxglove(const std::string& address,
                                                               std::unique_ptr<Bus> bus,
                                                               const tick::Configuration& configuration,
                                                               std::function<ArrivalTime()> clock) {
  std::istringstream parts(address);
  std::string place;
  std::getline(parts, place, ',');
  const auto where = station::parse_host_port(place);
  if (!where) return where.error();
  station::FoxgloveOptions options;
  for (std::string origin; std::getline(parts, origin, ',');) options.origins.push_back(origin);
  options.host = where->host;
  options.port = where->port;
  options.clock = std::move(clock);
  return station::FoxgloveServer::open(std::move(bus), configuration, options);
}

}  // namespace parhelion::tools
