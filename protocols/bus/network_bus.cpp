// LCM over the network. liblcm 1.3.1 only sends: its receiver trusts the lengths in a datagram, so that one
// from a stranger can end the program or be completed with memory of it. A thread of ours reads the socket,
// so that a slow caller loses the oldest message of a queue, and not what the kernel has no room for.
#include <arpa/inet.h>
#include <lcm/lcm.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <climits>
#include <cstring>
#include <mutex>
#include <thread>
#include <unordered_map>

#include "protocols/bus/bus.hpp"
#include "protocols/bus/channel_pattern.hpp"
#include "protocols/bus/multicast_group.hpp"
#include "protocols/bus/multicast_socket.hpp"
#include "protocols/bus/network_speaker.hpp"
#include "protocols/bus/queues.hpp"
#include "protocols/bus/reassembly.hpp"

namespace parhelion {
namespace {

constexpr const char* kRouteRemedy =
    "; give the machine a multicast route: ip link set lo multicast on; "
    "ip route replace 224.0.0.0/4 dev lo src 127.0.0.1";

/// Queries the kernel for a route to the group: liblcm would print the reason instead of returning it.
Status check_route(const std::string& url, const MulticastGroup& group) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(group.port);
  address.sin_addr = group.address;
  const int probe = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (probe < 0) return Error{"network bus " + url + ": no UDP socket: " + std::strerror(errno)};
  const int connected = connect(probe, reinterpret_cast<const sockaddr*>(&address), sizeof address);
  const int reason = errno;
  close(probe);
  if (connected == 0) return {};
  return Error{"network bus " + url + ": no route to the multicast group: " + std::strerror(reason) +
               kRouteRemedy};
}

Status send(lcm_t* lcm, const std::string& url, std::string_view channel,
            std::span<const std::uint8_t> payload) {
  if (Status status = check_message(channel, payload.size()); !status) return status;
  const std::string name(channel);
  if (lcm_publish(lcm, name.c_str(), payload.data(), static_cast<unsigned>(payload.size())) == 0) return {};
  return Error{"publish on " + name + ": " + std::to_string(payload.size()) + " bytes were not sent over " +
               url + ": " + std::strerror(errno)};
}

/// As in Message::sender.
std::uint64_t number_of(const DatagramSender& sender) {
  return (std::uint64_t{sender.address} << 16) | sender.port;
}

class NetworkSpeaker : public Bus {
 public:
  NetworkSpeaker(lcm_t* lcm, std::string url) : lcm_(lcm), url_(std::move(url)) {}
  ~NetworkSpeaker() override { lcm_destroy(lcm_); }
  NetworkSpeaker(const NetworkSpeaker&) = delete;
  NetworkSpeaker& operator=(const NetworkSpeaker&) = delete;

  Status publish(std::string_view channel, std::span<const std::uint8_t> payload) override {
    return send(lcm_, url_, channel, payload);
  }
  Result<bool> receive(Message&, Duration) override {
    return Error{"receive from " + url_ + ": this bus only publishes"};
  }
  Status subscribe(const std::string& pattern, int) override {
    return Error{"subscribe to '" + pattern + "' over " + url_ + ": this bus only publishes"};
  }
  std::uint64_t dropped() const override { return 0; }

 private:
  lcm_t* lcm_;
  const std::string url_;
};

class NetworkBus : public Bus {
 public:
  NetworkBus(lcm_t* lcm, int socket, const std::optional<OtherHosts>& hosts, std::string url)
      : lcm_(lcm),
        url_(std::move(url)),
        socket_(socket, hosts),
        reassembly_([this](std::string_view channel) { return max_payload(channel); }),
        news_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
        ended_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
        reader_([this] { read_until_ended(); }) {}
  ~NetworkBus() override {
    eventfd_write(ended_, 1);
    reader_.join();
    close(news_);
    close(ended_);
    lcm_destroy(lcm_);
  }
  NetworkBus(const NetworkBus&) = delete;
  NetworkBus& operator=(const NetworkBus&) = delete;

  Status publish(std::string_view channel, std::span<const std::uint8_t> payload) override {
    return send(lcm_, url_, channel, payload);
  }

  Result<bool> receive(Message& message, Duration timeout) override {
    const auto deadline =
        std::chrono::steady_clock::now() + std::chrono::nanoseconds(std::max<std::int64_t>(timeout.ns, 0));
    while (true) {
      {
        const std::lock_guard lock(mutex_);
        if (queues_.pop(message)) return true;
        if (!failure_.empty()) return Error{"receive from " + url_ + ": " + failure_};
        eventfd_t ignored = 0;
        eventfd_read(news_, &ignored);  // nothing waits: a later message wakes again
      }
      const auto left =
          std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
      if (left.count() <= 0) return false;
      pollfd waiting{news_, POLLIN, 0};
      if (poll(&waiting, 1, static_cast<int>(std::min<std::int64_t>(left.count(), INT_MAX))) < 0) {
        // A signal ends the wait early: the caller decides whether to stop.
        if (errno == EINTR) return false;
        return Error{"receive from " + url_ + ": " + std::strerror(errno)};
      }
    }
  }

  Status subscribe(const std::string& pattern, int capacity) override {
    if (Status status = check_capacity(pattern, capacity); !status) return status;
    auto made = make_pattern(pattern);
    if (!made) return made.error();
    const std::lock_guard lock(mutex_);
    subscriptions_.push_back({std::move(*made), queues_.add(capacity)});
    queues_of_channel_.clear();
    return {};
  }

  std::uint64_t dropped() const override {
    const std::lock_guard lock(mutex_);
    return queues_.dropped() + lost_;
  }

