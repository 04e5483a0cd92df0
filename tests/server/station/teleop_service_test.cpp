// A page's commands reach the robot that it drives, within the robot's limits.
#include "server/station/operator_name.hpp"
#include "tests/server/station/teleop_fixture.hpp"

namespace parhelion::station {
namespace {

TEST_F(TeleopServiceTest, PublishesPageCommandsForTheDrivenRobot) {
  auto client = open("anna");
  EXPECT_EQ(client->texts(R"("type":"robots")").size(), 1U);
  EXPECT_NE(client->texts()[0].find(R"("name":"arm")"), std::string::npos);
  twist(*client, 0.5);
  EXPECT_TRUE(published().empty()) << "it drives none yet";
  drive(*client);
  twist(*client, 0.5);
  EXPECT_EQ(published()[channel::kTeleop], std::vector<double>{0.5});
  EXPECT_EQ(client->texts(R"("type":"sent")").size(), 1U);
  EXPECT_EQ(statuses_.front().robot, "trainee");
  EXPECT_EQ(statuses_.front().name, operator_name({"anna", Role::trainee}));
  EXPECT_EQ(statuses_.front().name.find("anna"), std::string::npos) << "nothing personal goes to the bus";
  EXPECT_EQ(audited_, std::vector<std::string>{"anna drives trainee"});
}

TEST_F(TeleopServiceTest, ScalesTheWholeTwistToTheRobotLimits) {
  auto client = open("anna");
  drive(*client);
  twist(*client, 4, 2);
  published();  // updates last_
  EXPECT_DOUBLE_EQ(last_.vx, 1);
  EXPECT_DOUBLE_EQ(last_.wz, 0.5);
  twist(*client, 0.1, 1e300);
  EXPECT_NE(client->texts("refused").back().find("wz"), std::string::npos);
}

TEST_F(TeleopServiceTest, MovesJointsWithinTheirSpeedLimitsAndStopsThem) {
  auto client = open("anna");
  drive(*client);
  const auto joint = [&](const char* name, double speed) {
    char text[160];
    std::snprintf(
        text, sizeof text, R"({"type":"joints","seq":%llu,"at_ms":%.3f,"names":["%s"],"velocities":[%g]})",
        static_cast<unsigned long long>(++sequence_), Duration{now_.ns}.seconds() * 1e3, name, speed);
    send_text(*client, text);
  };
  joint("arm", 3);
  EXPECT_EQ(published()[channel::kJointCmd], std::vector<double>{0.5});
  joint("leg", 1);
  EXPECT_NE(client->texts("refused").back().find("no joint 'leg'"), std::string::npos);
  pass(0.35);
  EXPECT_EQ(published()[channel::kJointCmd].back(), 0) << "silent: stopped";
  joint("arm", 0.2);
  EXPECT_FALSE(moves(published()[channel::kJointCmd]));
}

}  // namespace
}  // namespace parhelion::station
