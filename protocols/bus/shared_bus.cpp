#include "protocols/bus/shared_bus.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <mutex>
#include <set>
#include <thread>
#include <utility>

#include "protocols/bus/channel_pattern.hpp"
#include "protocols/bus/priority_mutex.hpp"
#include "protocols/bus/queues.hpp"

namespace parhelion {
namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kLookPeriod = std::chrono::milliseconds(5);
constexpr int kNetworkCapacity = 256;         // messages of a subscription between two calls of the owner
constexpr int kMaxAtOnce = 1000;              // messages in one call of the owner
constexpr std::size_t kMaxChannels = 10'000;  // agents come and go: the number of names is unbounded

Duration until(Clock::time_point deadline) {
  return {std::max<std::int64_t>(std::chrono::nanoseconds(deadline - Clock::now()).count(), 0)};
}

}  // namespace

/// What a reader subscribes to, and what has come for it.
struct SharedBus::Inbox {
  bool pop(Message& message) {
    const std::lock_guard lock(mutex);
    return queues.pop(message);
  }
  std::uint64_t dropped() {
    const std::lock_guard lock(mutex);
    return queues.dropped();
  }

  PriorityMutex mutex;  // held while one message is copied or swapped
  SubscriptionQueues queues;
  std::vector<ChannelPattern> patterns;  // guarded by Shared's mutex
};

struct SharedBus::Shared {
  Shared(std::unique_ptr<Bus> receiver, std::unique_ptr<Bus> spoken)
      : network(std::move(receiver)), speaker(std::move(spoken)) {}

  std::shared_ptr<Inbox> add() {
    auto inbox = std::make_shared<Inbox>();
    const std::lock_guard lock(mutex);
    inboxes.push_back(inbox);
    return inbox;
  }

  void remove(const std::shared_ptr<Inbox>& inbox) {
    const std::lock_guard lock(mutex);
    std::erase(inboxes, inbox);
    ++version;
  }

  /// Subscribes to each pattern once on the network.
  Status subscribe(Inbox& inbox, const std::string& text, int capacity) {
    if (Status status = check_capacity(text, capacity); !status) return status;
    auto pattern = make_pattern(text);
    if (!pattern) return pattern.error();
    const std::lock_guard lock(mutex);
    if (!subscribed.contains(text)) {
      if (Status done = network->subscribe(text, std::max(capacity, kNetworkCapacity)); !done) return done;
      subscribed.insert(text);
    }
    inbox.patterns.push_back(std::move(*pattern));
    {
      const std::lock_guard queues_lock(inbox.mutex);
      inbox.queues.add(capacity);
    }
    ++version;
    return {};
  }

  const std::unique_ptr<Bus> network, speaker;
  std::mutex mutex;  // guards the members below; the owner locks it only after a change of them
  std::vector<std::shared_ptr<Inbox>> inboxes;
  std::set<std::string> subscribed;
  std::atomic<std::uint64_t> version{1};
};

class SharedBus::Reader : public Bus {
 public:
  explicit Reader(std::shared_ptr<Shared> shared) : shared_(std::move(shared)), inbox_(shared_->add()) {}
  ~Reader() override { shared_->remove(inbox_); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  Status publish(std::string_view channel, std::span<const std::uint8_t> payload) override {
    return shared_->speaker->publish(channel, payload);
  }

  Result<bool> receive(Message& message, Duration timeout) override {
    const auto deadline = Clock::now() + std::chrono::nanoseconds(timeout.ns);
    while (!inbox_->pop(message)) {
      const auto now = Clock::now();
      if (now >= deadline) return false;
      std::this_thread::sleep_for(std::min<Clock::duration>(deadline - now, kLookPeriod));
    }
    return true;
  }

  Status subscribe(const std::string& pattern, int capacity) override {
    return shared_->subscribe(*inbox_, pattern, capacity);
  }
  std::uint64_t dropped() const override { return inbox_->dropped(); }

 private:
  const std::shared_ptr<Shared> shared_;
  const std::shared_ptr<Inbox> inbox_;
};

SharedBus::SharedBus(std::unique_ptr<Bus> network, std::unique_ptr<Bus> speaker)
    : shared_(std::make_shared<Shared>(std::move(network), std::move(speaker))), own_(shared_->add()) {}

SharedBus::~SharedBus() { shared_->remove(own_); }

Status SharedBus::publish(std::string_view channel, std::span<const std::uint8_t> payload) {
  return shared_->network->publish(channel, payload);
}

Result<bool> SharedBus::receive(Message& message, Duration timeout) {
  const auto deadline = Clock::now() + std::chrono::nanoseconds(timeout.ns);
  while (true) {
    for (int i = 0; i < kMaxAtOnce; ++i) {
      const auto came = shared_->network->receive(received_, Duration{0});
      if (!came) return came;
      if (!*came) break;
      deliver(received_);
    }
    if (own_->pop(message)) return true;
    const auto came = shared_->network->receive(received_, until(deadline));
    if (!came || !*came) return came;
    deliver(received_);
  }
}

void SharedBus::deliver(const Message& message) {
  for (const Target& target : targets(message.channel)) {
    const std::lock_guard lock(target.inbox->mutex);
    target.inbox->queues.push(target.queue, message.channel, message.arrival, message.payload,
                              message.sender);
  }
}

/// Patterns are matched once for each channel.
const std::vector<SharedBus::Target>& SharedBus::targets(const std::string& channel) {
  if (const std::uint64_t now = shared_->version; now != version_ || targets_.size() > kMaxChannels) {
    version_ = now;
    targets_.clear();
  }
  const auto [known, is_new] = targets_.try_emplace(channel);
  if (!is_new) return known->second;
  const std::lock_guard lock(shared_->mutex);
  for (const std::shared_ptr<Inbox>& inbox : shared_->inboxes) {
    const auto matching =
        std::ranges::find_if(inbox->patterns, [&](const auto& each) { return each.matches(channel); });
    if (matching == inbox->patterns.end()) continue;
    known->second.push_back({inbox, static_cast<std::size_t>(matching - inbox->patterns.begin())});
  }
  return known->second;
}

Status SharedBus::subscribe(const std::string& pattern, int capacity) {
  return shared_->subscribe(*own_, pattern, capacity);
}

std::uint64_t SharedBus::dropped() const { return shared_->network->dropped() + own_->dropped(); }

std::unique_ptr<Bus> SharedBus::connect() { return std::make_unique<Reader>(shared_); }

}  // namespace parhelion
