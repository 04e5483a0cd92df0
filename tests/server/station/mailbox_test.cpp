// A blocked worker blocks nobody else, and its queue is bounded.
#include "server/station/mailbox.hpp"

#include <gtest/gtest.h>

#include <thread>

namespace parhelion::station {
namespace {

TEST(Mailbox, PagesThatSayTooMuchAreToldSoAndNeverWait) {
  Mailbox mailbox;
  std::size_t taken = 0;
  while (taken < 10'000 && mailbox.put(PageSaid{1, "{}"})) ++taken;
  EXPECT_EQ(taken, Mailbox::most_texts);
}

TEST(Mailbox, TheBusWaitsOutsideUntilThereIsRoom) {
  Mailbox mailbox;
  for (std::size_t i = 0; i < Mailbox::most_messages; ++i) ASSERT_TRUE(mailbox.put(Message{}));
  std::thread bus([&] { EXPECT_TRUE(mailbox.put(Message{"SCAN", {}, {}})); });
  Letter letter;
  ASSERT_TRUE(mailbox.take(letter, Duration{0}));
  bus.join();
}

TEST(Mailbox, AClosedOneLetsGoOfWhoeverWaits) {
  Mailbox mailbox;
  for (std::size_t i = 0; i < Mailbox::most_messages; ++i) ASSERT_TRUE(mailbox.put(Message{}));
  std::thread bus([&] { EXPECT_FALSE(mailbox.put(Message{})); });
  mailbox.close();
  bus.join();
  Letter letter;
  EXPECT_FALSE(mailbox.take(letter, seconds(1.0)));
}

}  // namespace
}  // namespace parhelion::station
