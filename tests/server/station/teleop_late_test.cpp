// Late commands move nothing.
#include <deque>

#include "tests/server/station/teleop_fixture.hpp"

namespace parhelion::station {
namespace {

TEST_F(TeleopServiceTest, NeverReplaysLateCommands) {
  auto client = open("anna");
  drive(*client);
  for (int i = 0; i < 10; ++i) {
    twist(*client, 0.5);
    pass(0.05);
  }
  discard_published();
  // The link stalls for a second; messages sent meanwhile arrive together.
  const WallTime hung = now_;
  pass(1);
  EXPECT_FALSE(moves(published()[channel::kTeleop]));
  for (double ago = 1; ago > 0.26; ago -= 0.05) twist(*client, 0.5, 0, (now_ - hung).seconds() - (1 - ago));
  EXPECT_FALSE(moves(published()[channel::kTeleop]));
  twist(*client, 0.5);
  EXPECT_FALSE(moves(published()[channel::kTeleop])) << "held through the hang: must be let go first";
}

TEST_F(TeleopServiceTest, StopsOnALateCommandAmongPunctualOnes) {
  auto client = open("anna");
  drive(*client);
  twist(*client, 0.5);
  discard_published();
  twist(*client, 0.5, 0, 0.3);
  const auto speeds = published()[channel::kTeleop];
  ASSERT_FALSE(speeds.empty());
  EXPECT_FALSE(moves(speeds));
}

TEST_F(TeleopServiceTest, ToleratesADriftingPageClock) {
  auto client = open("anna");
  drive(*client);
  for (int i = 0; i < 5000; ++i) {  // 20 minutes, in which the page's clock loses 0.4 s
    twist(*client, 0.5, 0, 0.25 * i * 300e-6);
    now_ = now_ + milliseconds(250);
    service_->turn();
    const auto speeds = published()[channel::kTeleop];
    ASSERT_EQ(speeds, std::vector<double>{0.5}) << "after " << 0.25 * i << " s";
  }
}

TEST(DeadManGate, DetectsASlowLinkFromEchoes) {
  ClientClock clock;
  DeadManGate gate;
  const char* why = nullptr;
  gate.release();
  clock.handle_pong(WallTime{}, {});
  for (int i = 1; i < 200; ++i) clock.age(seconds(i - 1.2), WallTime{} + seconds(i));
  EXPECT_FALSE(gate.pass({1, seconds(200 - 1.2)}, clock, WallTime{} + seconds(200), why));
  ASSERT_NE(why, nullptr) << "all of the last minutes took as long: only the echo tells";
  gate.release();
  EXPECT_TRUE(gate.pass({2, seconds(200 - 0.9)}, clock, WallTime{} + seconds(200), why));
}

TEST_F(TeleopServiceTest, DropsOutOfOrderCommands) {
  auto client = open("anna");
  drive(*client);
  twist(*client, 0.5);
  discard_published();
  send_text(*client, R"({"type":"twist","seq":1,"at_ms":1000,"vx":0.9,"vy":0,"wz":0})");
  EXPECT_TRUE(published().empty());
}

/// A lossy link: lost packets are retransmitted after a while, and later ones wait for them, as in TCP.
class LossyLink {
 public:
  explicit LossyLink(double loss) : loss_(loss) {}
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

TEST_F(TeleopServiceTest, StopsOnALossyLinkRatherThanReplayingOldCommands) {
  for (const double loss : {0.02, 0.1}) {
    auto client = open("anna");
    drive(*client);
    LossyLink link(loss);
    struct InFlight {
      double arrives, left;
    };
    std::deque<InFlight> in_flight;
    const WallTime begun = now_;
    double moving_since_left = -1, longest = 0;
    int moved = 0, stopped = 0;
    for (int ms = 0; ms < 60'000; ms += 10) {
      const double t = ms * 1e-3;
      now_ = begun + seconds(t);
      if (ms % 50 == 0) in_flight.push_back({link.arrival(t), t});
      for (; !in_flight.empty() && in_flight.front().arrives <= t; in_flight.pop_front()) {
        twist(*client, 0.5, 0, t - in_flight.front().left);
        const std::vector<double> sent = published()[channel::kTeleop];
        for (const double speed : sent) {
          if (speed == 0) continue;
          ++moved;
          moving_since_left = t;
          EXPECT_LE(t - in_flight.front().left, 0.255) << "at " << t;
        }
      }
      service_->turn();
      const std::vector<double> stops = published()[channel::kTeleop];
      stopped += static_cast<int>(std::count(stops.begin(), stops.end(), 0.0));
      if (moving_since_left >= 0) longest = std::max(longest, t - moving_since_left);
      const auto refused = client->texts(R"("rearm":true)");
      if (!refused.empty()) {
        moving_since_left = -1;
        client->sent.clear();
        send_text(*client, R"({"type":"release"})");
      }
    }
    EXPECT_LE(longest, 0.311) << "no command is older than the silence that stops";
    EXPECT_GT(moved, 600) << "and it drives on, at a loss of " << loss;
    EXPECT_GT(stopped, 0);
    close(*client);
    discard_published();
  }
}

}  // namespace
}  // namespace parhelion::station
