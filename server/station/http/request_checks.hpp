// What of a request is checked before anything is done with it. Pure functions of text.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace parhelion::station {

struct RequestTarget {
  std::string path;   ///< decoded, begins with '/'
  std::string query;  ///< as sent
};

/// nullopt: not a path of this server: does not begin with '/', badly encoded, or with "..", '\\' or a
/// control character in it, in whatever encoding.
std::optional<RequestTarget> parse_target(std::string_view target);

/// The host of a Host header or an authority, without its port, in lower case; brackets of IPv6 taken off.
/// Empty: not one.
std::string host_name(std::string_view authority);

/// Names under which a server may be asked for: any address, localhost, and those given. All others are names
/// that someone else let point here (DNS rebinding).
class HostNames {
 public:
  explicit HostNames(const std::vector<std::string>& names);
  bool knows(std::string_view host_header) const;

 private:
  std::vector<std::string> names_;
};

/// Whether the page that asks came from this server: `origin` and `host` are the headers.
bool same_origin(std::string_view origin, std::string_view host, bool encrypted);

/// What counts as one neighbour in limits: an IPv4 address, or the first 64 bits of an IPv6 one.
std::string network_of(const std::string& address);

}  // namespace parhelion::station
