// The bus within one process: every endpoint receives every publication, its own included, as with LCM.
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <mutex>

#include "protocols/bus/bus.hpp"
#include "protocols/bus/channel_pattern.hpp"
#include "protocols/bus/queues.hpp"

namespace parhelion {
namespace {

constexpr std::size_t kMaxChannel = 63;

ArrivalTime now() {
  const auto since_epoch = std::chrono::system_clock::now().time_since_epoch();
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(since_epoch).count()};
}

}  // namespace

Status check_message(std::string_view channel, std::size_t payload_size) {
  if (channel.empty() || channel.size() > kMaxChannel || channel.find('\0') != std::string_view::npos) {
    return Error{"publish on '" + std::string(channel.substr(0, 80)) +
                 "': a channel name has 1 to 63 characters"};
  }
  if (payload_size > INT32_MAX) {
    return Error{"publish on " + std::string(channel) + ": " + std::to_string(payload_size) +
                 " bytes, a message has at most 2147483647"};
  }
  return {};
}

Status check_capacity(const std::string& pattern, int capacity) {
  if (capacity >= 1) return {};
  return Error{"subscribe to '" + pattern + "': capacity " + std::to_string(capacity) +
               ", expected at least 1"};
}

struct MemoryBusHub::Shared {
  struct Endpoint {
    std::vector<ChannelPattern> patterns;
    SubscriptionQueues queues;
    std::condition_variable came;
  };
  std::mutex mutex;
  std::vector<Endpoint*> endpoints;
  std::uint64_t senders = 0;
};

namespace {

template <class Shared>
class MemoryBus : public Bus {
 public:
  explicit MemoryBus(std::shared_ptr<Shared> shared) : shared_(std::move(shared)) {
    const std::lock_guard lock(shared_->mutex);
    shared_->endpoints.push_back(&endpoint_);
    sender_ = ++shared_->senders;
  }
  ~MemoryBus() override {
    const std::lock_guard lock(shared_->mutex);
    std::erase(shared_->endpoints, &endpoint_);
  }
  MemoryBus(const MemoryBus&) = delete;
  MemoryBus& operator=(const MemoryBus&) = delete;

  Status publish(std::string_view channel, std::span<const std::uint8_t> payload) override {
    if (Status status = check_message(channel, payload.size()); !status) return status;
    const std::lock_guard lock(shared_->mutex);
    const ArrivalTime arrival = now();
    for (auto* endpoint : shared_->endpoints) {
      for (std::size_t i = 0; i < endpoint->patterns.size(); ++i) {
        if (!endpoint->patterns[i].matches(channel)) continue;
        endpoint->queues.push(i, channel, arrival, payload, sender_);
        endpoint->came.notify_one();
      }
    }
    return {};
  }

  Result<bool> receive(Message& message, Duration timeout) override {
    const auto deadline =
        std::chrono::steady_clock::now() + std::chrono::nanoseconds(std::max<std::int64_t>(timeout.ns, 0));
    std::unique_lock lock(shared_->mutex);
    while (!endpoint_.queues.pop(message)) {
      if (endpoint_.came.wait_until(lock, deadline) == std::cv_status::timeout)
        return endpoint_.queues.pop(message);
    }
    return true;
  }

  Status subscribe(const std::string& pattern, int capacity) override {
    if (Status status = check_capacity(pattern, capacity); !status) return status;
    auto made = make_pattern(pattern);
    if (!made) return made.error();
    const std::lock_guard lock(shared_->mutex);
    endpoint_.patterns.push_back(std::move(*made));
    endpoint_.queues.add(capacity);
    return {};
  }

  std::uint64_t dropped() const override {
    const std::lock_guard lock(shared_->mutex);
    return endpoint_.queues.dropped();
  }

 private:
  std::shared_ptr<Shared> shared_;
  typename Shared::Endpoint endpoint_;
  std::uint64_t sender_ = 0;
};

}  // namespace

MemoryBusHub::MemoryBusHub() : shared_(std::make_shared<Shared>()) {}
MemoryBusHub::~MemoryBusHub() = default;

std::unique_ptr<Bus> MemoryBusHub::connect() { return std::make_unique<MemoryBus<Shared>>(shared_); }

}  // namespace parhelion
