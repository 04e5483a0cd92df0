// The bus within one process: order, bounds, counts, threads.
#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "protocols/bus/bus.hpp"

namespace parhelion {
namespace {

std::vector<std::uint8_t> number(std::uint32_t n) {
  return {static_cast<std::uint8_t>(n >> 24), static_cast<std::uint8_t>(n >> 16),
          static_cast<std::uint8_t>(n >> 8), static_cast<std::uint8_t>(n)};
}

std::uint32_t number(const Message& message) {
  const auto& p = message.payload;
  return std::uint32_t{p.at(0)} << 24 | std::uint32_t{p.at(1)} << 16 | std::uint32_t{p.at(2)} << 8 | p.at(3);
}

bool receive(Bus& bus, Message& message, Duration timeout = seconds(0)) {
  const auto came = bus.receive(message, timeout);
  EXPECT_TRUE(came) << came.error().message;
  return came && *came;
}

TEST(MemoryBus, MessagesOfSeveralChannelsArriveInSendingOrder) {
  MemoryBusHub hub;
  const auto sender = hub.connect();
  const auto receiver = hub.connect();
  ASSERT_TRUE(receiver->subscribe("A", 100));
  ASSERT_TRUE(receiver->subscribe("B", 100));
  for (std::uint32_t i = 0; i < 100; ++i) ASSERT_TRUE(sender->publish(i % 3 == 0 ? "A" : "B", number(i)));
  Message message;
  for (std::uint32_t i = 0; i < 100; ++i) {
    ASSERT_TRUE(receive(*receiver, message));
    EXPECT_EQ(number(message), i);
    EXPECT_EQ(message.channel, i % 3 == 0 ? "A" : "B");
  }
  EXPECT_FALSE(receive(*receiver, message));
  EXPECT_EQ(receiver->dropped(), 0U);
}

TEST(MemoryBus, AFullQueueDropsItsOldestAndCountsThem) {
  MemoryBusHub hub;
  const auto bus = hub.connect();
  ASSERT_TRUE(bus->subscribe("VIDEO", 1));
  ASSERT_TRUE(bus->subscribe("SCAN", 3));
  for (std::uint32_t i = 0; i < 10; ++i) {
    ASSERT_TRUE(bus->publish("VIDEO", number(i)));
    ASSERT_TRUE(bus->publish("SCAN", number(i)));
  }
  std::vector<std::uint32_t> video, scans;
  for (Message message; receive(*bus, message);)
    (message.channel == "VIDEO" ? video : scans).push_back(number(message));
  EXPECT_EQ(video, std::vector<std::uint32_t>({9}));
  EXPECT_EQ(scans, std::vector<std::uint32_t>({7, 8, 9}));
  EXPECT_EQ(bus->dropped(), 9U + 7U);
}

TEST(MemoryBus, PatternsMatchWholeNamesAsInLcm) {
  MemoryBusHub hub;
  const auto bus = hub.connect();
  ASSERT_TRUE(bus->subscribe("MR_AGENT_.*_TELEOP", 10));
  ASSERT_TRUE(bus->subscribe("SCAN", 10));
  for (const char* channel :
       {"MR_AGENT_a_TELEOP", "XMR_AGENT_a_TELEOP", "MR_AGENT_a_TELEOPX", "MR_SCAN", "SCAN"}) {
    ASSERT_TRUE(bus->publish(channel, {}));
  }
  std::vector<std::string> received;
  for (Message message; receive(*bus, message);) received.push_back(message.channel);
  EXPECT_EQ(received, std::vector<std::string>({"MR_AGENT_a_TELEOP", "SCAN"}));
}

TEST(MemoryBus, InvalidArgumentsAreRefused) {
  MemoryBusHub hub;
  const auto bus = hub.connect();
  EXPECT_FALSE(bus->subscribe("A", 0));
  EXPECT_FALSE(bus->subscribe("(", 1));
  EXPECT_FALSE(bus->publish("", {}));
  EXPECT_FALSE(bus->publish(std::string(64, 'x'), {}));
  EXPECT_TRUE(bus->publish(std::string(63, 'x'), {}));
}

TEST(MemoryBus, ADestroyedEndpointReceivesNothing) {
  MemoryBusHub hub;
  auto gone = hub.connect();
  const auto stays = hub.connect();
  ASSERT_TRUE(gone->subscribe("A", 1));
  ASSERT_TRUE(stays->subscribe("A", 1));
  gone.reset();
  ASSERT_TRUE(stays->publish("A", number(1)));
  Message message;
  EXPECT_TRUE(receive(*stays, message));
}

/// Else a page shows no world while its scans go on: the newest world is always younger than the scans.
TEST(MemoryBus, TheNewestOfAChannelIsReadHoweverFarTheReaderIsBehind) {
  MemoryBusHub hub;
  const auto sender = hub.connect(), reader = hub.connect();
  ASSERT_TRUE(reader->subscribe("SCAN", 64).ok());
  ASSERT_TRUE(reader->subscribe("WORLD", 1).ok());
  std::vector<int> worlds;
  for (int i = 0; i < 200; ++i) {
    const std::uint8_t bytes[] = {static_cast<std::uint8_t>(i)};
    for (int scan = 0; scan < 3; ++scan) ASSERT_TRUE(sender->publish("SCAN", bytes).ok());
    ASSERT_TRUE(sender->publish("WORLD", bytes).ok());
    for (int read = 0; read < 2; ++read) {  // of four
      Message message;
      ASSERT_TRUE(*reader->receive(message, Duration{0}));
      if (message.channel != "WORLD") continue;
      worlds.push_back(message.payload[0]);
      EXPECT_EQ(message.payload[0], i) << "the newest";
    }
  }
  // At least one for each turn of the queue of scans.
  EXPECT_GE(worlds.size(), 10U);
  EXPECT_TRUE(std::is_sorted(worlds.begin(), worlds.end()));
  EXPECT_GT(worlds.back(), 150);
}

/// As SLAM reads them: a scan needs the odometry that came before it.
TEST(MemoryBus, AQueueThatDropsMessagesKeepsTheOthersBeforeThoseThatCameLater) {
  MemoryBusHub hub;
  const auto sender = hub.connect(), reader = hub.connect();
  ASSERT_TRUE(reader->subscribe("SCAN", 3).ok());
  ASSERT_TRUE(reader->subscribe("ODOMETRY", 200).ok());
  for (std::uint8_t i = 0; i < 20; ++i) {
    const std::uint8_t bytes[] = {i};
    ASSERT_TRUE(sender->publish(i % 2 == 0 ? "ODOMETRY" : "SCAN", bytes).ok());
  }
  int newest = -1;
  for (Message message; receive(*reader, message); newest = message.payload[0])
    EXPECT_GT(message.payload[0], newest) << message.channel;
  EXPECT_EQ(newest, 19);
}

/// A depth camera that floods must not cost an emergency stop.
TEST(MemoryBus, AFloodOfLargeMessagesLosesItsOwn) {
  MemoryBusHub hub;
  const auto sender = hub.connect(), reader = hub.connect();
  ASSERT_TRUE(reader->subscribe("DEPTH", 64).ok());
  ASSERT_TRUE(reader->subscribe("STOP", 64).ok());
  const std::vector<std::uint8_t> image(std::size_t{1} << 20);
  const auto flood = [&] {
    for (int i = 0; i < 40; ++i) ASSERT_TRUE(sender->publish("DEPTH", image).ok());
  };
  flood();
  ASSERT_TRUE(sender->publish("STOP", std::vector<std::uint8_t>(100)).ok());
  flood();
  std::size_t stops = 0, images = 0;
  for (Message message; receive(*reader, message);) ++(message.channel == "STOP" ? stops : images);
  EXPECT_EQ(stops, 1U);
  EXPECT_GT(images, 10U);
}

TEST(MemoryBus, KeepsEachThreadsMessagesAndTheirOrder) {
  constexpr std::uint32_t threads = 4, each = 2000;
  MemoryBusHub hub;
  const auto receiver = hub.connect();
  ASSERT_TRUE(receiver->subscribe("T[0-9]", threads * each));
  std::vector<std::jthread> senders;
  for (std::uint32_t t = 0; t < threads; ++t) {
    senders.emplace_back([&hub, t] {
      const auto bus = hub.connect();
      for (std::uint32_t i = 0; i < each; ++i) EXPECT_TRUE(bus->publish("T" + std::to_string(t), number(i)));
    });
  }
  std::vector<std::uint32_t> next(threads);
  Message message;
  for (std::uint32_t n = 0; n < threads * each; ++n) {
    ASSERT_TRUE(receive(*receiver, message, seconds(30))) << n;
    const auto t = static_cast<std::size_t>(message.channel.at(1) - '0');
    EXPECT_EQ(number(message), next.at(t)++);
  }
  EXPECT_EQ(receiver->dropped(), 0U);
}

TEST(MemoryBus, AWaitingReceiverWakesForAMessage) {
  MemoryBusHub hub;
  const auto receiver = hub.connect();
  ASSERT_TRUE(receiver->subscribe("A", 1));
  std::jthread sender([&hub] { EXPECT_TRUE(hub.connect()->publish("A", number(5))); });
  Message message;
  ASSERT_TRUE(receive(*receiver, message, seconds(30)));
  EXPECT_EQ(number(message), 5U);
}

}  // namespace
}  // namespace parhelion
