// Checks of a request before it is processed. Pure functions of text.
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

/// nullopt: not a valid path: does not begin with '/', is badly encoded, or contains "..", '\\' or a control
/// character in any encoding.
std::optional<RequestTarget> parse_target(std::string_view target);

/// The host of a Host header or an authority, without its port, in lower case; brackets of IPv6 removed.
/// Empty: invalid.
std::string host_name(std::string_view authority);

/// Host names that requests may use: any address, localhost, and those given. Other names could be DNS
/// rebinding.
class HostNames {
 public:
  explicit HostNames(const std::vector<std::string>& names);
  bool knows(std::string_view host_header) const;

 private:
  std::vector<std::string> names_;
};

/// True if the requesting page came from this server: `origin` and `host` are the headers.
bool same_origin(std::string_view origin, std::string_view host, bool encrypted);

/// True if the requester is a program: without an origin or with that of a file, a page of the same host on
/// any port, or one of `origins`. "null" is none: any page can have it.
bool program_origin(std::string_view origin, std::string_view host, const std::vector<std::string>& origins);

/// Unit of per-network limits: an IPv4 address, or the first 64 bits of an IPv6 address.
std::string network_of(const std::string& address);

}  // namespace parhelion::station
