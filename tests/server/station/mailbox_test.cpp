// A blocked worker blocks nobody else, and its queue is bounded.
#include "server/station/mailbox.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace parhelion::station {
namespace {

TEST(Mailbox, FloodingPagesAreRefusedWithoutBlocking) {
  Mailbox mailbox;
  std::size_t taken = 0;
  while (taken < 10'000 && mailbox.put(ClientText{1, "{}"})) ++taken;
  EXPECT_EQ(taken, Mailbox::kMaxTexts);
}

TEST(Mailbox, TheBusBlocksUntilThereIsRoom) {
  Mailbox mailbox;
  for (std::size_t i = 0; i < Mailbox::kMaxMessages; ++i) ASSERT_TRUE(mailbox.put(Message{}));
  std::thread bus([&] { EXPECT_TRUE(mailbox.put(Message{"SCAN", {}, {}})); });
  StationEvent event;
  ASSERT_TRUE(mailbox.take(event, Duration{0}));
  bus.join();
}

TEST(Mailbox, ClosingReleasesAllWaitingThreads) {
  Mailbox mailbox;
  for (std::size_t i = 0; i < Mailbox::kMaxMessages; ++i) ASSERT_TRUE(mailbox.put(Message{}));
  std::thread bus([&] { EXPECT_FALSE(mailbox.put(Message{})); });
  mailbox.close();
  bus.join();
  StationEvent event;
  EXPECT_FALSE(mailbox.take(event, seconds(1.0)));
}

}  // namespace
}  // namespace parhelion::station
