#include "protocols/arrival_order.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace parhelion {
namespace {

using Verdict = ArrivalOrder::Verdict;

ArrivalTime at(double s) { return ArrivalTime{} + seconds(s); }

TEST(ArrivalOrder, StampsInOrderStayAsTheyAre) {
  ArrivalOrder order;
  for (const double s : {5.0, 5.1, 5.2, 305.2}) {
    const auto placed = order.place(at(s));
    EXPECT_EQ(placed.arrival, at(s));
    EXPECT_EQ(placed.verdict, Verdict::own_stamp);
  }
}

TEST(ArrivalOrder, AStampThatIsNotLaterFollowsByAMicrosecond) {
  ArrivalOrder order;
  order.begin_after(at(5));
  for (const double s : {5.0, 4.0, -1e9}) {
    const ArrivalTime last = *order.last();
    const auto placed = order.place(at(s));
    EXPECT_EQ(placed.arrival, last + microseconds(1));
    EXPECT_EQ(placed.verdict, Verdict::not_later);
  }
}

TEST(ArrivalOrder, OneOutlierStampDoesNotShiftTheNext) {
  ArrivalOrder order;
  order.place(at(5));
  const auto wild = order.place(at(1e6));
  EXPECT_EQ(wild.verdict, Verdict::ahead);
  EXPECT_EQ(wild.arrival, at(5) + microseconds(1));
  EXPECT_EQ(order.place(at(5.1)).arrival, at(5.1));
}

TEST(ArrivalOrder, FiveConsistentStampsConfirmAClockJump) {
  ArrivalOrder order;
  order.place(at(5));
  for (const double s : {1000.0, 1000.2, 1000.1, 1000.3})
    EXPECT_EQ(order.place(at(s)).verdict, Verdict::ahead);
  const auto fifth = order.place(at(1000.25));
  EXPECT_EQ(fifth.verdict, Verdict::real_leap);
  EXPECT_EQ(fifth.arrival, at(1000.25));
  EXPECT_EQ(order.place(at(1000.4)).verdict, Verdict::own_stamp);
}

TEST(ArrivalOrder, FourConsistentStampsAndAnOutlierAreNoClockJump) {
  for (const double odd : {5.1, 5000.0}) {
    ArrivalOrder order;
    order.place(at(5));
    for (int i = 0; i < 4; ++i) order.place(at(1000 + i));
    EXPECT_NE(order.place(at(odd)).verdict, Verdict::real_leap);
    for (int i = 0; i < 4; ++i) EXPECT_EQ(order.place(at(1010 + i)).verdict, Verdict::ahead) << odd;
    EXPECT_EQ(order.place(at(1014)).verdict, Verdict::real_leap) << odd;
  }
}

TEST(ArrivalOrder, ObservedAndTrustedStampsAdvanceTheTime) {
  ArrivalOrder seen;
  seen.place(at(5));
  for (const double s : {5.0, 200.0, 400.0}) seen.see(at(s));
  seen.see(at(1e6));
  EXPECT_EQ(seen.place(at(600)).verdict, Verdict::own_stamp);
  EXPECT_EQ(seen.place(at(1e6)).verdict, Verdict::ahead) << "a wild one that was seen is not believed";
  ArrivalOrder trusted;
  trusted.place(at(5));
  EXPECT_EQ(trusted.place(at(1e6), true).arrival, at(1e6));
}

TEST(ArrivalOrder, ArrivalsIncreaseForAnyStamps) {
  std::mt19937_64 random(7);
  ArrivalOrder order;
  ArrivalTime last = order.place(at(1)).arrival;
  for (int i = 0; i < 10'000; ++i) {
    // Up to a thousandth of the range of an int64, or any value below.
    const auto bits = static_cast<std::int64_t>(random());
    const std::int64_t ns = i % 3 == 0 ? -std::abs(bits / 2) : bits / 1000;
    const ArrivalTime arrival = order.place({ns}).arrival;
    ASSERT_GE(arrival - last, microseconds(1));
    last = arrival;
  }
}

}  // namespace
}  // namespace parhelion
