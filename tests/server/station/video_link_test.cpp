// The bit rate follows the link, with hysteresis and a floor.
#include "server/station/video/video_link.hpp"

#include <gtest/gtest.h>

#include <deque>

#include "server/station/video/picture_age.hpp"

namespace parhelion::station {
namespace {

WallTime at(double s) { return WallTime{} + seconds(s + 1); }

/// A link of `rate` bit/s with 20 ms round trip: its queue and its acknowledgements.
class Pipe {
 public:
  explicit Pipe(double rate) : rate_(rate) {}
  double rate() const { return rate_; }
  void set_rate(double rate) { rate_ = rate; }
  void step(double dt, double t, VideoLink& link) {
    double bits = rate_ * dt;
    while (!queue_.empty() && bits > 0) {
      const double taken = std::min(bits, queue_.front().bits);
      bits -= taken;
      queue_.front().bits -= taken;
      if (queue_.front().bits > 0) break;
      acks_.push_back({queue_.front().sequence, t + 0.02});
      queue_.pop_front();
    }
    for (; !acks_.empty() && acks_.front().at <= t; acks_.pop_front())
      link.acknowledged(acks_.front().sequence, at(t));
  }
  void send(std::uint32_t sequence, double bits) { queue_.push_back({sequence, bits}); }
  std::size_t waiting() const {
    double bits = 0;
    for (const auto& each : queue_) bits += each.bits;
    return static_cast<std::size_t>(bits / 8);
  }

 private:
  struct Frame {
    std::uint32_t sequence;
    double bits;
  };
  struct Ack {
    std::uint32_t sequence;
    double at;
  };
  double rate_;
  std::deque<Frame> queue_;
  std::deque<Ack> acks_;
};

/// 30 frames a second through the pipe; `hidden`: the queue is where the server cannot see it.
int run(VideoLink& link, Pipe& pipe, double from, double to, bool hidden = false) {
  static std::uint32_t sequence = 0;
  int left_out = 0;
  double next = from;
  for (double t = from; t < to; t += 0.005) {
    pipe.step(0.005, t, link);
    if (t < next) continue;
    next += 1 / 30.0;
    link.look(hidden ? 0 : pipe.waiting(), at(t));
    if (link.lags()) {
      ++left_out;
      continue;
    }
    pipe.send(++sequence, link.bit_rate() / 30.0);
    link.sent(sequence, at(t));
  }
  return left_out;
}

TEST(VideoLink, ReachesAndKeepsTheMaximumOnAGoodLink) {
  VideoLink link;
  Pipe pipe(50e6);
  EXPECT_EQ(run(link, pipe, 0, 60), 0);
  EXPECT_EQ(link.bit_rate(), VideoLinkLimits{}.ceiling);
  EXPECT_FALSE(link.congested());
  EXPECT_NEAR(link.round_trip()->seconds(), 0.02, 0.01);
}

TEST(VideoLink, SettlesBelowTheCapacityOfANarrowLink) {
  for (const bool hidden : {false, true}) {
    VideoLink link;
    Pipe pipe(600e3);
    run(link, pipe, 0, 20, hidden);
    int left_out = 0;
    for (double t = 20; t < 60; t += 5) {
      left_out += run(link, pipe, t, t + 5, hidden);
      EXPECT_GT(link.bit_rate(), 250e3) << hidden << " at " << t;
      EXPECT_LT(link.bit_rate(), 900e3) << hidden << " at " << t;
    }
    EXPECT_LT(left_out, 40) << "of 1200 frames";
  }
}

TEST(VideoLink, NeverGoesBelowTheMinimumAndRecovers) {
  VideoLink link;
  Pipe pipe(20e3);
  const int left_out = run(link, pipe, 0, 30);
  EXPECT_EQ(link.bit_rate(), VideoLinkLimits{}.floor);
  EXPECT_GT(left_out, 500) << "the rest is left out";
  pipe.set_rate(50e6);
  run(link, pipe, 30, 90);
  EXPECT_GT(link.bit_rate(), 1e6);
}

TEST(VideoLink, RetriesAPageAfterALongSilence) {
  VideoLink link;
  link.sent(1, at(0));
  link.acknowledged(1, at(0.02));
  link.sent(2, at(0.03));
  link.look(0, at(1));
  EXPECT_TRUE(link.lags());
  link.look(0, at(3.5));
  EXPECT_FALSE(link.lags()) << "one more frame, to see";
  link.sent(3, at(3.5));
  link.look(0, at(4.5));
  EXPECT_TRUE(link.lags());
}

TEST(VideoLink, JudgesAPageWithoutAcknowledgementsByItsQueue) {
  VideoLink link;
  for (std::uint32_t i = 1; i < 100; ++i) link.sent(i, at(i * 0.03));
  link.look(0, at(4));
  EXPECT_FALSE(link.lags());
  link.look(1'000'000, at(4.1));
  EXPECT_TRUE(link.lags());
}

SensorTime stamp(double s) { return SensorTime{} + seconds(s + 1000); }

TEST(PictureAge, AcceptsAPlausibleStamp) {
  PictureAge age;
  for (int i = 0; i < 100; ++i) EXPECT_NEAR(age.add(stamp(i), stamp(i + 0.03), at(i)).seconds(), 0.03, 1e-9);
  EXPECT_NEAR(age.add(stamp(100), stamp(103), at(103)).seconds(), 3, 1e-9) << "a link that hung: no clock";
  EXPECT_EQ(age.clock_off().ns, 0);
}

TEST(PictureAge, UsesTheFastestArrivalForAnImplausibleClock) {
  for (const double off : {-5.0, 7200.0}) {
    PictureAge age;
    for (int i = 0; i < 100; ++i) {
      const double delay = i % 10 == 0 ? 0.01 : 0.05;
      EXPECT_NEAR(age.add(stamp(i), stamp(i + delay + off), at(i)).seconds(), delay - 0.01, 1e-9);
    }
    EXPECT_NEAR(age.clock_off().seconds(), off + 0.01, 1e-6);
  }
}

TEST(PictureAge, RestartsWhenStampsGoBack) {
  PictureAge age;
  age.add(stamp(500), stamp(10), at(0));
  EXPECT_NEAR(age.add(stamp(0), stamp(10), at(1)).seconds(), 0, 1e-9);
  EXPECT_NEAR(age.clock_off().seconds(), 10, 1e-6);
}

}  // namespace
}  // namespace parhelion::station
