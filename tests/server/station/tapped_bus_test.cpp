#include "server/station/tapped_bus.hpp"

#include <gtest/gtest.h>

#include <latch>
#include <optional>
#include <thread>

namespace parhelion::station {
namespace {

using Bytes = std::vector<std::uint8_t>;

class TappedBusTest : public testing::Test {
 protected:
  void come(const std::string& channel, std::uint8_t byte) {
    ASSERT_TRUE(other_->publish(channel, Bytes{byte}).ok());
  }
  /// All waiting messages.
  static std::vector<int> received(Bus& bus) {
    std::vector<int> bytes;
    Message message;
    for (auto came = bus.receive(message, Duration{0}); came && *came;
         came = bus.receive(message, Duration{0}))
      bytes.push_back(message.payload.at(0));
    return bytes;
  }

  MemoryBusHub hub_;
  std::unique_ptr<Bus> other_ = hub_.connect();
  std::optional<TappedBus> bus_{std::in_place, hub_.connect(), hub_.connect()};
  std::unique_ptr<Bus> tap_ = bus_->tap();
};

TEST_F(TappedBusTest, EachReceivesItsSubscribedMessagesOnce) {
  ASSERT_TRUE(tap_->subscribe("SCAN", 4).ok());
  ASSERT_TRUE(tap_->subscribe("MR_AGENT_.*_SCAN", 4).ok());
  ASSERT_TRUE(bus_->subscribe("SCAN", 4).ok());
  ASSERT_TRUE(bus_->subscribe("TELEOP", 4).ok());
  come("SCAN", 1);
  come("TELEOP", 2);
  come("MR_AGENT_a_SCAN", 3);
  EXPECT_EQ(received(*bus_), (std::vector{1, 2}));
  EXPECT_EQ(received(*tap_), (std::vector{1, 3}));
}

TEST_F(TappedBusTest, SlowTapsLoseTheirOldestWithoutDelayingTheOwner) {
  ASSERT_TRUE(tap_->subscribe("SCAN", 2).ok());
  ASSERT_TRUE(bus_->subscribe("SCAN", 8).ok());
  for (const int i : {1, 2, 3, 4}) come("SCAN", static_cast<std::uint8_t>(i));
  EXPECT_EQ(received(*bus_), (std::vector{1, 2, 3, 4}));
  EXPECT_EQ(received(*tap_), (std::vector{3, 4}));
  EXPECT_EQ(tap_->dropped(), 2U);
  EXPECT_EQ(bus_->dropped(), 0U);
}

TEST_F(TappedBusTest, AWaitingTapReceivesWhatTheOwnerReads) {
  ASSERT_TRUE(tap_->subscribe("OPERATOR", 4).ok());
  std::jthread owner([this](const std::stop_token& stop) {
    Message message;
    while (!stop.stop_requested())
      EXPECT_FALSE(*bus_->receive(message, milliseconds(1))) << "it wants none of it";
  });
  come("OPERATOR", 7);
  Message message;
  ASSERT_TRUE(*tap_->receive(message, seconds(5.0)));
  EXPECT_EQ(message.payload.at(0), 7);
}

TEST_F(TappedBusTest, TheOwnerReceivesMessagesThatATapPublishes) {
  ASSERT_TRUE(bus_->subscribe("TELEOP", 4).ok());
  ASSERT_TRUE(other_->subscribe("TELEOP", 4).ok());
  ASSERT_TRUE(tap_->publish("TELEOP", Bytes{1}).ok());
  EXPECT_EQ(received(*bus_), std::vector{1});
  bus_.reset();
  ASSERT_TRUE(tap_->publish("TELEOP", Bytes{2}).ok());
  EXPECT_EQ(received(*other_), (std::vector{1, 2}));
  EXPECT_TRUE(received(*tap_).empty());
}

/// Blocks subscribers of SLOW until `go`.
class SlowToSubscribe : public Bus {
 public:
  SlowToSubscribe(std::unique_ptr<Bus> bus, std::latch& asked, std::latch& go)
      : bus_(std::move(bus)), asked_(asked), go_(go) {}
  Status publish(std::string_view channel, std::span<const std::uint8_t> payload) override {
    return bus_->publish(channel, payload);
  }
  Result<bool> receive(Message& message, Duration timeout) override {
    return bus_->receive(message, timeout);
  }
  Status subscribe(const std::string& pattern, int capacity) override {
    if (pattern == "SLOW") {
      asked_.count_down();
      go_.wait();
    }
    return bus_->subscribe(pattern, capacity);
  }
  std::uint64_t dropped() const override { return bus_->dropped(); }

 private:
  const std::unique_ptr<Bus> bus_;
  std::latch &asked_, &go_;
};

TEST_F(TappedBusTest, TheOwnerNeverWaitsForALockOfATap) {
  std::latch asked(1), go(1);
  TappedBus bus(std::make_unique<SlowToSubscribe>(hub_.connect(), asked, go), hub_.connect());
  const auto tap = bus.tap();
  ASSERT_TRUE(bus.subscribe("SCAN", 8).ok());
  ASSERT_TRUE(tap->subscribe("SCAN", 8).ok());
  come("SCAN", 1);
  EXPECT_EQ(received(bus), std::vector{1});
  std::thread station([&] { EXPECT_TRUE(tap->subscribe("SLOW", 1).ok()); });
  asked.wait();  // it is subscribing, with all its locks held
  come("SCAN", 2);
  EXPECT_EQ(received(bus), std::vector{2}) << "the server's receiver stood still for a page";
  go.count_down();
  station.join();
  EXPECT_EQ(received(*tap), (std::vector{1, 2}));
}

TEST_F(TappedBusTest, LaterSubscribersReceiveAKnownChannel) {
  ASSERT_TRUE(bus_->subscribe("SCAN", 4).ok());
  come("SCAN", 1);
  EXPECT_EQ(received(*bus_), std::vector{1});
  ASSERT_TRUE(tap_->subscribe("SCAN", 4).ok());
  come("SCAN", 2);
  EXPECT_EQ(received(*bus_), std::vector{2});
  EXPECT_EQ(received(*tap_), std::vector{2});
}

TEST_F(TappedBusTest, HasOneTap) { EXPECT_THROW(bus_->tap(), std::logic_error); }

TEST_F(TappedBusTest, RefusesInvalidPatterns) {
  EXPECT_FALSE(tap_->subscribe("SCAN(", 2).ok());
  EXPECT_FALSE(bus_->subscribe("SCAN", 0).ok());
}

}  // namespace
}  // namespace parhelion::station
