// What is reported of messages that the bus refused.
#include "server/runtime/refused_messages.hpp"

#include <gtest/gtest.h>

namespace parhelion::runtime {
namespace {

TEST(RefusedMessages, EachFaultOnEachChannelIsReportedOnce) {
  RefusedMessages refused;
  for (int i = 0; i < 3; ++i) {
    refused.add({SignatureFault::not_signed, "TELEOP", ""});
    refused.add({SignatureFault::replayed, "TELEOP", "ann"});
  }
  EXPECT_EQ(refused.take().size(), 2U);
  EXPECT_TRUE(refused.take().empty());
  EXPECT_EQ(refused.count(), 6U);
}

// A stranger used up what is reported by channels of agents that do not exist.
TEST(RefusedMessages, InventedChannelsOfAgentsAreOneAndHideNoOther) {
  RefusedMessages refused;
  for (int i = 0; i < 5000; ++i)
    refused.add({SignatureFault::not_signed, "MR_AGENT_" + std::to_string(i) + "\x1b[2J_TELEOP", ""});
  refused.add({SignatureFault::not_signed, "TELEOP", ""});
  const auto news = refused.take();
  ASSERT_EQ(news.size(), 2U);
  EXPECT_EQ(news[0].channel, "MR_AGENT_*");
  EXPECT_EQ(news[1].channel, "TELEOP");
}

}  // namespace
}  // namespace parhelion::runtime
