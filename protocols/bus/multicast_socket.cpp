#include "protocols/bus/multicast_socket.hpp"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>

namespace parhelion {
namespace {

constexpr std::size_t kMaxDatagram = 65'536;
constexpr std::size_t kBatch = 16;  // datagrams read with one system call
constexpr int kMaxBatches = 4;
constexpr Duration kAddressPeriod = seconds(1.0);

Error failed(const char* call) { return Error{std::string(call) + ": " + std::strerror(errno)}; }

template <class Value>
bool set(int file, int level, int option, const Value& value) {
  return setsockopt(file, level, option, &value, sizeof value) == 0;
}

/// What the kernel says about one datagram.
struct Ancillary {
  ArrivalTime arrival;
  std::uint32_t lost = 0;  // since the socket was opened
  bool has_arrival = false, has_lost = false;

  explicit Ancillary(msghdr& header) {
    for (cmsghdr* each = CMSG_FIRSTHDR(&header); each != nullptr; each = CMSG_NXTHDR(&header, each)) {
      if (each->cmsg_level != SOL_SOCKET) continue;
      if (each->cmsg_type == SO_TIMESTAMPNS) {
        timespec at{};
        std::memcpy(&at, CMSG_DATA(each), sizeof at);
        // Whole microseconds, as logs have them: a replay must see the same.
        arrival = ArrivalTime::from_utime(std::int64_t{at.tv_sec} * 1'000'000 + at.tv_nsec / 1000);
        has_arrival = true;
      } else if (each->cmsg_type == SO_RXQ_OVFL) {
        std::memcpy(&lost, CMSG_DATA(each), sizeof lost);
        has_lost = true;
      }
    }
  }
};

ArrivalTime wall_clock() {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  return ArrivalTime::from_utime(std::int64_t{now.tv_sec} * 1'000'000 + now.tv_nsec / 1000);
}

}  // namespace

MulticastSocket::MulticastSocket(int file, const std::optional<OtherHosts>& hosts)
    : file_(file), any_host_(!hosts), buffer_(kBatch * kMaxDatagram) {
  if (!hosts) return;
  refused_ = hosts->refused;
  for (const std::string& each : hosts->addresses) {
    in_addr address{};
    if (inet_pton(AF_INET, each.c_str(), &address) == 1) other_hosts_.push_back(ntohl(address.s_addr));
  }
}

MulticastSocket::~MulticastSocket() { close(file_); }

Result<int> MulticastSocket::open(const MulticastGroup& group) {
  const int file = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (file < 0) return failed("socket");
  const auto give_up = [file](const char* call) {
    const Error error = failed(call);
    close(file);
    return error;
  };
  const int on = 1, off = 0;
  // Several programs of one machine receive the same group.
  if (!set(file, SOL_SOCKET, SO_REUSEADDR, on)) return give_up("SO_REUSEADDR");
  if (!set(file, SOL_SOCKET, SO_TIMESTAMPNS, on)) return give_up("SO_TIMESTAMPNS");
  if (!set(file, SOL_SOCKET, SO_RXQ_OVFL, on)) return give_up("SO_RXQ_OVFL");
  // Only groups that this socket has joined.
  if (!set(file, IPPROTO_IP, IP_MULTICAST_ALL, off)) return give_up("IP_MULTICAST_ALL");
  if (group.receive_buffer > 0 && !set(file, SOL_SOCKET, SO_RCVBUF, group.receive_buffer))
    return give_up("SO_RCVBUF");
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr = group.address;
  address.sin_port = htons(group.port);
  if (bind(file, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return give_up("bind");
  ip_mreq membership{};
  membership.imr_multiaddr = group.address;
  membership.imr_interface.s_addr = htonl(INADDR_ANY);  // that of the multicast route, as the sender's
  if (!set(file, IPPROTO_IP, IP_ADD_MEMBERSHIP, membership)) return give_up("IP_ADD_MEMBERSHIP");
  return file;
}

Status MulticastSocket::read(const std::function<void(const Datagram&)>& take) {
  std::array<mmsghdr, kBatch> headers{};
  std::array<iovec, kBatch> parts{};
  std::array<sockaddr_in, kBatch> senders{};
  alignas(cmsghdr) std::array<std::array<std::uint8_t, 128>, kBatch> ancillary{};
  for (int batch = 0; batch < kMaxBatches; ++batch) {
    for (std::size_t i = 0; i < kBatch; ++i) {
      parts[i] = {buffer_.data() + i * kMaxDatagram, kMaxDatagram};
      headers[i].msg_hdr = {&senders[i],         sizeof senders[i],   &parts[i], 1,
                            ancillary[i].data(), ancillary[i].size(), 0};
    }
    const int received = recvmmsg(file_, headers.data(), kBatch, MSG_DONTWAIT, nullptr);
    if (received < 0) {
      if (errno == EAGAIN || errno == EINTR || errno == ECONNREFUSED) return {};
      return failed("recvmmsg");
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(received); ++i) {
      const Ancillary receipt(headers[i].msg_hdr);
      if (receipt.has_lost) lost_ = std::max<std::uint64_t>(lost_, receipt.lost);
      const ArrivalTime arrival = receipt.has_arrival ? receipt.arrival : wall_clock();
      const DatagramSender sender{ntohl(senders[i].sin_addr.s_addr), ntohs(senders[i].sin_port)};
      if (!is_accepted(sender.address, arrival)) {
        refuse(sender.address);
        continue;
      }
      take({sender,
            arrival,
            (headers[i].msg_hdr.msg_flags & MSG_TRUNC) != 0,
            {static_cast<const std::uint8_t*>(parts[i].iov_base), headers[i].msg_len}});
    }
    if (static_cast<std::size_t>(received) < kBatch) break;
  }
  return {};
}

bool MulticastSocket::is_accepted(std::uint32_t address, ArrivalTime now) {
  return any_host_ || std::ranges::find(other_hosts_, address) != other_hosts_.end() ||
         is_local(address, now);
}

void MulticastSocket::refuse(std::uint32_t address) {
  ++strangers_;
  if (refused_hosts_.size() >= kMaxNamedHosts) return;
  if (std::ranges::find(refused_hosts_, address) != refused_hosts_.end()) return;
  refused_hosts_.push_back(address);
  if (!refused_) return;
  std::array<char, INET_ADDRSTRLEN> text{};
  const in_addr at{htonl(address)};
  refused_(inet_ntop(AF_INET, &at, text.data(), text.size()));
}

/// Addresses of the machine's interfaces may change; they are read again for an unknown one, once a second
/// at most.
bool MulticastSocket::is_local(std::uint32_t address, ArrivalTime now) {
  if (address >> 24U == 127) return true;
  const auto known = [&] {
    return std::find(local_addresses_.begin(), local_addresses_.end(), address) != local_addresses_.end();
  };
  if (known()) return true;
  if (!local_addresses_.empty() && now - addresses_read_ < kAddressPeriod && now >= addresses_read_)
    return false;
  addresses_read_ = now;
  local_addresses_.clear();
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) != 0) return false;
  for (const ifaddrs* each = first; each != nullptr; each = each->ifa_next) {
    if (each->ifa_addr == nullptr || each->ifa_addr->sa_family != AF_INET) continue;
    const auto* at = reinterpret_cast<const sockaddr_in*>(each->ifa_addr);
    local_addresses_.push_back(ntohl(at->sin_addr.s_addr));
  }
  freeifaddrs(first);
  return known();
}

}  // namespace parhelion
