// The group that an LCM URL names.
#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <string>

#include "protocols/status.hpp"

namespace parhelion {

struct MulticastGroup {
  in_addr address{};
  std::uint16_t port = 0;
  bool this_machine_only = true;  ///< ttl=0: datagrams of other machines are refused
  int receive_buffer = 0;         ///< bytes; 0: the kernel's default
};

inline constexpr const char* kDefaultLcmUrl = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304";

/// `url`, or if it is empty LCM_DEFAULT_URL, or if that is not set the default: this machine only.
std::string chosen_lcm_url(const std::string& url);

/// udpm://ADDRESS:PORT?ttl=N&recv_buf_size=N, each part optional, as liblcm reads it. Error: what is wrong,
/// with an example.
Result<MulticastGroup> parse_lcm_url(const std::string& url);

/// ADDRESS:PORT of a chosen URL: the same for all ways to write it; the URL itself if it cannot be parsed.
std::string bus_address(const std::string& url);

}  // namespace parhelion
