// The receiving side of LCM's multicast group: one UDP socket.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
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

  /// `file`: of open(). `hosts` absent: all machines.
  MulticastSocket(int file, const std::optional<OtherHosts>& hosts);
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
  static constexpr std::size_t kMaxNamedHosts = 16;

  bool is_accepted(std::uint32_t address, ArrivalTime now);
  bool is_local(std::uint32_t address, ArrivalTime now);
  void refuse(std::uint32_t address);

  const int file_;
  bool any_host_ = true;
  std::vector<std::uint32_t> other_hosts_, refused_hosts_;
  std::function<void(const std::string& address)> refused_;
  std::vector<std::uint8_t> buffer_;
  std::vector<std::uint32_t> local_addresses_;
  ArrivalTime addresses_read_;
  std::uint64_t lost_ = 0, strangers_ = 0;
};

}  // namespace parhelion
