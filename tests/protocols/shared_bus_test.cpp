#include "protocols/bus/shared_bus.hpp"

#include <gtest/gtest.h>

#include <latch>
#include <optional>
#include <thread>

#include "protocols/authentication/signed_bus.hpp"

namespace parhelion {
namespace {

using Payload = std::vector<std::uint8_t>;

class SharedBusTest : public testing::Test {
 protected:
  void come(const std::string& channel, std::uint8_t byte) {
    ASSERT_TRUE(other_->publish(channel, Payload{byte}).ok());
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
  std::optional<SharedBus> bus_{std::in_place, hub_.connect(), hub_.connect()};
  std::unique_ptr<Bus> reader_ = bus_->connect();
};

TEST_F(SharedBusTest, EachReceivesItsSubscribedMessagesOnceAndInOrder) {
  const auto second = bus_->connect();
  ASSERT_TRUE(reader_->subscribe("SCAN", 4).ok());
  ASSERT_TRUE(reader_->subscribe("MR_AGENT_.*_SCAN", 4).ok());
  ASSERT_TRUE(second->subscribe("SCAN", 4).ok());
  ASSERT_TRUE(bus_->subscribe("SCAN", 4).ok());
  ASSERT_TRUE(bus_->subscribe("TELEOP", 4).ok());
  come("SCAN", 1);
  come("TELEOP", 2);
  come("MR_AGENT_a_SCAN", 3);
  EXPECT_EQ(received(*bus_), (std::vector{1, 2}));
  EXPECT_EQ(received(*reader_), (std::vector{1, 3}));
  EXPECT_EQ(received(*second), std::vector{1});
}

TEST_F(SharedBusTest, KeepsTheTimeOfArrival) {
  ASSERT_TRUE(other_->subscribe("SCAN", 4).ok());
  ASSERT_TRUE(bus_->subscribe("SCAN", 4).ok());
  ASSERT_TRUE(reader_->subscribe("SCAN", 4).ok());
  come("SCAN", 1);
  Message sent, owned, read;
  ASSERT_TRUE(*other_->receive(sent, Duration{0}));
  ASSERT_TRUE(*bus_->receive(owned, Duration{0}));
  ASSERT_TRUE(*reader_->receive(read, Duration{0}));
  EXPECT_EQ(owned.arrival.ns, sent.arrival.ns);
  EXPECT_EQ(read.arrival.ns, sent.arrival.ns);
}

TEST_F(SharedBusTest, SlowReadersLoseTheirOldestWithoutDelayingTheOwner) {
  ASSERT_TRUE(reader_->subscribe("SCAN", 2).ok());
  ASSERT_TRUE(bus_->subscribe("SCAN", 8).ok());
  for (const int i : {1, 2, 3, 4}) come("SCAN", static_cast<std::uint8_t>(i));
  EXPECT_EQ(received(*bus_), (std::vector{1, 2, 3, 4}));
  EXPECT_EQ(received(*reader_), (std::vector{3, 4}));
  EXPECT_EQ(reader_->dropped(), 2U);
  EXPECT_EQ(bus_->dropped(), 0U);
}

TEST_F(SharedBusTest, TheOwnersCapacityHoldsWhoeverSubscribesFirst) {
  ASSERT_TRUE(reader_->subscribe("TELEOP", 8).ok());
  ASSERT_TRUE(bus_->subscribe("TELEOP", 1).ok());
  for (const int i : {1, 2, 3}) come("TELEOP", static_cast<std::uint8_t>(i));
  EXPECT_EQ(received(*bus_), std::vector{3});
  EXPECT_EQ(received(*reader_), (std::vector{1, 2, 3}));
}

TEST_F(SharedBusTest, StrangersDisplaceNoSignedMessage) {
  const Sender rover{"rover", new_secret(), {"trainee"}, {}};
  const Keys server{"server", new_secret(), seconds(1.0), {rover}};
  SharedBus bus(sign(hub_.connect(), server, {}), sign(hub_.connect(), server, {}));
  ASSERT_TRUE(bus.subscribe("TELEOP", 1).ok());
  const auto signing = sign(hub_.connect(), {rover.name, rover.secret, seconds(1.0), {}}, {});
  ASSERT_TRUE(signing->publish("TELEOP", Payload{7}).ok());
  for (int i = 0; i < 200; ++i) come("TELEOP", 1);
  EXPECT_EQ(received(bus), std::vector{7});
}

TEST_F(SharedBusTest, AWaitingReaderReceivesWhatTheOwnerReads) {
  ASSERT_TRUE(reader_->subscribe("OPERATOR", 4).ok());
  std::jthread owner([this](const std::stop_token& stop) {
    Message message;
    while (!stop.stop_requested())
      EXPECT_FALSE(*bus_->receive(message, milliseconds(1))) << "it wants none of it";
  });
  come("OPERATOR", 7);
  Message message;
  ASSERT_TRUE(*reader_->receive(message, seconds(5.0)));
  EXPECT_EQ(message.payload.at(0), 7);
}

TEST_F(SharedBusTest, NoneIsLostOrReorderedUnderRaces) {
  constexpr int kTotal = 20'000;
  ASSERT_TRUE(reader_->subscribe("SCAN", kTotal).ok());
  ASSERT_TRUE(bus_->subscribe("SCAN", kTotal).ok());
  std::jthread owner([this](const std::stop_token& stop) {
    Message message;
    while (!stop.stop_requested()) EXPECT_TRUE(bus_->receive(message, milliseconds(1)).ok());
  });
  std::jthread sender([this] {
    for (int i = 0; i < kTotal; ++i) {
      come("SCAN", static_cast<std::uint8_t>(i % 251));
      if (i % 100 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  Message message;
  for (int i = 0; i < kTotal; ++i) {
    ASSERT_TRUE(*reader_->receive(message, seconds(5.0)));
    ASSERT_EQ(message.payload.at(0), i % 251);
  }
}

TEST_F(SharedBusTest, ReadersMayComeAndGoWhileTheOwnerReceives) {
  ASSERT_TRUE(bus_->subscribe("SCAN", 4).ok());
  std::jthread owner([this](const std::stop_token& stop) {
    Message message;
    while (!stop.stop_requested()) {
      come("SCAN", 1);
      EXPECT_TRUE(bus_->receive(message, milliseconds(1)).ok());
    }
  });
  for (int i = 0; i < 50; ++i) {
    const auto reader = bus_->connect();
    ASSERT_TRUE(reader->subscribe("SCAN", 1).ok());
    Message message;
    EXPECT_TRUE(*reader->receive(message, seconds(5.0)));
  }
}

TEST_F(SharedBusTest, TheOwnerReceivesMessagesThatAReaderPublishes) {
  ASSERT_TRUE(bus_->subscribe("TELEOP", 4).ok());
  ASSERT_TRUE(other_->subscribe("TELEOP", 4).ok());
  ASSERT_TRUE(reader_->publish("TELEOP", Payload{1}).ok());
  EXPECT_EQ(received(*bus_), std::vector{1});
  bus_.reset();
  ASSERT_TRUE(reader_->publish("TELEOP", Payload{2}).ok());
  EXPECT_EQ(received(*other_), (std::vector{1, 2}));
  EXPECT_TRUE(received(*reader_).empty());
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

TEST_F(SharedBusTest, TheOwnerDoesNotWaitForASubscribingReader) {
  std::latch asked(1), go(1);
  SharedBus bus(std::make_unique<SlowToSubscribe>(hub_.connect(), asked, go), hub_.connect());
  const auto reader = bus.connect();
  ASSERT_TRUE(bus.subscribe("SCAN", 8).ok());
  ASSERT_TRUE(reader->subscribe("SCAN", 8).ok());
  come("SCAN", 1);
  EXPECT_EQ(received(bus), std::vector{1});
  std::thread station([&] { EXPECT_TRUE(reader->subscribe("SLOW", 1).ok()); });
  asked.wait();  // it is subscribing, with all its locks held
  come("SCAN", 2);
  EXPECT_EQ(received(bus), std::vector{2}) << "the server's receiver stood still for a page";
  go.count_down();
  station.join();
  EXPECT_EQ(received(*reader), (std::vector{1, 2}));
}

TEST_F(SharedBusTest, LaterSubscribersReceiveAKnownChannel) {
  ASSERT_TRUE(bus_->subscribe("SCAN", 4).ok());
  come("SCAN", 1);
  EXPECT_EQ(received(*bus_), std::vector{1});
  ASSERT_TRUE(reader_->subscribe("SCAN", 4).ok());
  come("SCAN", 2);
  EXPECT_EQ(received(*bus_), std::vector{2});
  EXPECT_EQ(received(*reader_), std::vector{2});
}

TEST_F(SharedBusTest, RefusesInvalidPatterns) {
  EXPECT_FALSE(reader_->subscribe("SCAN(", 2).ok());
  EXPECT_FALSE(bus_->subscribe("SCAN", 0).ok());
}

}  // namespace
}  // namespace parhelion
