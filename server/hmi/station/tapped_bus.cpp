#include "server/hmi/station/tapped_bus.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "protocols/bus/channel_pattern.hpp"
#include "protocols/bus/queues.hpp"

namespace parhelion {
namespace {

constexpr int least_waiting = 64;  // messages of a subscription, whoever asked for it first

/// What one of them has subscribed to.
struct Wanted {
  std::set<std::string, std::less<>> channels;
  std::vector<ChannelPattern> expressions;

  void add(ChannelPattern pattern) {
    if (pattern.expression) {
      expressions.push_back(std::move(pattern));
    } else {
      channels.insert(std::move(pattern.text));
    }
  }
  bool contains(std::string_view channel) const {
    return channels.contains(channel) ||
           std::any_of(expressions.begin(), expressions.end(),
                       [&](const ChannelPattern& each) { return each.matches(channel); });
  }
};

}  // namespace

struct TappedBus::Shared {
  struct Listener {
    std::vector<ChannelPattern> patterns;
    SubscriptionQueues queues;
    std::condition_variable came;
    bool waits = false;
  };

  Shared(std::unique_ptr<Bus> heard, std::unique_ptr<Bus> spoken)
      : network(std::move(heard)), speaker(std::move(spoken)) {}

  /// Each pattern once, whoever wants it.
  Status subscribe(const std::string& pattern, int capacity) {
    const std::lock_guard lock(subscribing);
    if (subscribed.contains(pattern)) return {};
    if (Status done = network->subscribe(pattern, capacity); !done) return done;
    subscribed.insert(pattern);
    return {};
  }

  void copy_for_taps(const Message& message) {
    const std::lock_guard lock(mutex);
    for (Listener* listener : listeners) {
      for (std::size_t i = 0; i < listener->patterns.size(); ++i) {
        if (!listener->patterns[i].matches(message.channel)) continue;
        listener->queues.push(i, message.channel, message.arrival, message.payload);
        if (listener->waits) listener->came.notify_one();
        break;
      }
    }
  }

  const std::unique_ptr<Bus> network, speaker;
  std::mutex subscribing;
  std::set<std::string> subscribed;
  mutable std::mutex mutex;  // of what follows: held for moments only
  Wanted owners;
  std::vector<Listener*> listeners;
};

class TappedBus::Tap : public Bus {
 public:
  explicit Tap(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {
    const std::lock_guard lock(shared_->mutex);
    shared_->listeners.push_back(&listener_);
  }
  ~Tap() override {
    const std::lock_guard lock(shared_->mutex);
    std::erase(shared_->listeners, &listener_);
  }
  Tap(const Tap&) = delete;
  Tap& operator=(const Tap&) = delete;

  Status publish(std::string_view channel, std::span<const std::uint8_t> payload) override {
    return shared_->speaker->publish(channel, payload);
  }

  Result<bool> receive(Message& message, Duration timeout) override {
    std::unique_lock lock(shared_->mutex);
    if (listener_.queues.pop(message)) return true;
    if (timeout.ns <= 0) return false;
    listener_.waits = true;
    listener_.came.wait_for(lock, std::chrono::nanoseconds(timeout.ns),
                            [this] { return !listener_.queues.empty(); });
    listener_.waits = false;
    return listener_.queues.pop(message);
  }

  Status subscribe(const std::string& pattern, int capacity) override {
    if (Status status = check_capacity(pattern, capacity); !status) return status;
    auto made = make_pattern(pattern);
    if (!made) return made.error();
    {
      const std::lock_guard lock(shared_->mutex);
      listener_.patterns.push_back(std::move(*made));
      listener_.queues.add(capacity);
    }
    return shared_->subscribe(pattern, std::max(capacity, least_waiting));
  }

  std::uint64_t dropped() const override {
    const std::lock_guard lock(shared_->mutex);
    return listener_.queues.dropped();
  }

 private:
  const std::shared_ptr<Shared> shared_;
  Shared::Listener listener_;
};

TappedBus::TappedBus(std::unique_ptr<Bus> network, std::unique_ptr<Bus> speaker)
    : shared_(std::make_shared<Shared>(std::move(network), std::move(speaker))) {}

TappedBus::~TappedBus() = default;

Status TappedBus::publish(std::string_view channel, std::span<const std::uint8_t> payload) {
  return shared_->network->publish(channel, payload);
}

Result<bool> TappedBus::receive(Message& message, Duration timeout) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::nanoseconds(timeout.ns);
  while (true) {
    const std::chrono::nanoseconds left = deadline - std::chrono::steady_clock::now();
    auto came = shared_->network->receive(message, Duration{std::max<std::int64_t>(left.count(), 0)});
    if (!came || !*came) return came;
    shared_->copy_for_taps(message);
    const std::lock_guard lock(shared_->mutex);
    if (shared_->owners.contains(message.channel)) return true;
  }
}

Status TappedBus::subscribe(const std::string& pattern, int capacity) {
  if (Status status = check_capacity(pattern, capacity); !status) return status;
  auto made = make_pattern(pattern);
  if (!made) return made.error();
  {
    const std::lock_guard lock(shared_->mutex);
    shared_->owners.add(std::move(*made));
  }
  return shared_->subscribe(pattern, capacity);
}

std::uint64_t TappedBus::dropped() const { return shared_->network->dropped(); }

std::unique_ptr<Bus> TappedBus::tap() { return std::make_unique<Tap>(shared_); }

}  // namespace parhelion
