#include "server/station/tapped_bus.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <utility>
#include <vector>

#include "protocols/bus/channel_pattern.hpp"
#include "protocols/bus/queues.hpp"
#include "server/runtime/wall_clock.hpp"
#include "server/station/handed_messages.hpp"

namespace parhelion::station {
namespace {

constexpr Duration kLookPeriod = milliseconds(5);
constexpr int kMinCapacity = 64;              // messages of a subscription, whichever side subscribed
                                              // first
constexpr std::size_t kMaxChannels = 10'000;  // channels; agents come and go, so the number of names is
                                              // unbounded

/// Index of the first match; patterns.size(): none.
std::size_t match(const std::vector<ChannelPattern>& patterns, std::string_view channel) {
  return static_cast<std::size_t>(
      std::find_if(patterns.begin(), patterns.end(),
                   [&](const ChannelPattern& each) { return each.matches(channel); }) -
      patterns.begin());
}

}  // namespace

struct TappedBus::Shared {
  enum Side : std::uint8_t { owner_side, tap_side };

  Shared(std::unique_ptr<Bus> receiver, std::unique_ptr<Bus> spoken)
      : network(std::move(receiver)), speaker(std::move(spoken)) {}

  /// Subscribes to each pattern once on the network, for both sides.
  Status subscribe(Side side, ChannelPattern pattern, int capacity) {
    const std::lock_guard lock(mutex);
    if (!subscribed.contains(pattern.text)) {
      if (Status done = network->subscribe(pattern.text, capacity); !done) return done;
      subscribed.insert(pattern.text);
    }
    patterns[side].push_back(std::move(pattern));
    ++version;
    return {};
  }

  const std::unique_ptr<Bus> network, speaker;
  HandedMessages handed;
  std::mutex mutex;  // guards the members below; the owner locks it only for new subscriptions
  std::set<std::string> subscribed;
  std::vector<ChannelPattern> patterns[2];
  std::atomic<std::uint64_t> version{1};  // of the patterns
  bool tapped = false;
};

class TappedBus::Tap : public Bus {
 public:
  explicit Tap(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {}

  Status publish(std::string_view channel, std::span<const std::uint8_t> payload) override {
    return shared_->speaker->publish(channel, payload);
  }

  Result<bool> receive(Message& message, Duration timeout) override {
    for (const WallTime deadline = runtime::steady_now() + timeout;;) {
      {
        const std::lock_guard lock(mutex_);
        shared_->handed.take_all([this](const Message& each) { sort(each); });
        if (queues_.pop(message)) return true;
      }
      const Duration left = deadline - runtime::steady_now();
      if (left.ns <= 0) return false;
      std::this_thread::sleep_for(std::chrono::nanoseconds(std::min(left, kLookPeriod).ns));
    }
  }

  Status subscribe(const std::string& pattern, int capacity) override {
    if (Status status = check_capacity(pattern, capacity); !status) return status;
    auto made = make_pattern(pattern);
    if (!made) return made.error();
    {
      const std::lock_guard lock(mutex_);
      patterns_.push_back(*made);
      queues_.add(capacity);
    }
    return shared_->subscribe(Shared::tap_side, std::move(*made), std::max(capacity, kMinCapacity));
  }

  std::uint64_t dropped() const override {
    const std::lock_guard lock(mutex_);
    return queues_.dropped() + shared_->handed.dropped();
  }

 private:
  void sort(const Message& message) {
    const std::size_t queue = match(patterns_, message.channel);
    if (queue < patterns_.size()) queues_.push(queue, message.channel, message.arrival, message.payload);
  }

  const std::shared_ptr<Shared> shared_;
  mutable std::mutex mutex_;  // guards the members below; the owner never locks it
  std::vector<ChannelPattern> patterns_;
  SubscriptionQueues queues_;
};

TappedBus::TappedBus(std::unique_ptr<Bus> network, std::unique_ptr<Bus> speaker)
    : shared_(std::make_shared<Shared>(std::move(network), std::move(speaker))) {}

TappedBus::~TappedBus() = default;

Status TappedBus::publish(std::string_view channel, std::span<const std::uint8_t> payload) {
  return shared_->network->publish(channel, payload);
}

Result<bool> TappedBus::receive(Message& message, Duration timeout) {
  const WallTime deadline = runtime::steady_now() + timeout;
  while (true) {
    const Duration left = deadline - runtime::steady_now();
    auto came = shared_->network->receive(message, std::max(left, Duration{0}));
    if (!came || !*came) return came;
    const Wanted by = wanted(message.channel);
    if (by.by_tap) shared_->handed.put(message);
    if (by.by_owner) return true;
  }
}

/// Patterns are matched once for each channel.
TappedBus::Wanted TappedBus::wanted(const std::string& channel) {
  if (const std::uint64_t now = shared_->version; now != version_ || wanted_.size() > kMaxChannels) {
    version_ = now;
    wanted_.clear();
  }
  const auto known = wanted_.find(channel);
  if (known != wanted_.end()) return known->second;
  const std::lock_guard lock(shared_->mutex);
  const auto wants = [&](Shared::Side side) {
    return match(shared_->patterns[side], channel) < shared_->patterns[side].size();
  };
  return wanted_[channel] = {wants(Shared::owner_side), wants(Shared::tap_side)};
}

Status TappedBus::subscribe(const std::string& pattern, int capacity) {
  if (Status status = check_capacity(pattern, capacity); !status) return status;
  auto made = make_pattern(pattern);
  if (!made) return made.error();
  return shared_->subscribe(Shared::owner_side, std::move(*made), capacity);
}

std::uint64_t TappedBus::dropped() const { return shared_->network->dropped(); }

std::unique_ptr<Bus> TappedBus::tap() {
  const std::lock_guard lock(shared_->mutex);
  if (std::exchange(shared_->tapped, true)) throw std::logic_error("a bus has one tap: share it");
  return std::make_unique<Tap>(shared_);
}

}  // namespace parhelion::station
