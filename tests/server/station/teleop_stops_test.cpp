// An emergency stop is active until it is released.
#include "tests/server/station/teleop_fixture.hpp"

namespace parhelion::station {
namespace {

TEST_F(TeleopServiceTest, HoldsAnEmergencyStopUntilItIsReset) {
  auto anna = open("anna"), bert = open("bert");
  drive(*anna);
  twist(*anna, 0.5);
  discard_published();
  send_text(*bert, R"({"type":"stop"})");
  auto out = published();
  EXPECT_EQ(out[channel::kTeleop].back(), 0) << "all, as he drives none";
  EXPECT_EQ(out[kAgentTeleop].back(), 0);
  ASSERT_EQ(stops_.size(), 2U);
  EXPECT_EQ(stops_[0].by, "bert");
  EXPECT_NE(anna->texts("estop").back().find(R"("on":true)"), std::string::npos);
  send_text(*anna, R"({"type":"release"})");
  twist(*anna, 0.5);
  pass(1);
  out = published();
  EXPECT_GE(out[channel::kTeleop].size(), 9U) << "said again and again";
  EXPECT_FALSE(moves(out[channel::kTeleop]));
  EXPECT_GE(orders_.size(), 18U) << "the server is told until it answers";
  for (const EmergencyStopCommand& order : orders_) {
    EXPECT_TRUE(order.engaged);
    Event answer;
    answer.kind = EventKind::command_accepted;
    answer.request = order.request;
    service_->handle(answer);
  }
  pass(0.5);
  out = published();
  EXPECT_EQ(out.count(channel::kTeleop), 0U) << "the server holds it now";
  EXPECT_TRUE(service_->stop("", "ines").ok()) << "twice does no harm";
  EXPECT_EQ(service_->stops()[0].by, "bert");
  EXPECT_FALSE(service_->release_stop("robot_7", "ines").ok());
  ASSERT_TRUE(service_->release_stop("trainee", "ines").ok());
  published();  // updates orders_
  EXPECT_FALSE(orders_.back().engaged);
  EXPECT_EQ(orders_.back().robot, "trainee");
  pass(5);
  published();  // updates orders_
  EXPECT_FALSE(orders_.back().engaged) << "and robot_2 stays stopped";
  send_text(*anna, R"({"type":"drive","robot":"trainee"})");
  twist(*anna, 0.5);
  EXPECT_FALSE(moves(published()[channel::kTeleop])) << "a key that was held all the while";
  send_text(*anna, R"({"type":"release"})");
  twist(*anna, 0.5);
  EXPECT_TRUE(moves(published()[channel::kTeleop]));
  EXPECT_EQ(stops_.size(), 1U);
  EXPECT_NE(std::find(audited_.begin(), audited_.end(), "ines releases the emergency stop of trainee"),
            audited_.end());
}

/// The robot is still stopped, and everybody must see that.
TEST_F(TeleopServiceTest, ShowsTheStopAgainWhoseReleaseTheServerRefuses) {
  auto anna = open("anna");
  ASSERT_TRUE(service_->stop("trainee", "anna").ok());
  ASSERT_TRUE(service_->release_stop("trainee", "ines").ok());
  published();  // updates orders_
  Event reply;
  reply.request = orders_.back().request;
  ASSERT_FALSE(orders_.back().engaged);
  EXPECT_TRUE(service_->stops().empty());
  reply.kind = EventKind::command_refused;
  service_->handle(reply);
  ASSERT_EQ(service_->stops().size(), 1U);
  EXPECT_EQ(service_->stops()[0].by, "anna");
  EXPECT_NE(anna->texts("estop").back().find(R"("on":true)"), std::string::npos);
  published();
  EXPECT_TRUE(orders_.back().engaged)
      << "the server is told, whatever it does with a later copy of the release";
  EXPECT_NE(orders_.back().request, reply.request);
  const std::size_t reported = anna->texts("estop").size();
  for (const EventKind kind : {EventKind::command_refused, EventKind::command_accepted}) {
    reply.kind = kind;  // of copies
    service_->handle(reply);
    EXPECT_EQ(service_->stops().size(), 1U);
  }
  EXPECT_EQ(anna->texts("estop").size(), reported) << "refused several times, shown once";
  ASSERT_TRUE(service_->stop("trainee", "bert").ok());
  published();
  EXPECT_TRUE(orders_.back().engaged) << "pressed once more: never a release";
}

TEST_F(TeleopServiceTest, KeepsANewStopWhateverTheReplyToAnEarlierRelease) {
  ASSERT_TRUE(service_->stop("trainee", "anna").ok());
  ASSERT_TRUE(service_->release_stop("trainee", "ines").ok());
  published();  // updates orders_
  Event reply;
  reply.request = orders_.back().request;
  ASSERT_TRUE(service_->stop("trainee", "bert").ok());
  for (const EventKind kind : {EventKind::command_refused, EventKind::command_accepted}) {
    reply.kind = kind;
    service_->handle(reply);
    ASSERT_EQ(service_->stops().size(), 1U);
    EXPECT_EQ(service_->stops()[0].by, "bert");
  }
}

TEST_F(TeleopServiceTest, ReleasesOnlyTheStopsThatOneselfHasPressed) {
  EXPECT_FALSE(service_->release_own_stop("", "anna").ok()) << "none is active";
  ASSERT_TRUE(service_->stop("trainee", "anna").ok());
  EXPECT_FALSE(service_->release_own_stop("trainee", "bert").ok());
  EXPECT_EQ(service_->stops().size(), 1U);
  EXPECT_TRUE(service_->release_own_stop("trainee", "anna").ok());
  EXPECT_TRUE(service_->stops().empty());
  ASSERT_TRUE(service_->stop("", "ines").ok());
  const std::size_t stopped = service_->stops().size();
  EXPECT_FALSE(service_->release_own_stop("", "anna").ok());
  EXPECT_EQ(service_->stops().size(), stopped) << "nothing is released";
}

TEST_F(TeleopServiceTest, KeepsTheEmergencyStopOfAReturningRobot) {
  ASSERT_TRUE(service_->stop("trainee", "anna").ok());
  service_->set_robots({robots()[1]});
  service_->set_robots(robots());
  auto client = open("anna");
  EXPECT_EQ(client->texts("estop").size(), 1U);
  drive(*client);
  twist(*client, 0.5);
  EXPECT_FALSE(moves(published()[channel::kTeleop]));
  EXPECT_FALSE(service_->stop("robot_9", "anna").ok());
}

}  // namespace
}  // namespace parhelion::station
