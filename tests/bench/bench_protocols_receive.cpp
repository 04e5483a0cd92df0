// How long a message takes from the sender's call to the receiver's hands: our receiver beside liblcm's,
// message by message in turn, each on a port of its own.
//   bench_protocols_receive [MESSAGES, 2000] [MILLISECONDS BETWEEN THEM, 10]
#include <lcm/lcm.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/quantile.hpp"

namespace {

using namespace parhelion;
using Clock = std::chrono::steady_clock;

constexpr const char* kChannel = "SCAN";

/// Waits for messages in a thread of its own and takes the time of each.
class Receiver {
 public:
  virtual ~Receiver() = default;

  /// us from the call that publishes to the receipt; nullopt: nothing came within a second.
  std::optional<double> time(Bus& sender, std::span<const std::uint8_t> payload) {
    received_ = Clock::time_point{};
    const auto start = Clock::now();
    if (Status sent = sender.publish(kChannel, payload); !sent)
      throw std::runtime_error(sent.error().message);
    while (received_.load() == Clock::time_point{}) {
      if (Clock::now() - start > std::chrono::seconds(1)) return {};
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
    return std::chrono::duration<double, std::micro>(received_.load() - start).count();
  }

 protected:
  void take() { received_ = Clock::now(); }
  bool ended() const { return ended_; }
  void end(std::thread& waiting) {
    ended_ = true;
    waiting.join();
  }

 private:
  std::atomic<Clock::time_point> received_{};
  std::atomic<bool> ended_{false};
};

class Ours : public Receiver {
 public:
  explicit Ours(const std::string& url) {
    auto bus = open_network_bus(url);
    if (!bus) throw std::runtime_error(bus.error().message);
    bus_ = std::move(*bus);
    if (Status subscribed = bus_->subscribe(kChannel, 4); !subscribed)
      throw std::runtime_error(subscribed.error().message);
    waiting_ = std::thread([this] {
      Message message;
      while (!ended()) {
        const auto received = bus_->receive(message, seconds(0.1));
        if (received && *received) take();
      }
    });
  }
  ~Ours() override { end(waiting_); }

 private:
  std::unique_ptr<Bus> bus_;
  std::thread waiting_;
};

class Liblcm : public Receiver {
 public:
  explicit Liblcm(const std::string& url) : lcm_(lcm_create(url.c_str())) {
    if (!lcm_) throw std::runtime_error("liblcm cannot open " + url);
    lcm_subscribe(
        lcm_, kChannel,
        [](const lcm_recv_buf_t*, const char*, void* self) { static_cast<Liblcm*>(self)->take(); }, this);
    waiting_ = std::thread([this] {
      while (!ended()) lcm_handle_timeout(lcm_, 100);
    });
  }
  ~Liblcm() override {
    end(waiting_);
    lcm_destroy(lcm_);
  }

 private:
  lcm_t* lcm_;
  std::thread waiting_;
};

std::string url_of(int port) {
  return "udpm://239.255.76.67:" + std::to_string(port) + "?ttl=0&recv_buf_size=4194304";
}

void compare(const char* name, std::size_t bytes, int messages, std::chrono::milliseconds pause) {
  constexpr std::array ports{7801, 7802};
  const std::array<std::unique_ptr<Receiver>, 2> receivers{std::make_unique<Ours>(url_of(ports[0])),
                                                           std::make_unique<Liblcm>(url_of(ports[1]))};
  std::array<std::unique_ptr<Bus>, 2> senders;
  for (std::size_t i = 0; i < 2; ++i) {
    auto sender = open_network_bus(url_of(ports[i]));
    if (!sender) throw std::runtime_error(sender.error().message);
    senders[i] = std::move(*sender);
  }
  const std::vector<std::uint8_t> payload(bytes, 7);
  std::array<std::vector<double>, 2> times;
  std::array<int, 2> lost{};
  for (int m = 0; m < messages; ++m) {
    for (std::size_t i = 0; i < 2; ++i) {
      std::this_thread::sleep_for(pause);
      const auto took = receivers[i]->time(*senders[i], payload);
      if (took)
        times[i].push_back(*took);
      else
        ++lost[i];
    }
  }
  for (std::size_t i = 0; i < 2; ++i) {
    if (times[i].empty()) throw std::runtime_error(std::string(name) + ": nothing arrived");
    std::printf("%-8s %8zu bytes  %-7s p50 %7.1f  p99 %7.1f us  lost %d of %d\n", name, bytes,
                i == 0 ? "ours" : "liblcm", quantile(times[i], 0.5), quantile(times[i], 0.99), lost[i],
                messages);
  }
}

}  // namespace

int main(int argc, char** argv) try {
  const int messages = argc > 1 ? std::atoi(argv[1]) : 2000;
  const std::chrono::milliseconds pause(argc > 2 ? std::atoi(argv[2]) : 10);
  if (messages < 1 || pause.count() < 0) throw std::runtime_error("numbers above 0 expected");
  compare("scan", 4368, messages, pause);
  compare("image", 300'000, messages / 4 + 1, pause);
} catch (const std::exception& failure) {
  std::fprintf(stderr, "bench_protocols_receive: %s\n", failure.what());
  return 1;
}
