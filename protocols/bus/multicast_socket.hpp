// The receiving side of LCM's multicast group: one UDP socket.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "protocols/bus/multicast_group.hpp"
#include "protocols/bus/reassembly.hpp"
#include "protocols/status.hpp"

namespace parhelion {

/// Bound to the group's address: a datagram sent to the machine's own address does not arrive.
class MulticastSocket {
 public:
  struct Datagram {
    DatagramSender sender;
    ArrivalTime arrival;  ///< receipt by the kernel, microseconds
    bool truncated = false;
    std::span<const std::uint8_t> bytes;  ///< valid until the next call
  };

  explicit MulticastSocket(int file, bool this_machine_only);
  ~MulticastSocket();
  MulticastSocket(const MulticastSocket&) = delete;
  MulticastSocket& operator=(const MulticastSocket&) = delete;

  /// A file descriptor with all options set. Error: which call failed, and why.
  static Result<int> open(const MulticastGroup& group);

  /// Calls take(datagram) for datagrams that have arrived, at most 64; does not wait. Error: the socket
  /// failed.
  Status read(const std::function<void(const Datagram&)>& take);

  int file() const { return file_; }
  std::uint64_t lost() const { return lost_; }            ///< by the kernel, where the buffer was full
  std::uint64_t strangers() const { return strangers_; }  ///< datagrams refused as of another machine

 private:
  bool is_local(std::uint32_t address, ArrivalTime now);

  const int file_;
  const bool this_machine_only_;
  std::vector<std::uint8_t> buffer_;
  std::vector<std::uint32_t> local_addresses_;
  ArrivalTime addresses_read_;
  std::uint64_t lost_ = 0, strangers_ = 0;
};

}  // namespace parhelion
