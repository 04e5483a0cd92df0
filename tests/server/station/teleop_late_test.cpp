// Late commands move nothing.
#include <deque>

#include "tests/server/station/teleop_fixture.hpp"

namespace parhelion::station {
namespace {

TEST_F(TeleopDeskTest, NeverReplaysWhatComesLate) {
  auto page = open("anna");
  drive(*page);
  for (int i = 0; i < 10; ++i) {
    twist(*page, 0.5);
    pass(0.05);
  }
  heard();
  // The link stalls for a second; messages sent meanwhile arrive together.
  const WallTime hung = now_;
  pass(1);
  EXPECT_FALSE(moves(heard()[channel::teleop]));
  for (double ago = 1; ago > 0.26; ago -= 0.05) twist(*page, 0.5, 0, (now_ - hung).seconds() - (1 - ago));
  EXPECT_FALSE(moves(heard()[channel::teleop]));
  twist(*page, 0.5);
  EXPECT_FALSE(moves(heard()[channel::teleop])) << "held through the hang: must be let go first";
}

TEST_F(TeleopDeskTest, StopsAtOneLateCommandAmongPunctualOnes) {
  auto page = open("anna");
  drive(*page);
  twist(*page, 0.5);
  heard();
  twist(*page, 0.5, 0, 0.3);
  const auto speeds = heard()[channel::teleop];
  ASSERT_FALSE(speeds.empty());
  EXPECT_FALSE(moves(speeds));
}

TEST_F(TeleopDeskTest, BelievesAPagesClockThatDrifts) {
  auto page = open("anna");
  drive(*page);
  for (int i = 0; i < 5000; ++i) {  // 20 minutes, in which the page's clock loses 0.4 s
    twist(*page, 0.5, 0, 0.25 * i * 300e-6);
    now_ = now_ + milliseconds(250);
    desk_->turn();
    const auto speeds = heard()[channel::teleop];
    ASSERT_EQ(speeds, std::vector<double>{0.5}) << "after " << 0.25 * i << " s";
  }
}

TEST(DeadManGate, KnowsFromEchoesThatALinkHasBecomeSlow) {
  PageClock clock;
  DeadManGate gate;
  const char* why = nullptr;
  gate.release();
  clock.heard(WallTime{}, {});
  for (int i = 1; i < 200; ++i) clock.age(seconds(i - 1.2), WallTime{} + seconds(i));
  EXPECT_FALSE(gate.pass({1, seconds(200 - 1.2)}, clock, WallTime{} + seconds(200), why));
  ASSERT_NE(why, nullptr) << "all of the last minutes took as long: only the echo tells";
  gate.release();
  EXPECT_TRUE(gate.pass({2, seconds(200 - 0.9)}, clock, WallTime{} + seconds(200), why));
}

TEST_F(TeleopDeskTest, LeavesOutWhatIsOutOfOrder) {
  auto page = open("anna");
  drive(*page);
  twist(*page, 0.5);
  heard();
  say(*page, R"({"type":"twist","seq":1,"at_ms":1000,"vx":0.9,"vy":0,"wz":0})");
  EXPECT_TRUE(heard().empty());
}

/// A lossy link: lost packets are retransmitted after a while, and later ones wait for them, as in TCP.
class LossyWay {
 public:
  explicit LossyWay(double loss) : loss_(loss) {}
  /// Arrival time of a message sent at `t` s.
  double arrival(double t) {
    double at = t + 0.002;
    for (double again = 0.2; next() < loss_; again *= 2) at += again;
    return last_ = std::max(last_, at);
  }

 private:
  double next() {
    state_ = state_ * 6364136223846793005U + 1442695040888963407U;
    return static_cast<double>(state_ >> 11) * 0x1p-53;
  }
  double loss_, last_ = 0;
  std::uint64_t state_ = 1;
};

/// A key is held for a minute, and pressed anew whenever the page is requested to.

TEST_F(TeleopDeskTest, StopsOnALossyLinkRatherThanReplayingOldCommands) {
  for (const double loss : {0.02, 0.1}) {
    auto page = open("anna");
    drive(*page);
    LossyWay way(loss);
    struct OnItsWay {
      double arrives, left;
    };
    std::deque<OnItsWay> on_their_way;
    const WallTime begun = now_;
    double moving_since_left = -1, longest = 0;
    int moved = 0, stopped = 0;
    for (int ms = 0; ms < 60'000; ms += 10) {
      const double t = ms * 1e-3;
      now_ = begun + seconds(t);
      if (ms % 50 == 0) on_their_way.push_back({way.arrival(t), t});
      for (; !on_their_way.empty() && on_their_way.front().arrives <= t; on_their_way.pop_front()) {
        twist(*page, 0.5, 0, t - on_their_way.front().left);
        const std::vector<double> sent = heard()[channel::teleop];
        for (const double speed : sent) {
          if (speed == 0) continue;
          ++moved;
          moving_since_left = t;
          EXPECT_LE(t - on_their_way.front().left, 0.255) << "at " << t;
        }
      }
      desk_->turn();
      const std::vector<double> stops = heard()[channel::teleop];
      stopped += static_cast<int>(std::count(stops.begin(), stops.end(), 0.0));
      if (moving_since_left >= 0) longest = std::max(longest, t - moving_since_left);
      const auto refused = page->texts(R"("rearm":true)");
      if (!refused.empty()) {
        moving_since_left = -1;
        page->sent.clear();
        say(*page, R"({"type":"release"})");
      }
    }
    EXPECT_LE(longest, 0.311) << "no command is older than the silence that stops";
    EXPECT_GT(moved, 600) << "and it drives on, at a loss of " << loss;
    EXPECT_GT(stopped, 0);
    close(*page);
    heard();
  }
}

}  // namespace
}  // namespace parhelion::station
