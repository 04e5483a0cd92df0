#include "protocols/authentication/signed_bus.hpp"

#include <algorithm>
#include <chrono>
#include <mutex>

#include "protocols/hash.hpp"

namespace parhelion {
namespace {

SensorTime wall_clock() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(now).count()};
}

class SignedBus : public Bus {
 public:
  SignedBus(std::unique_ptr<Bus> bus, const Keys& keys, std::function<void(const RefusedMessage&)> refused)
      : bus_(std::move(bus)),
        signer_(keys.name, keys.secret),
        verifier_(keys, wall_clock()),
        refused_(std::move(refused)) {}

  Status publish(std::string_view channel, std::span<const std::uint8_t> payload) override {
    thread_local std::vector<std::uint8_t> message;
    std::unique_lock order(order_, std::defer_lock);
    if (must_be_in_order(channel)) order.lock();
    signer_.sign(channel, payload, wall_clock(), message);
    return bus_->publish(channel, message);
  }

  Result<bool> receive(Message& message, Duration timeout) override {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::nanoseconds(timeout.ns);
    for (int refused = 0; refused < kMaxRefused; ++refused) {
      const auto came = bus_->receive(message, timeout);
      if (!came || !*came) return came;
      if (accept(message)) return true;
      const auto left = deadline - std::chrono::steady_clock::now();
      timeout = {std::max<std::int64_t>(std::chrono::nanoseconds(left).count(), 0)};
    }
    return false;
  }

  Status subscribe(const std::string& pattern, int capacity) override {
    return bus_->subscribe(pattern, std::max(capacity, kMinCapacity));
  }
  std::uint64_t dropped() const override { return bus_->dropped(); }

 private:
  static constexpr int kMaxRefused = 1000;  // in one call: a flood must not keep the caller
  static constexpr int kMinCapacity =
      256;  // messages not yet verified: a flood must not displace genuine ones

  bool accept(Message& message) {
    const auto verdict = verifier_.verify(message.channel, message.payload, wall_clock());
    if (verdict.fault) {
      if (refused_) refused_({*verdict.fault, message.channel, verdict.sender});
      return false;
    }
    message.payload.resize(message.payload.size() - kSignatureSize);
    message.sender = fnv1a(verdict.sender);
    return true;
  }

  const std::unique_ptr<Bus> bus_;
  std::mutex order_;  // held from signing to publishing
  Signer signer_;
  Verifier verifier_;
  const std::function<void(const RefusedMessage&)> refused_;
};

}  // namespace

std::unique_ptr<Bus> sign(std::unique_ptr<Bus> bus, const Keys& keys,
                          std::function<void(const RefusedMessage&)> refused) {
  return std::make_unique<SignedBus>(std::move(bus), keys, std::move(refused));
}

}  // namespace parhelion
