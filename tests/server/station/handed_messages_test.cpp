#include "server/station/handed_messages.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace parhelion::station {
namespace {

Message numbered(std::uint32_t number, std::size_t size) {
  Message message{"CHANNEL_" + std::to_string(number % 7), ArrivalTime{number}, {}};
  message.payload.assign(size, static_cast<std::uint8_t>(number));
  return message;
}

TEST(HandedMessages, AreDeliveredOnceAndInOrder) {
  HandedMessages handed;
  std::vector<std::int64_t> taken;
  const auto take = [&] { handed.take_all([&](const Message& each) { taken.push_back(each.arrival.ns); }); };
  for (const std::uint32_t i : {1U, 2U, 3U}) handed.put(numbered(i, 10));
  take();
  take();
  for (const std::uint32_t i : {4U, 5U}) handed.put(numbered(i, 10));
  take();
  EXPECT_EQ(taken, (std::vector<std::int64_t>{1, 2, 3, 4, 5}));
}

TEST(HandedMessages, NoneIsLostOrReorderedUnderRaces) {
  constexpr std::uint32_t total = 20'000;
  HandedMessages handed;
  std::jthread sender([&] {
    for (std::uint32_t i = 0; i < total; ++i) handed.put(numbered(i, i % 97));
  });
  std::uint32_t next = 0;
  while (next < total) {
    handed.take_all([&](const Message& each) {
      const Message expected = numbered(next, next % 97);
      ++next;
      ASSERT_EQ(each.arrival.ns, expected.arrival.ns);
      ASSERT_EQ(each.channel, expected.channel);
      ASSERT_EQ(each.payload, expected.payload);
    });
    ASSERT_FALSE(testing::Test::HasFatalFailure());
    std::this_thread::yield();
  }
  EXPECT_EQ(handed.dropped(), 0U);
}

TEST(HandedMessages, MessagesBeyondTheLimitAreDroppedAndCounted) {
  HandedMessages handed;
  const Message picture = numbered(1, std::size_t{1} << 20U);
  for (int i = 0; i < 100; ++i) handed.put(picture);
  EXPECT_GT(handed.dropped(), 30U);
  std::uint64_t taken = 0;
  handed.take_all([&](const Message&) { ++taken; });
  EXPECT_EQ(taken + handed.dropped(), 100U);
  handed.put(picture);
  handed.take_all([&](const Message&) { ++taken; });
  EXPECT_EQ(taken + handed.dropped(), 101U) << "it must take messages again once there is room";
}

}  // namespace
}  // namespace parhelion::station
