#include "protocols/bus/reassembly.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "tests/protocols/raw_datagrams.hpp"

namespace parhelion {
namespace {

using Payload = std::vector<std::uint8_t>;

constexpr DatagramSender kSender{0x7f000001, 5000};
constexpr std::size_t kMax = std::size_t{1} << 20;

using Fields = test::FragmentHeader;

Payload short_message(const std::string& channel, const Payload& payload) {
  return test::short_message({channel, {}, payload});
}

Payload datagram_of(const Fields& fields, const Payload& data, const std::string& channel = "SCAN") {
  return test::fragment(fields, channel, data);
}

Payload random_bytes(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  Payload bytes(size);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
  return bytes;
}

/// As liblcm sends it: pieces of `piece` bytes, in order.
std::vector<Payload> fragments_of(const Payload& payload, std::size_t piece, std::uint32_t sequence = 1,
                                  const std::string& channel = "SCAN") {
  std::vector<Payload> all;
  const std::size_t count = std::max<std::size_t>(1, (payload.size() + piece - 1) / piece);
  for (std::size_t i = 0; i < count; ++i) {
    const auto begin = payload.begin() + static_cast<std::ptrdiff_t>(i * piece);
    const auto end = payload.begin() + static_cast<std::ptrdiff_t>(std::min(payload.size(), (i + 1) * piece));
    all.push_back(datagram_of(
        {sequence, static_cast<std::uint32_t>(payload.size()), static_cast<std::uint32_t>(i * piece),
         static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(count)},
        Payload(begin, end), channel));
  }
  return all;
}

class ReassemblyTest : public ::testing::Test {
 protected:
  std::optional<Payload> add(const Payload& datagram, const DatagramSender& sender = kSender) {
    const auto complete = reassembly_.add(sender, datagram, now_);
    if (!complete) return std::nullopt;
    channel_ = complete->channel;
    return Payload(complete->payload.begin(), complete->payload.end());
  }
  std::uint64_t faults(DatagramFault fault) const {
    return reassembly_.faults()[static_cast<std::size_t>(fault)];
  }
  std::uint64_t all_faults() const {
    std::uint64_t sum = 0;
    for (const std::uint64_t each : reassembly_.faults()) sum += each;
    return sum;
  }

