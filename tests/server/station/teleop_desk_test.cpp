// A page's commands reach the robot that it drives, within the robot's limits.
#include "server/station/operator_name.hpp"
#include "tests/server/station/teleop_fixture.hpp"

namespace parhelion::station {
namespace {

TEST_F(TeleopDeskTest, SendsWhatThePageAsksForTheRobotItDrives) {
  auto page = open("anna");
  EXPECT_EQ(page->texts(R"("type":"robots")").size(), 1U);
  EXPECT_NE(page->texts()[0].find(R"("name":"arm")"), std::string::npos);
  twist(*page, 0.5);
  EXPECT_TRUE(heard().empty()) << "it drives none yet";
  drive(*page);
  twist(*page, 0.5);
  EXPECT_EQ(heard()[channel::teleop], std::vector<double>{0.5});
  EXPECT_EQ(page->texts(R"("type":"sent")").size(), 1U);
  EXPECT_EQ(words_.front().robot, "trainee");
  EXPECT_EQ(words_.front().name, operator_name({"anna", Role::trainee}));
  EXPECT_EQ(words_.front().name.find("anna"), std::string::npos) << "nothing personal goes to the bus";
  EXPECT_EQ(audited_, std::vector<std::string>{"anna drives trainee"});
}

TEST_F(TeleopDeskTest, ScalesAsAWholeToWhatTheRobotMay) {
  auto page = open("anna");
  drive(*page);
  twist(*page, 4, 2);
  heard();
  EXPECT_DOUBLE_EQ(last_.vx, 1);
  EXPECT_DOUBLE_EQ(last_.wz, 0.5);
  twist(*page, 0.1, 1e300);
  EXPECT_NE(page->texts("refused").back().find("wz"), std::string::npos);
}

TEST_F(TeleopDeskTest, MovesJointsWithinTheirSpeedAndStopsThem) {
  auto page = open("anna");
  drive(*page);
  const auto joint = [&](const char* name, double speed) {
    char text[160];
    std::snprintf(
        text, sizeof text, R"({"type":"joints","seq":%llu,"at_ms":%.3f,"names":["%s"],"velocities":[%g]})",
        static_cast<unsigned long long>(++sequence_), Duration{now_.ns}.seconds() * 1e3, name, speed);
    say(*page, text);
  };
  joint("arm", 3);
  EXPECT_EQ(heard()[channel::joint_cmd], std::vector<double>{0.5});
  joint("leg", 1);
  EXPECT_NE(page->texts("refused").back().find("no joint 'leg'"), std::string::npos);
  pass(0.35);
  EXPECT_EQ(heard()[channel::joint_cmd].back(), 0) << "silent: stopped";
  joint("arm", 0.2);
  EXPECT_FALSE(moves(heard()[channel::joint_cmd]));
}

}  // namespace
}  // namespace parhelion::station