  /// Whether the program receives what it sends: publishes on a channel of its own until it comes back.
  bool receives_itself() {
    constexpr const char* kProbe = "LCM_SELF_TEST";  // as liblcm's
    if (!subscribe(kProbe, 1)) return false;
    Message message;
    for (int attempt = 0; attempt < 10; ++attempt) {
      if (!publish(kProbe, {})) return false;
      const auto came = receive(message, milliseconds(100));
      if (!came) return false;
      if (*came) break;
    }
    const std::lock_guard lock(mutex_);
    subscriptions_.clear();
    queues_ = {};
    queues_of_channel_.clear();
    return message.channel == kProbe;
  }

 private:
  struct Subscription {
    ChannelPattern pattern;
    std::size_t queue;
  };

  /// Indices of the queues that take the channel. The result is kept; an attacker's many names are forgotten.
  const std::vector<std::size_t>& queues_of(std::string_view channel) {
    const std::string name(channel);
    const auto known = queues_of_channel_.find(name);
    if (known != queues_of_channel_.end()) return known->second;
    if (queues_of_channel_.size() >= kMaxKnownChannels) queues_of_channel_.clear();
    std::vector<std::size_t>& queues = queues_of_channel_[name];
    for (const Subscription& each : subscriptions_) {
      if (each.pattern.matches(channel)) queues.push_back(each.queue);
    }
    return queues;
  }

  std::size_t max_payload(std::string_view channel) {
    const std::lock_guard lock(mutex_);
    return queues_of(channel).empty() ? 0 : kMaxPayload;
  }

  void read_until_ended() {
    std::array<pollfd, 2> waiting{{{socket_.file(), POLLIN, 0}, {ended_, POLLIN, 0}}};
    while (true) {
      if (poll(waiting.data(), waiting.size(), -1) < 0 && errno != EINTR) return fail(std::strerror(errno));
      if (waiting[1].revents != 0) return;
      const Status status =
          socket_.read([this](const MulticastSocket::Datagram& datagram) { take(datagram); });
      if (!status) return fail(status.error().message);
      const std::lock_guard lock(mutex_);
      lost_ = socket_.lost() + reassembly_.faults()[static_cast<std::size_t>(DatagramFault::incomplete)];
    }
  }

  void take(const MulticastSocket::Datagram& datagram) {
    if (datagram.truncated) return reassembly_.count(DatagramFault::truncated);
    const auto message = reassembly_.add(datagram.sender, datagram.bytes, datagram.arrival);
    if (!message) return;
    {
      const std::lock_guard lock(mutex_);
      for (const std::size_t queue : queues_of(message->channel))
        queues_.push(queue, message->channel, datagram.arrival, message->payload, number_of(datagram.sender));
    }
    eventfd_write(news_, 1);
  }

  void fail(const std::string& why) {
    {
      const std::lock_guard lock(mutex_);
      failure_ = why;
    }
    eventfd_write(news_, 1);
  }

  static constexpr std::size_t kMaxPayload = std::size_t{16} << 20;  // bytes
  static constexpr std::size_t kMaxKnownChannels = 4096;

  lcm_t* lcm_;  // sends only
  const std::string url_;
  MulticastSocket socket_;  // used by the reader
  Reassembly reassembly_;   // used by the reader
  mutable std::mutex mutex_;
  SubscriptionQueues queues_;
  std::vector<Subscription> subscriptions_;
  std::unordered_map<std::string, std::vector<std::size_t>> queues_of_channel_;
  std::uint64_t lost_ = 0;  // before it reached a queue
  std::string failure_;     // of the reader, which has ended
  const int news_, ended_;  // event counters
  std::thread reader_;
};

struct Opened {
  lcm_t* lcm;
  MulticastGroup group;
  std::string url;
};

/// Opens LCM for sending.
Result<Opened> open_lcm(const std::string& url) {
  const std::string chosen = chosen_lcm_url(url);
  if (!chosen.starts_with("udpm://")) {
    return Error{"network bus '" + chosen + "': expected a url such as " + kDefaultLcmUrl +
                 "; read a log with --log. tcpq: urls are not supported, because LCM ends the program if its "
                 "server is missing"};
  }
  const auto group = parse_lcm_url(chosen);
  if (!group) return group.error();
  if (Status status = check_route(chosen, *group); !status) return status.error();
  lcm_t* lcm = lcm_create(chosen.c_str());
  if (lcm == nullptr)
    return Error{"network bus " + chosen + ": liblcm refused it; expected as in " + kDefaultLcmUrl};
  return Opened{lcm, *group, chosen};
}

}  // namespace

Result<std::unique_ptr<Bus>> open_network_speaker(const std::string& url) {
  auto opened = open_lcm(url);
  if (!opened) return opened.error();
  return std::unique_ptr<Bus>(std::make_unique<NetworkSpeaker>(opened->lcm, opened->url));
}

Result<std::unique_ptr<Bus>> open_network_bus(const std::string& url, std::optional<OtherHosts> hosts) {
  const auto opened = open_lcm(url);
  if (!opened) return opened.error();
  const auto socket = MulticastSocket::open(opened->group);
  if (!socket) {
    lcm_destroy(opened->lcm);
    return Error{"network bus " + opened->url + ": " + socket.error().message};
  }
  if (opened->group.this_machine_only) hosts = OtherHosts{{}, hosts ? hosts->refused : nullptr};
  auto bus = std::make_unique<NetworkBus>(opened->lcm, *socket, hosts, opened->url);
  if (!bus->receives_itself())
    return Error{"network bus " + opened->url + ": the program does not receive its own messages" +
                 kRouteRemedy};
  return std::unique_ptr<Bus>(std::move(bus));
}

}  // namespace parhelion
