// Messages of LCM from UDP datagrams: short messages ("LC02") in one, long ones ("LC03") in fragments.
// https://lcm-proj.github.io/lcm/content/udp-multicast-protocol.html
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/time.hpp"

namespace parhelion {

/// Address and port of a sender; messages of two senders are never mixed.
struct DatagramSender {
  std::uint32_t address = 0;  ///< IPv4, host byte order
  std::uint16_t port = 0;
  auto operator<=>(const DatagramSender&) const = default;
};

/// Why a datagram or an incomplete message was not used.
enum class DatagramFault : std::uint8_t {
  truncated,     ///< shorter than its header, or than the socket's largest datagram
  not_lcm,       ///< neither LC02 nor LC03
  bad_channel,   ///< empty, longer than 63 characters, or without its end
  too_large,     ///< declares more than the channel's largest payload
  inconsistent,  ///< a fragment outside its message, empty, or with a number that its message does not have
  repeated,      ///< a fragment that was received before; the first one counts
  overlapping,   ///< the fragments do not cover the message exactly once
  incomplete,    ///< fragments were missing for too long, or their memory was needed
};
constexpr std::size_t kDatagramFaults = 8;
const char* to_string(DatagramFault fault);

struct ReassemblyLimits {
  std::size_t bytes = std::size_t{18} << 20;  ///< of all incomplete messages
  std::size_t messages = 64;                  ///< incomplete ones
  Duration age = seconds(1.0);                ///< since its newest fragment; older ones are dropped
};

/// Never allocates for what a datagram declares, only for what it carries. Lengths are checked in 64 bits.
class Reassembly {
 public:
  /// Largest payload of a channel, in bytes; 0: nobody wants the channel, its messages are not kept.
  using MaxPayload = std::function<std::size_t(std::string_view channel)>;

  struct Complete {
    std::string_view channel;
    std::span<const std::uint8_t> payload;
  };

  explicit Reassembly(MaxPayload max_payload, const ReassemblyLimits& limits = {});

  /// `arrival`: the datagram's. The message that the datagram completes, valid until the next call.
  std::optional<Complete> add(const DatagramSender& sender, std::span<const std::uint8_t> datagram,
                              ArrivalTime arrival);
  /// To count a datagram that the socket had to truncate.
  void count(DatagramFault fault) { ++faults_[static_cast<std::size_t>(fault)]; }
  const std::array<std::uint64_t, kDatagramFaults>& faults() const { return faults_; }
  std::size_t pending_messages() const { return pending_.size(); }
  std::size_t pending_bytes() const { return bytes_; }  ///< allocated for incomplete messages

 private:
  struct Fragment;
  struct Piece {
    std::uint32_t offset, begin, size;  ///< in the message; in Pending::data
  };
  struct Pending {
    DatagramSender sender;
    std::uint32_t sequence = 0, size = 0;
    std::uint16_t fragments = 0, received = 0;
    ArrivalTime newest;
    bool ignored = false;  ///< nobody wants it: its fragments are only counted
    std::string channel;   ///< of fragment 0
    std::vector<bool> seen;
    std::vector<Piece> pieces;       ///< in the order of arrival
    std::vector<std::uint8_t> data;  ///< the same
    std::size_t bytes() const;
  };
  using PendingList = std::list<Pending>;

  std::optional<Complete> add_short(std::span<const std::uint8_t> datagram);
  std::optional<Complete> add_fragment(const DatagramSender& sender, std::span<const std::uint8_t> datagram,
                                       ArrivalTime arrival);
  PendingList::iterator find(const DatagramSender& sender, const Fragment& fragment, ArrivalTime arrival);
  std::optional<Complete> finish(PendingList::iterator pending);
  void erase(PendingList::iterator pending);
  void drop_old(ArrivalTime now);
  void make_room(const DatagramSender& sender);

  const MaxPayload max_payload_;
  const ReassemblyLimits limits_;
  PendingList pending_;  ///< oldest first
  std::size_t bytes_ = 0;
  std::array<std::uint64_t, kDatagramFaults> faults_{};
  std::string channel_;                ///< of the last complete message
  std::vector<std::uint8_t> payload_;  ///< the same
};

}  // namespace parhelion
