// An emergency stop is active until it is reset.
#include "tests/server/station/teleop_fixture.hpp"

namespace parhelion::station {
namespace {

TEST_F(TeleopDeskTest, HoldsAnEmergencyStopUntilItIsReset) {
  auto anna = open("anna"), bert = open("bert");
  drive(*anna);
  twist(*anna, 0.5);
  heard();
  say(*bert, R"({"type":"stop"})");
  auto out = heard();
  EXPECT_EQ(out[channel::teleop].back(), 0) << "all, as he drives none";
  EXPECT_EQ(out[agent_teleop].back(), 0);
  ASSERT_EQ(stops_.size(), 2U);
  EXPECT_EQ(stops_[0].by, "bert");
  EXPECT_NE(anna->texts("estop").back().find(R"("on":true)"), std::string::npos);
  say(*anna, R"({"type":"release"})");
  twist(*anna, 0.5);
  pass(1);
  out = heard();
  EXPECT_GE(out[channel::teleop].size(), 9U) << "said again and again";
  EXPECT_FALSE(moves(out[channel::teleop]));
  EXPECT_GE(orders_.size(), 18U) << "the server is told until it answers";
  for (const EmergencyStopCommand& order : orders_) {
    EXPECT_TRUE(order.engaged);
    Event answer;
    answer.kind = EventKind::command_accepted;
    answer.request = order.request;
    desk_->hear(answer);
  }
  pass(0.5);
  out = heard();
  EXPECT_EQ(out.count(channel::teleop), 0U) << "the server holds it now";
  EXPECT_TRUE(desk_->stop("", "ines").ok()) << "twice does no harm";
  EXPECT_EQ(desk_->stops()[0].by, "bert");
  EXPECT_FALSE(desk_->reset("robot_7", "ines").ok());
  ASSERT_TRUE(desk_->reset("trainee", "ines").ok());
  heard();
  EXPECT_FALSE(orders_.back().engaged);
  EXPECT_EQ(orders_.back().robot, "trainee");
  pass(5);
  heard();
  EXPECT_FALSE(orders_.back().engaged) << "and robot_2 stays stopped";
  say(*anna, R"({"type":"drive","robot":"trainee"})");
  twist(*anna, 0.5);
  EXPECT_FALSE(moves(heard()[channel::teleop])) << "a key that was held all the while";
  say(*anna, R"({"type":"release"})");
  twist(*anna, 0.5);
  EXPECT_TRUE(moves(heard()[channel::teleop]));
  EXPECT_EQ(stops_.size(), 1U);
  EXPECT_NE(std::find(audited_.begin(), audited_.end(), "ines resets the emergency stop of trainee"),
            audited_.end());
}

TEST_F(TeleopDeskTest, KeepsAnEmergencyStopOfARobotThatWentAndCameBack) {
  ASSERT_TRUE(desk_->stop("trainee", "anna").ok());
  desk_->set_robots({robots()[1]});
  desk_->set_robots(robots());
  auto page = open("anna");
  EXPECT_EQ(page->texts("estop").size(), 1U);
  drive(*page);
  twist(*page, 0.5);
  EXPECT_FALSE(moves(heard()[channel::teleop]));
  EXPECT_FALSE(desk_->stop("robot_9", "anna").ok());
}

}  // namespace
}  // namespace parhelion::station
