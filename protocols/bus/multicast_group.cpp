#include "protocols/bus/multicast_group.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <charconv>
#include <climits>
#include <cstdlib>
#include <optional>
#include <sstream>
#include <string_view>

namespace parhelion {
namespace {

constexpr const char* kScheme = "udpm://";

std::optional<long> number(std::string_view text, long max_value) {
  long value = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < 0 || value > max_value)
    return std::nullopt;
  return value;
}

}  // namespace

std::string chosen_lcm_url(const std::string& url) {
  if (!url.empty()) return url;
  const char* from_environment = std::getenv("LCM_DEFAULT_URL");
  return from_environment != nullptr && *from_environment != '\0' ? from_environment : kDefaultLcmUrl;
}

Result<MulticastGroup> parse_lcm_url(const std::string& url) {
  const auto wrong = [&](const std::string& what) {
    return Error{"network bus " + url + ": " + what + ", expected as in " + kDefaultLcmUrl};
  };
  if (!url.starts_with(kScheme)) return wrong("not a " + std::string(kScheme) + " URL");
  const std::string rest = url.substr(std::string_view(kScheme).size());
  const std::size_t question = std::min(rest.find('?'), rest.size());
  const std::string place = rest.substr(0, question);
  const std::size_t colon = std::min(place.find(':'), place.size());
  const std::string host = colon == 0 ? "239.255.76.67" : place.substr(0, colon);
  MulticastGroup group;
  if (inet_aton(host.c_str(), &group.address) == 0 || !IN_MULTICAST(ntohl(group.address.s_addr)))
    return wrong("'" + host + "' is not an IPv4 multicast address");
  group.port = 7667;
  if (colon < place.size()) {
    const auto port = number(std::string_view(place).substr(colon + 1), 65'535);
    if (!port || *port == 0) return wrong("'" + place.substr(colon + 1) + "' is not a port");
    group.port = static_cast<std::uint16_t>(*port);
  }
  std::istringstream settings(question < rest.size() ? rest.substr(question + 1) : "");
  for (std::string setting; std::getline(settings, setting, '&');) {
    const std::size_t equals = std::min(setting.find('='), setting.size());
    const std::string key = setting.substr(0, equals);
    if (key != "ttl" && key != "recv_buf_size") continue;
    const auto value = number(std::string_view(setting).substr(std::min(equals + 1, setting.size())),
                              key == "ttl" ? 255 : INT_MAX);
    if (!value) return wrong("'" + setting + "' has no number");
    if (key == "ttl") group.this_machine_only = *value == 0;
    if (key == "recv_buf_size") group.receive_buffer = static_cast<int>(*value);
  }
  return group;
}

std::string bus_address(const std::string& url) {
  const std::string chosen = chosen_lcm_url(url);
  const auto group = parse_lcm_url(chosen);
  if (!group) return chosen;
  char text[INET_ADDRSTRLEN] = {};
  inet_ntop(AF_INET, &group->address, text, sizeof text);
  return std::string(text) + ":" + std::to_string(group->port);
}

}  // namespace parhelion
