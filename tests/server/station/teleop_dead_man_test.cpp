// Fail-safe behaviour: a robot stops when the dead-man is released or its messages do not arrive.
#include "tests/server/station/teleop_fixture.hpp"

namespace parhelion::station {
namespace {

TEST_F(TeleopServiceTest, DoesNotMoveBeforeADeadManRelease) {
  auto client = open("anna");
  send_text(*client, R"({"type":"drive","robot":"trainee"})");
  discard_published();
  twist(*client, 0.5);
  EXPECT_FALSE(moves(published()[channel::kTeleop])) << "a key that was held already";
  EXPECT_NE(client->texts("refused").back().find(R"("rearm":true)"), std::string::npos);
  send_text(*client, R"({"type":"release"})");
  twist(*client, 0.5);
  EXPECT_TRUE(moves(published()[channel::kTeleop]));
}

TEST_F(TeleopServiceTest, StopsOnTimeoutAndDoesNotRestartByItself) {
  auto client = open("anna");
  drive(*client);
  twist(*client, 0.5);
  discard_published();
  pass(0.28);
  EXPECT_EQ(published().count(channel::kTeleop), 0U);
  pass(0.1);
  const auto stopped = published()[channel::kTeleop];
  ASSERT_FALSE(stopped.empty());
  EXPECT_FALSE(moves(stopped));
  EXPECT_NE(client->texts("refused").back().find("release and press again"), std::string::npos);
  twist(*client, 0.5);
  EXPECT_FALSE(moves(published()[channel::kTeleop]));
  send_text(*client, R"({"type":"release"})");
  twist(*client, 0.5);
  EXPECT_TRUE(moves(published()[channel::kTeleop]));
}

TEST_F(TeleopServiceTest, RepeatsTheStopAfterTheDeadManIsReleased) {
  auto client = open("anna");
  drive(*client);
  twist(*client, 0.5);
  discard_published();
  send_text(*client, R"({"type":"release"})");
  pass(1);
  const auto stops = published()[channel::kTeleop];
  EXPECT_GE(stops.size(), 4U);
  EXPECT_LE(stops.size(), 9U) << "and then it is silent";
  EXPECT_FALSE(moves(stops));
}

TEST_F(TeleopServiceTest, StopsWhenTheConnectionIsLost) {
  auto client = open("anna");
  drive(*client);
  twist(*client, 0.5);
  discard_published();
  close(*client);
  EXPECT_EQ(published()[channel::kTeleop].back(), 0);
  EXPECT_EQ(statuses_.back().state, OperatorStatus::State::lost);
  twist(*client, 0.5);
  EXPECT_TRUE(published().empty()) << "what comes of a closed page is nothing";
}

TEST_F(TeleopServiceTest, DisconnectsAnOpenButSilentPage) {
  auto client = open("anna");
  drive(*client);
  for (int i = 0; i < 10; ++i) {
    send_text(*client, R"({"type":"ping","at_ms":1})");
    pass(1);
  }
  EXPECT_EQ(service_->driving().size(), 1U);
  EXPECT_EQ(client->texts("pong").size(), 10U);
  pass(1.1);
  EXPECT_TRUE(service_->driving().empty());
  published();  // updates statuses_
  EXPECT_EQ(statuses_.back().state, OperatorStatus::State::lost);
}

}  // namespace
}  // namespace parhelion::station
