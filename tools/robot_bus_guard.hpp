// Keeps other machines off the robot's own bus.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace parhelion::tools {

/// Programs with liblcm receive on every address of the machine: a stranger's datagram to one of them would
/// reach a motor and no relay. Linux delivers a datagram to the socket that is bound most specifically: this
/// binds the bus's port at each address other than loopback, and discards what comes.
class RobotBusGuard {
 public:
  explicit RobotBusGuard(std::uint16_t port);
  ~RobotBusGuard();
  RobotBusGuard(const RobotBusGuard&) = delete;
  RobotBusGuard& operator=(const RobotBusGuard&) = delete;

  /// Adds the addresses that the machine has got since; call once a second.
  void refresh();

 private:
  struct Bound {
    std::uint32_t address;  ///< IPv4, network byte order
    int file;
  };
  const std::uint16_t port_;
  std::vector<Bound> bound_;
};

/// What lets other machines send to the group of this LCM URL although its ttl is 0, with the remedy; empty:
/// nothing, since the group is routed over loopback, so that no other interface joins it.
std::string open_group(const std::string& url);

}  // namespace parhelion::tools
