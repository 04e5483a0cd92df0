// LCM datagrams byte by byte, true or not, and a socket that sends them.
#pragma once

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/bus/multicast_group.hpp"

namespace parhelion::test {

using Datagram = std::vector<std::uint8_t>;

inline void append_number(Datagram& bytes, std::uint32_t number, int size) {
  for (int shift = 8 * (size - 1); shift >= 0; shift -= 8)
    bytes.push_back(static_cast<std::uint8_t>(number >> shift));
}

/// "LC02", a whole message.
inline Datagram short_message(const Message& message) {
  Datagram bytes{'L', 'C', '0', '2'};
  append_number(bytes, 1, 4);
  bytes.insert(bytes.end(), message.channel.c_str(), message.channel.c_str() + message.channel.size() + 1);
  bytes.insert(bytes.end(), message.payload.begin(), message.payload.end());
  return bytes;
}

/// What the header of a fragment ("LC03") says, whether or not it is so.
struct FragmentHeader {
  std::uint32_t sequence = 1, size = 0, offset = 0;
  std::uint16_t index = 0, count = 1;
};

/// Fragment 0 carries the channel, too.
inline Datagram fragment(const FragmentHeader& header, const std::string& channel, const Datagram& carried) {
  Datagram bytes{'L', 'C', '0', '3'};
  for (const std::uint32_t field : {header.sequence, header.size, header.offset})
    append_number(bytes, field, 4);
  for (const std::uint16_t field : {header.index, header.count}) append_number(bytes, field, 2);
  if (header.index == 0) bytes.insert(bytes.end(), channel.c_str(), channel.c_str() + channel.size() + 1);
  bytes.insert(bytes.end(), carried.begin(), carried.end());
  return bytes;
}

class RawSender {
 public:
  /// To the group of `url`, or to `address` with its port.
  explicit RawSender(const std::string& url, const char* address = nullptr)
      : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    const auto group = parse_lcm_url(url);
    to_.sin_family = AF_INET;
    to_.sin_port = htons(group->port);
    to_.sin_addr = group->address;
    if (address != nullptr) inet_pton(AF_INET, address, &to_.sin_addr);
  }
  ~RawSender() { close(socket_); }
  RawSender(const RawSender&) = delete;
  RawSender& operator=(const RawSender&) = delete;

  void send(const Datagram& datagram) const {
    (void)sendto(socket_, datagram.data(), datagram.size(), 0, reinterpret_cast<const sockaddr*>(&to_),
                 sizeof to_);
  }

 private:
  const int socket_;
  sockaddr_in to_{};
};

}  // namespace parhelion::test
