#include "server/station/shared_endpoint.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <mutex>
#include <optional>
#include <thread>

namespace parhelion::station {
namespace {

constexpr Duration kSoon = seconds(5.0), kAtOnce = Duration{0};
using Bytes = std::vector<std::uint8_t>;

/// Delivers given messages with their stamps; records subscriptions and publications.
class ScriptedBus : public Bus {
 public:
  struct Script {
    std::mutex mutex;
    std::deque<Message> coming;
    std::vector<std::string> subscribed, published;
    std::string fault;
  };
  explicit ScriptedBus(std::shared_ptr<Script> script) : script_(std::move(script)) {}

  Status publish(std::string_view channel, std::span<const std::uint8_t>) override {
    const std::lock_guard lock(script_->mutex);
    script_->published.emplace_back(channel);
    return {};
  }
  Result<bool> receive(Message& message, Duration) override {
    const std::lock_guard lock(script_->mutex);
    if (!script_->fault.empty()) return Error{script_->fault};
    if (script_->coming.empty()) return false;
    message = std::move(script_->coming.front());
    script_->coming.pop_front();
    return true;
  }
  Status subscribe(const std::string& pattern, int) override {
    const std::lock_guard lock(script_->mutex);
    script_->subscribed.push_back(pattern);
    return {};
  }
  std::uint64_t dropped() const override { return 0; }

 private:
  std::shared_ptr<Script> script_;
};

class SharedEndpointTest : public testing::Test {
 protected:
  void come(const std::string& channel, std::uint8_t byte) {
    const std::lock_guard lock(script_->mutex);
    script_->coming.push_back({channel, ArrivalTime{1000 + byte}, {byte}});
  }
  static std::vector<int> received(Bus& bus, std::size_t count) {
    std::vector<int> bytes;
    Message message;
    while (bytes.size() < count) {
      const auto came = bus.receive(message, kSoon);
      if (!came || !*came) break;
      bytes.push_back(message.payload.at(0));
    }
    return bytes;
  }

  std::shared_ptr<ScriptedBus::Script> script_ = std::make_shared<ScriptedBus::Script>();
  std::optional<SharedEndpoint> shared_{std::in_place, std::make_unique<ScriptedBus>(script_)};
};

TEST_F(SharedEndpointTest, EachReceivesItsSubscriptionsInOrder) {
  const auto scans = shared_->connect(), all = shared_->connect();
  ASSERT_TRUE(scans->subscribe("SCAN", 8).ok());
  ASSERT_TRUE(all->subscribe("SCAN", 8).ok());
  ASSERT_TRUE(all->subscribe("MR_AGENT_.*_SCAN", 8).ok());
  come("SCAN", 1);
  come("MR_AGENT_a_SCAN", 2);
  come("SCAN", 3);
  EXPECT_EQ(received(*all, 3), (std::vector{1, 2, 3}));
  EXPECT_EQ(received(*scans, 2), (std::vector{1, 3}));
  Message none;
  EXPECT_FALSE(*scans->receive(none, kAtOnce));
}

TEST_F(SharedEndpointTest, KeepsTheTimeOfArrival) {
  const auto bus = shared_->connect();
  ASSERT_TRUE(bus->subscribe("SCAN", 8).ok());
  come("SCAN", 7);
  Message message;
  ASSERT_TRUE(*bus->receive(message, kSoon));
  EXPECT_EQ(message.arrival.ns, 1007);
}

TEST_F(SharedEndpointTest, SubscribesOncePerChannelForSeveralReceivers) {
  const auto one = shared_->connect(), two = shared_->connect();
  ASSERT_TRUE(one->subscribe("SCAN", 8).ok());
  ASSERT_TRUE(two->subscribe("SCAN", 8).ok());
  const std::lock_guard lock(script_->mutex);
  EXPECT_EQ(script_->subscribed, std::vector<std::string>{"SCAN"});
}

TEST_F(SharedEndpointTest, ASlowReceiverLosesOnlyItsOwnOldestMessages) {
  const auto slow = shared_->connect(), quick = shared_->connect();
  ASSERT_TRUE(slow->subscribe("SCAN", 2).ok());
  ASSERT_TRUE(quick->subscribe("SCAN", 8).ok());
  for (const int i : {1, 2, 3, 4}) come("SCAN", static_cast<std::uint8_t>(i));
  EXPECT_EQ(received(*quick, 4), (std::vector{1, 2, 3, 4}));
  EXPECT_EQ(received(*slow, 2), (std::vector{3, 4}));
  EXPECT_EQ(slow->dropped(), 2U);
  EXPECT_EQ(quick->dropped(), 0U);
}

TEST_F(SharedEndpointTest, PublishedMessagesReachTheBusEvenAfterItsEnd) {
  const auto bus = shared_->connect();
  ASSERT_TRUE(bus->publish("TELEOP", Bytes{1}).ok());
  shared_.reset();
  ASSERT_TRUE(bus->publish("MR_SPAWN", Bytes{1}).ok());
  const std::lock_guard lock(script_->mutex);
  EXPECT_EQ(script_->published, (std::vector<std::string>{"TELEOP", "MR_SPAWN"}));
}

TEST_F(SharedEndpointTest, ABusFailureReachesAllListenersAndReceptionResumes) {
  const auto bus = shared_->connect();
  ASSERT_TRUE(bus->subscribe("SCAN", 2).ok());
  {
    const std::lock_guard lock(script_->mutex);
    script_->fault = "the cable is gone";
  }
  Message message;
  const auto came = bus->receive(message, kSoon);
  ASSERT_FALSE(came.ok());
  EXPECT_EQ(came.error().message, "the cable is gone");
  {
    const std::lock_guard lock(script_->mutex);
    script_->fault.clear();
  }
  come("SCAN", 5);
  for (auto received = bus->receive(message, kSoon); !received; received = bus->receive(message, kSoon)) {
    std::this_thread::yield();
  }
  EXPECT_EQ(message.payload.at(0), 5);
}

TEST_F(SharedEndpointTest, RefusesInvalidPatterns) {
  const auto bus = shared_->connect();
  EXPECT_FALSE(bus->subscribe("SCAN(", 2).ok());
  EXPECT_FALSE(bus->subscribe("SCAN", 0).ok());
}

}  // namespace
}  // namespace parhelion::station
