#include "tools/robot_bus_guard.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>

#include "protocols/bus/multicast_group.hpp"

namespace parhelion::tools {
namespace {

bool is_loopback(std::uint32_t address) { return ntohl(address) >> 24U == 127; }

/// IPv4, network byte order, without loopback.
std::vector<std::uint32_t> own_addresses() {
  std::vector<std::uint32_t> addresses;
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) != 0) return addresses;
  for (const ifaddrs* each = first; each != nullptr; each = each->ifa_next) {
    if (each->ifa_addr == nullptr || each->ifa_addr->sa_family != AF_INET) continue;
    const auto address = reinterpret_cast<const sockaddr_in*>(each->ifa_addr)->sin_addr.s_addr;
    if (!is_loopback(address)) addresses.push_back(address);
  }
  freeifaddrs(first);
  return addresses;
}

sockaddr_in endpoint(std::uint32_t address, std::uint16_t port) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = address;
  at.sin_port = htons(port);
  return at;
}

/// A socket that nobody reads: its buffer is small, and what comes is dropped. -1: the address is gone.
int bind_to(std::uint32_t address, std::uint16_t port) {
  const int file = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int on = 1, off = 0, small = 1;
  const sockaddr_in at = endpoint(address, port);
  const bool bound = setsockopt(file, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) == 0 &&
                     setsockopt(file, IPPROTO_IP, IP_MULTICAST_ALL, &off, sizeof off) == 0 &&
                     setsockopt(file, SOL_SOCKET, SO_RCVBUF, &small, sizeof small) == 0 &&
                     bind(file, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0;
  if (bound) return file;
  close(file);
  return -1;
}

/// The address from which the kernel would send to the group; 0: there is no route.
std::uint32_t source_for(const MulticastGroup& group) {
  const int file = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in at = endpoint(group.address.s_addr, group.port);
  socklen_t size = sizeof at;
  const bool known = connect(file, reinterpret_cast<const sockaddr*>(&at), sizeof at) == 0 &&
                     getsockname(file, reinterpret_cast<sockaddr*>(&at), &size) == 0;
  close(file);
  return known ? at.sin_addr.s_addr : 0;
}

std::string text_of(std::uint32_t address) {
  std::array<char, INET_ADDRSTRLEN> text{};
  const in_addr at{address};
  return inet_ntop(AF_INET, &at, text.data(), text.size());
}

}  // namespace

RobotBusGuard::RobotBusGuard(std::uint16_t port) : port_(port) { refresh(); }

RobotBusGuard::~RobotBusGuard() {
  for (const Bound& each : bound_) close(each.file);
}

void RobotBusGuard::refresh() {
  for (const std::uint32_t address : own_addresses()) {
    const bool known =
        std::any_of(bound_.begin(), bound_.end(), [&](const Bound& each) { return each.address == address; });
    if (known) continue;
    if (const int file = bind_to(address, port_); file >= 0) bound_.push_back({address, file});
  }
}

std::string open_group(const std::string& url) {
  const auto group = parse_lcm_url(url);
  if (!group) return {};
  const std::uint32_t source = source_for(*group);
  if (source == 0 || is_loopback(source)) return {};
  const std::string name = text_of(group->address.s_addr);
  return "other machines can send to the robot's own bus: its group " + name + " is joined at " +
         text_of(source) + ", not at loopback; run: ip link set lo multicast on; ip route add " + name +
         "/32 dev lo src 127.0.0.1";
}

}  // namespace parhelion::tools
