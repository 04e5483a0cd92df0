#include "server/station/shared_endpoint.hpp"

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

namespace parhelion::station {
namespace {

constexpr Duration kPeriod = milliseconds(5);
constexpr Duration kAgain = milliseconds(100);  // retry interval after a failure of the bus
constexpr int kMinCapacity = 64;                // messages of a subscription in the meantime

}  // namespace

struct SharedEndpoint::Shared {
  struct Listener {
    std::vector<ChannelPattern> patterns;
    SubscriptionQueues queues;
    std::condition_variable came;
  };

  explicit Shared(std::unique_ptr<Bus> network) : bus(std::move(network)) {}

  void hand_on(const Message& message) {
    const std::lock_guard lock(mutex);
    for (Listener* listener : listeners) {
      for (std::size_t i = 0; i < listener->patterns.size(); ++i) {
        if (!listener->patterns[i].matches(message.channel)) continue;
        listener->queues.push(i, message.channel, message.arrival, message.payload);
        listener->came.notify_one();
      }
    }
  }
  void note(std::optional<Error> why) {
    const std::lock_guard lock(mutex);
    fault = std::move(why);
    if (!fault) return;
    for (Listener* listener : listeners) listener->came.notify_all();
  }

  const std::unique_ptr<Bus> bus;
  mutable std::mutex mutex;  // guards the members below
  std::vector<Listener*> listeners;
  std::set<std::string> subscribed;  // on the bus
  std::optional<Error> fault;
};

class SharedEndpoint::Endpoint : public Bus {
 public:
  explicit Endpoint(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {
    const std::lock_guard lock(shared_->mutex);
    shared_->listeners.push_back(&listener_);
  }
  ~Endpoint() override {
    const std::lock_guard lock(shared_->mutex);
    std::erase(shared_->listeners, &listener_);
  }
  Endpoint(const Endpoint&) = delete;
  Endpoint& operator=(const Endpoint&) = delete;

  Status publish(std::string_view channel, std::span<const std::uint8_t> payload) override {
    return shared_->bus->publish(channel, payload);
  }

  Result<bool> receive(Message& message, Duration timeout) override {
    std::unique_lock lock(shared_->mutex);
    listener_.came.wait_for(lock, std::chrono::nanoseconds(std::max<std::int64_t>(timeout.ns, 0)),
                            [&] { return shared_->fault || !listener_.queues.empty(); });
    if (listener_.queues.pop(message)) return true;
    if (shared_->fault) return *shared_->fault;
    return false;
  }

  Status subscribe(const std::string& pattern, int capacity) override {
    if (Status status = check_capacity(pattern, capacity); !status) return status;
    auto made = make_pattern(pattern);
    if (!made) return made.error();
    const std::lock_guard lock(shared_->mutex);
    if (!shared_->subscribed.contains(pattern)) {
      if (Status done = shared_->bus->subscribe(pattern, std::max(capacity, kMinCapacity)); !done)
        return done;
      shared_->subscribed.insert(pattern);
    }
    listener_.patterns.push_back(std::move(*made));
    listener_.queues.add(capacity);
    return {};
  }

  std::uint64_t dropped() const override {
    const std::lock_guard lock(shared_->mutex);
    return listener_.queues.dropped() + shared_->bus->dropped();
  }

 private:
  const std::shared_ptr<Shared> shared_;
  Shared::Listener listener_;
};

SharedEndpoint::SharedEndpoint(std::unique_ptr<Bus> bus)
    : shared_(std::make_shared<Shared>(std::move(bus))),
      thread_([this](const std::stop_token& stop) { hand_on(stop); }) {}

SharedEndpoint::~SharedEndpoint() = default;

std::unique_ptr<Bus> SharedEndpoint::connect() { return std::make_unique<Endpoint>(shared_); }

void SharedEndpoint::hand_on(const std::stop_token& stop) {
  Message message;
  bool failed = false;
  while (!stop.stop_requested()) {
    auto came = shared_->bus->receive(message, Duration{0});
    for (; came && *came && !stop.stop_requested(); came = shared_->bus->receive(message, Duration{0}))
      shared_->hand_on(message);
    if (failed != !came) shared_->note(came ? std::nullopt : std::optional(came.error()));
    failed = !came;
    std::this_thread::sleep_for(std::chrono::nanoseconds(failed ? kAgain.ns : kPeriod.ns));
  }
}

}  // namespace parhelion::station
