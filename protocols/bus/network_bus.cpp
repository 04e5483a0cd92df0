// LCM over the network. liblcm reads the socket in its own thread and stamps incoming messages; receive()
// moves its queue into ours, because liblcm drops the newest message where a queue is full and does not count
// it.
#include <arpa/inet.h>
#include <lcm/lcm.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <climits>
#include <cstdlib>
#include <cstring>
#include <mutex>

#include "protocols/bus/bus.hpp"
#include "protocols/bus/network_speaker.hpp"
#include "protocols/bus/queues.hpp"

namespace parhelion {
namespace {

constexpr const char* kDefaultUrl = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304";
constexpr const char* kRouteRemedy =
    "; give the machine a multicast route: ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo";
/// How many messages liblcm may queue above a subscription's capacity while receive() is not called.
constexpr int kLiblcmSlack = 200;

std::string chosen_url(const std::string& url) {
  if (!url.empty()) return url;
  const char* from_environment = std::getenv("LCM_DEFAULT_URL");
  return from_environment != nullptr && *from_environment != '\0' ? from_environment : kDefaultUrl;
}

/// Queries the kernel for a route to the group of a udpm url: liblcm would print the reason instead of
/// returning it.
Status check_route(const std::string& url) {
  const std::string rest = url.substr(std::strlen("udpm://"));
  const std::string address = rest.substr(0, rest.find('?'));
  const std::string host = address.substr(0, address.find(':'));
  sockaddr_in group{};
  group.sin_family = AF_INET;
  group.sin_port = htons(7667);
  if (host.empty()) inet_aton("239.255.76.67", &group.sin_addr);
  if (!host.empty() && inet_aton(host.c_str(), &group.sin_addr) == 0) {
    return Error{"network bus " + url + ": '" + host + "' is not an IPv4 multicast address, expected as in " +
                 kDefaultUrl};
  }
  const int probe = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (probe < 0) return Error{"network bus " + url + ": no UDP socket: " + std::strerror(errno)};
  const int connected = connect(probe, reinterpret_cast<const sockaddr*>(&group), sizeof group);
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
  NetworkBus(lcm_t* lcm, int file, std::string url) : lcm_(lcm), file_(file), url_(std::move(url)) {}
  ~NetworkBus() override {
    for (const auto& subscription : subscriptions_) lcm_unsubscribe(lcm_, subscription->handle);
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
      if (Status status = drain(); !status) return status.error();
      {
        const std::lock_guard lock(mutex_);
        if (queues_.pop(message)) return true;
      }
      const auto left =
          std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
      if (left.count() <= 0) return false;
      pollfd waiting{file_, POLLIN, 0};
      if (poll(&waiting, 1, static_cast<int>(std::min<std::int64_t>(left.count(), INT_MAX))) < 0) {
        // A signal ends the wait early: the caller decides whether to stop.
        if (errno == EINTR) return false;
        return Error{"receive from " + url_ + ": " + std::strerror(errno)};
      }
    }
  }

  Status subscribe(const std::string& pattern, int capacity) override {
    if (Status status = check_capacity(pattern, capacity); !status) return status;
    auto subscription = std::make_unique<Subscription>(
        Subscription{this, 0, std::min(capacity, kMaxDrain) + kLiblcmSlack, 0, nullptr});
    {
      const std::lock_guard lock(mutex_);
      subscription->queue = queues_.add(capacity);
    }
    subscription->handle = lcm_subscribe(lcm_, pattern.c_str(), &NetworkBus::take, subscription.get());
    if (subscription->handle == nullptr) {
      return Error{"subscribe to '" + pattern + "' over " + url_ + ": not a channel or regular expression"};
    }
    lcm_subscription_set_queue_capacity(subscription->handle, subscription->liblcm_capacity);
    const std::lock_guard lock(mutex_);
    subscriptions_.push_back(std::move(subscription));
    return {};
  }

  std::uint64_t dropped() const override {
    const std::lock_guard lock(mutex_);
    return queues_.dropped();
  }

 private:
  struct Subscription {
    NetworkBus* bus;
    std::size_t queue;
    int liblcm_capacity;
    int drained;  ///< in the current drain
    lcm_subscription_t* handle;
  };

  static void take(const lcm_recv_buf_t* received, const char* channel, void* user) {
    auto* subscription = static_cast<Subscription*>(user);
    NetworkBus& bus = *subscription->bus;
    ++subscription->drained;
    const std::lock_guard lock(bus.mutex_);
    bus.queues_.push(subscription->queue, channel, ArrivalTime::from_utime(received->recv_utime),
                     {static_cast<const std::uint8_t*>(received->data), received->data_size});
  }

  /// Moves all messages queued by liblcm into our queues. A full queue of liblcm has dropped an unknown
  /// number: counted as one.
  Status drain() {
    {
      const std::lock_guard lock(mutex_);
      for (auto& subscription : subscriptions_) subscription->drained = 0;
    }
    pollfd waiting{file_, POLLIN, 0};
    for (int handled = 0; handled < kMaxDrain && poll(&waiting, 1, 0) > 0; ++handled) {
      if (lcm_handle(lcm_) != 0) return Error{"receive from " + url_ + ": liblcm could not handle a message"};
    }
    const std::lock_guard lock(mutex_);
    for (const auto& subscription : subscriptions_) {
      if (subscription->drained >= subscription->liblcm_capacity) queues_.count_dropped(1);
    }
    return {};
  }

  static constexpr int kMaxDrain = 10'000;  // a flood must not keep receive() from returning

  lcm_t* lcm_;
  int file_;
  std::string url_;
  mutable std::mutex mutex_;  // one thread may subscribe while another receives
  SubscriptionQueues queues_;
  std::vector<std::unique_ptr<Subscription>> subscriptions_;
};

struct Opened {
  lcm_t* lcm;
  std::string url;
};

/// Opens LCM for sending; receiving starts with the first subscription.
Result<Opened> open_lcm(const std::string& url) {
  const std::string chosen = chosen_url(url);
  if (!chosen.starts_with("udpm://")) {
    return Error{"network bus '" + chosen + "': expected a url such as " + kDefaultUrl +
                 " (logs are read with --log; tcpq would end the program without a server)"};
  }
  if (Status status = check_route(chosen); !status) return status.error();
  lcm_t* lcm = lcm_create(chosen.c_str());
  if (lcm == nullptr)
    return Error{"network bus " + chosen + ": liblcm refused it; expected as in " + kDefaultUrl};
  return Opened{lcm, chosen};
}

}  // namespace

Result<std::unique_ptr<Bus>> open_network_speaker(const std::string& url) {
  auto opened = open_lcm(url);
  if (!opened) return opened.error();
  return std::unique_ptr<Bus>(std::make_unique<NetworkSpeaker>(opened->lcm, opened->url));
}

Result<std::unique_ptr<Bus>> open_network_bus(const std::string& url) {
  const auto opened = open_lcm(url);
  if (!opened) return opened.error();
  const auto& [lcm, chosen] = *opened;
  // Starts the reading thread, which sends itself a message and waits for it.
  const int file = lcm_get_fileno(lcm);
  if (file < 0) {
    lcm_destroy(lcm);
    return Error{"network bus " + chosen + ": the program does not receive its own messages" + kRouteRemedy};
  }
  return std::unique_ptr<Bus>(std::make_unique<NetworkBus>(lcm, file, chosen));
}

}  // namespace parhelion