  Reassembly reassembly_{[](std::string_view channel) { return channel == "UNWANTED" ? 0 : kMax; }};
  ArrivalTime now_{1'000'000'000};
  std::string channel_;
};

TEST_F(ReassemblyTest, AShortMessageIsItsDatagram) {
  EXPECT_EQ(add(short_message("TELEOP", {1, 2, 3})), (Payload{1, 2, 3}));
  EXPECT_EQ(channel_, "TELEOP");
  EXPECT_EQ(add(short_message("TELEOP", {})), Payload{});
  EXPECT_EQ(all_faults(), 0U);
}

RC_GTEST_FIXTURE_PROP(ReassemblyTest, FragmentsInAnyOrderGiveTheMessage, ()) {
  const Payload payload = random_bytes(*rc::gen::inRange<std::size_t>(1, 5000), 7);
  auto fragments = fragments_of(payload, *rc::gen::inRange<std::size_t>(1, 700));
  std::shuffle(fragments.begin(), fragments.end(), std::mt19937(*rc::gen::arbitrary<unsigned>()));
  for (std::size_t i = 0; i + 1 < fragments.size(); ++i) RC_ASSERT(!add(fragments[i]));
  RC_ASSERT(add(fragments.back()) == payload);
  RC_ASSERT(reassembly_.pending_messages() == 0U);
  RC_ASSERT(reassembly_.pending_bytes() == 0U);
}

TEST_F(ReassemblyTest, MessagesOfTwoSendersWithOneNumberAreNotMixed) {
  const DatagramSender other{0x7f000001, 5001};
  const Payload a = random_bytes(2000, 1), b = random_bytes(2000, 2);
  const auto of_a = fragments_of(a, 1000), of_b = fragments_of(b, 1000);
  EXPECT_FALSE(add(of_a[0]));
  EXPECT_FALSE(add(of_b[0], other));
  EXPECT_EQ(add(of_b[1], other), b);
  EXPECT_EQ(add(of_a[1]), a);
}

TEST_F(ReassemblyTest, ASenderThatStartsAgainReplacesItsOldMessage) {
  EXPECT_FALSE(add(fragments_of(random_bytes(3000, 1), 1000)[0]));
  const Payload payload = random_bytes(2000, 2);
  const auto fragments = fragments_of(payload, 1000);
  EXPECT_FALSE(add(fragments[0]));
  EXPECT_EQ(add(fragments[1]), payload);
  EXPECT_EQ(faults(DatagramFault::incomplete), 1U);
}

// liblcm 1.3.1 adds in 32 bits, and writes outside the heap.
TEST_F(ReassemblyTest, AnOffsetThatWrapsIsRefused) {
  EXPECT_FALSE(add(datagram_of({1, 1000, 0, 0, 2}, random_bytes(500, 1))));
  EXPECT_FALSE(add(datagram_of({1, 1000, 0xffffff00, 1, 2}, random_bytes(500, 2))));
  EXPECT_EQ(faults(DatagramFault::inconsistent), 1U);
}

// liblcm 1.3.1 completes it with memory that was never written.
TEST_F(ReassemblyTest, AMessageThatCarriesLessThanItDeclaresIsNotComplete) {
  EXPECT_FALSE(add(datagram_of({1, 60'000, 0, 0, 1}, Payload(8))));
  EXPECT_EQ(faults(DatagramFault::overlapping), 1U);
  EXPECT_EQ(reassembly_.pending_messages(), 0U);
}

// liblcm 1.3.1 allocates what a datagram declares.
TEST_F(ReassemblyTest, DeclaredSizesTakeNoMemory) {
  for (std::uint32_t i = 0; i < 1000; ++i) {
    EXPECT_FALSE(add(datagram_of({i, 200'000'000, 0, 0, 4000}, Payload(40))));
    EXPECT_FALSE(add(datagram_of({i, 200'000'000, 50, 1, 4000}, Payload(40)), {0x7f000001, 6000}));
  }
  EXPECT_LE(reassembly_.pending_messages(), ReassemblyLimits{}.messages);
  EXPECT_LE(reassembly_.pending_bytes(), std::size_t{1} << 20);
  EXPECT_EQ(faults(DatagramFault::too_large), 1000U);
}

TEST_F(ReassemblyTest, RepeatedAndOverlappingFragmentsAreRefused) {
  const Payload payload = random_bytes(1000, 1);
  EXPECT_FALSE(add(datagram_of({1, 1000, 0, 0, 2}, Payload(payload.begin(), payload.begin() + 600))));
  EXPECT_FALSE(add(datagram_of({1, 1000, 0, 0, 2}, Payload(600, 9))));
  EXPECT_EQ(faults(DatagramFault::repeated), 1U);
  EXPECT_EQ(add(datagram_of({1, 1000, 600, 1, 2}, Payload(payload.begin() + 600, payload.end()))), payload)
      << "the first of two counts";
  EXPECT_FALSE(add(datagram_of({2, 1000, 0, 0, 2}, Payload(600))));
  EXPECT_FALSE(add(datagram_of({2, 1000, 500, 1, 2}, Payload(500))));
  EXPECT_EQ(faults(DatagramFault::overlapping), 1U);
  EXPECT_FALSE(add(datagram_of({3, 1000, 0, 0, 2}, Payload(400))));
  EXPECT_FALSE(add(datagram_of({3, 1000, 600, 1, 2}, Payload(400))));
  EXPECT_EQ(faults(DatagramFault::overlapping), 2U) << "a hole";
  EXPECT_EQ(reassembly_.pending_bytes(), 0U);
}

TEST_F(ReassemblyTest, MalformedDatagramsAreCountedByKind) {
  for (std::size_t size = 0; size < 8; ++size) EXPECT_FALSE(add(Payload(size)));
  EXPECT_FALSE(add(Payload(100, 'x')));
  Payload endless{'L', 'C', '0', '2', 0, 0, 0, 1};
  endless.resize(endless.size() + 64, 'C');
  EXPECT_FALSE(add(endless));
  EXPECT_FALSE(add(short_message("", {1})));
  EXPECT_FALSE(add(datagram_of({1, 10, 0, 0, 1}, Payload(10), "")));
  const Payload whole = datagram_of({1, 10, 0, 1, 2}, Payload(5));
  for (std::size_t size = 8; size < 20; ++size)
    EXPECT_FALSE(add(Payload(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size))));
  EXPECT_FALSE(add(datagram_of({1, 10, 0, 2, 2}, Payload(5)))) << "number 2 of 2";
  EXPECT_FALSE(add(datagram_of({1, 10, 0, 0, 0}, Payload(5)))) << "no fragment at all";
  EXPECT_FALSE(add(datagram_of({1, 10, 0, 1, 2}, {}))) << "an empty fragment";
  EXPECT_FALSE(add(datagram_of({1, 10, 0, 1, 20}, Payload(1)))) << "more fragments than bytes";
  EXPECT_EQ(faults(DatagramFault::truncated), 8U + 12U);
  EXPECT_EQ(faults(DatagramFault::not_lcm), 1U);
  EXPECT_EQ(faults(DatagramFault::bad_channel), 3U);
  EXPECT_EQ(faults(DatagramFault::inconsistent), 4U);
  EXPECT_EQ(reassembly_.pending_messages(), 0U);
}

TEST_F(ReassemblyTest, TheLimitOfAChannelHoldsForShortAndLongMessages) {
  EXPECT_FALSE(add(short_message("SCAN", Payload(kMax + 1))));
  const auto fragments = fragments_of(Payload(kMax + 1), 60'000);
  for (const Payload& each : fragments) EXPECT_FALSE(add(each));
  EXPECT_EQ(faults(DatagramFault::too_large), 2U);
  EXPECT_EQ(reassembly_.pending_messages(), 0U) << "its other fragments are not kept";
}

TEST_F(ReassemblyTest, ChannelsThatNobodyWantsAreNotKept) {
  EXPECT_FALSE(add(short_message("UNWANTED", {1})));
  const auto fragments = fragments_of(Payload(100'000), 1000, 1, "UNWANTED");
  for (std::size_t i = 0; i + 1 < fragments.size(); ++i) {
    EXPECT_FALSE(add(fragments[i]));
    EXPECT_LT(reassembly_.pending_bytes(), 1000U);
  }
  EXPECT_FALSE(add(fragments.back()));
  EXPECT_EQ(reassembly_.pending_messages(), 0U);
  EXPECT_EQ(all_faults(), 0U);
}

TEST_F(ReassemblyTest, AMessageWithMissingFragmentsIsDroppedAfterASecond) {
  EXPECT_FALSE(add(fragments_of(Payload(3000), 1000)[0]));
  now_ = now_ + milliseconds(900);
  EXPECT_FALSE(add(fragments_of(Payload(3000), 1000)[1]));
  now_ = now_ + milliseconds(900);
  EXPECT_TRUE(add(short_message("SCAN", {1})));
  EXPECT_EQ(reassembly_.pending_messages(), 1U) << "its newest fragment is not a second old";
  now_ = now_ + milliseconds(200);
  EXPECT_TRUE(add(short_message("SCAN", {1})));
  EXPECT_EQ(reassembly_.pending_messages(), 0U);
  EXPECT_EQ(faults(DatagramFault::incomplete), 1U);
}

// Who sends much loses its own messages.
TEST_F(ReassemblyTest, AFloodOfOneSenderDoesNotCostAnotherItsMessage) {
  const Payload payload = random_bytes(100'000, 1);
  const auto fragments = fragments_of(payload, 60'000);
  EXPECT_FALSE(add(fragments[0]));
  for (std::uint32_t i = 0; i < 10'000; ++i)
    EXPECT_FALSE(add(datagram_of({i, 1'000'000, 1'000, 1, 20}, Payload(50'000)), {0x7f000001, 6000}));
  EXPECT_LE(reassembly_.pending_bytes(), ReassemblyLimits{}.bytes);
  EXPECT_EQ(add(fragments[1]), payload);
}

// Any sequence of datagrams: bounded memory, and a message is exactly what its fragments carried.
RC_GTEST_FIXTURE_PROP(ReassemblyTest, RandomFragmentsNeverGiveWhatWasNotSent, ()) {
  const auto steps = *rc::gen::inRange(1, 60);
  for (int i = 0; i < steps; ++i) {
    Fields fields;
    fields.sequence = *rc::gen::inRange<std::uint32_t>(0, 3);
    fields.size = *rc::gen::element<std::uint32_t>(0, 1, 40, 60, 0xffffffff, 200'000'000);
    fields.count = *rc::gen::inRange<std::uint16_t>(0, 4);
    fields.index = *rc::gen::inRange<std::uint16_t>(0, 4);
    fields.offset = *rc::gen::element<std::uint32_t>(0, 20, 40, 0xffffffec, 0xffffffff);
    const std::size_t size = *rc::gen::element<std::size_t>(0, 1, 20, 40);
    const auto given = add(datagram_of(fields, Payload(size, 0xaa)));
    if (given)
      RC_ASSERT(std::all_of(given->begin(), given->end(), [](std::uint8_t each) { return each == 0xaa; }));
    if (given) RC_ASSERT(given->size() == fields.size);
    RC_ASSERT(reassembly_.pending_bytes() <= std::size_t{1} << 16);
  }
}

}  // namespace
}  // namespace parhelion
