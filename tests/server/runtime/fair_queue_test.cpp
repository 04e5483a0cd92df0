#include "server/runtime/fair_queue.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace parhelion::runtime {
namespace {

struct Item {
  std::uint64_t sender = 0;
  int number = 0;
};

/// Against what each sender must get, whatever the others send: its items in order, none lost and none twice,
/// and none displaced while it has no more than its fraction of the limits.
TEST(FairQueueTest, SendersKeepTheirOrderAndTheirFraction) {
  constexpr std::size_t kMaxItems = 30, kMaxBytes = 300, kSenders = 4;
  std::mt19937 random(5);
  FairQueue<Item> queue(kMaxItems, kMaxBytes);
  std::map<std::uint64_t, std::deque<std::pair<int, std::size_t>>> expected;  // number and bytes
  std::map<std::uint64_t, int> sent;
  std::size_t displaced_items = 0, waiting = 0;
  for (int step = 0; step < 20'000; ++step) {
    if (random() % 3 != 0) {
      const std::uint64_t sender = random() % 8 == 0 ? 1 + random() % kSenders : 1;  // the first one floods
      const std::size_t bytes = random() % 40;
      expected[sender].emplace_back(sent[sender], bytes);
      for (const Item& gone : queue.push(sender, {sender, sent[sender]++}, bytes)) {
        auto& line = expected[gone.sender];
        ASSERT_FALSE(line.empty());
        ASSERT_EQ(line.back().first, gone.number) << "the newest";
        std::size_t held = 0;
        for (const auto& each : line) held += each.second;
        EXPECT_TRUE(line.size() > kMaxItems / kSenders || held > kMaxBytes / kSenders) << "within its share";
        line.pop_back();
        ++displaced_items;
      }
    } else if (const auto item = queue.pop()) {
      auto& line = expected[item->sender];
      ASSERT_FALSE(line.empty());
      ASSERT_EQ(line.front().first, item->number) << "the oldest";
      line.pop_front();
    }
    waiting = 0;
    std::size_t bytes = 0;
    for (const auto& [sender, line] : expected) {
      waiting += line.size();
      for (const auto& each : line) bytes += each.second;
    }
    ASSERT_EQ(queue.size(), waiting);
    ASSERT_LE(waiting, kMaxItems);
    ASSERT_LE(bytes, kMaxBytes);
  }
  EXPECT_GT(displaced_items, 1000U);
}

TEST(FairQueueTest, SendersTakeTurns) {
  FairQueue<Item> queue(1000, 1000);
  for (int i = 0; i < 100; ++i) (void)queue.push(5, {5, i}, 1);
  for (int i = 0; i < 3; ++i) (void)queue.push(9, {9, i}, 1);
  (void)queue.push(2, {2, 0}, 1);
  std::map<std::uint64_t, int> taken;
  for (int i = 0; i < 7; ++i) ++taken[queue.pop()->sender];
  EXPECT_EQ(taken, (std::map<std::uint64_t, int>{{2, 1}, {5, 3}, {9, 3}}));
}

TEST(FairQueueTest, TakesTheOldestOfEachSenderUpToTheFirstThatIsNotWanted) {
  FairQueue<Item> queue(1000, 1000);
  for (int i = 0; i < 6; ++i) (void)queue.push(i % 2, {0, i}, 1);
  std::vector<int> taken;
  for (const Item& item : queue.take_oldest([](const Item& each) { return each.number != 2; }))
    taken.push_back(item.number);
  EXPECT_EQ(taken, (std::vector<int>{0, 1, 3, 5}));
  EXPECT_EQ(queue.size(), 2U);
  EXPECT_EQ(queue.pop()->number, 2);
  EXPECT_EQ(queue.pop()->number, 4);
  EXPECT_TRUE(queue.empty());
  EXPECT_FALSE(queue.pop());
}

}  // namespace
}  // namespace parhelion::runtime
