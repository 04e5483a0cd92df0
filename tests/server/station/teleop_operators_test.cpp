// Allocation of robots: one operator per robot.
#include "tests/server/station/teleop_fixture.hpp"

namespace parhelion::station {
namespace {

TEST_F(TeleopDeskTest, LetsOneOperatorDriveARobot) {
  auto anna = open("anna"), bert = open("bert");
  drive(*anna);
  twist(*anna, 0.5);
  heard();
  drive(*bert);
  EXPECT_NE(bert->texts("refused").back().find("'anna'"), std::string::npos);
  twist(*bert, 0.9);
  EXPECT_EQ(heard().count(channel::teleop), 0U);
  twist(*anna, 0.5);
  EXPECT_TRUE(moves(heard()[channel::teleop])) << "the one that drives is not disturbed";
  say(*bert, R"({"type":"drive","robot":"robot_2"})");
  say(*bert, R"({"type":"release"})");
  twist(*bert, 0.3);
  EXPECT_TRUE(moves(heard()[agent_teleop]));
  EXPECT_EQ(desk_->driving().size(), 2U);
}

TEST_F(TeleopDeskTest, LetsAnInstructorTakeOverAfterAStop) {
  auto anna = open("anna");
  auto ines = open("ines", Role::instructor);
  drive(*anna);
  twist(*anna, 0.5);
  heard();
  say(*ines, R"({"type":"drive","robot":"trainee"})");
  EXPECT_EQ(heard()[channel::teleop].back(), 0);
  EXPECT_NE(anna->texts("driven").back().find(R"("by":"ines")"), std::string::npos);
  twist(*anna, 0.5);
  EXPECT_EQ(heard().count(channel::teleop), 0U);
  drive(*anna);
  EXPECT_NE(anna->texts("refused").back().find("'ines'"), std::string::npos);
}

TEST_F(TeleopDeskTest, DrivesFromTheNewerOfTwoPagesOfOneAccount) {
  auto old = open("anna"), newer = open("anna");
  drive(*old);
  twist(*old, 0.5);
  heard();
  say(*newer, R"({"type":"drive","robot":"robot_2"})");
  EXPECT_FALSE(moves(heard()[channel::teleop]));
  EXPECT_NE(old->texts("refused").back().find("another page"), std::string::npos);
  twist(*old, 0.5);
  EXPECT_EQ(heard().count(channel::teleop), 0U);
  EXPECT_EQ(desk_->driving().size(), 1U);
}

TEST_F(TeleopDeskTest, ToldApartIsARobotLetGoForSilenceAloneFromOneThatAnotherPageTook) {
  auto old = open("anna"), newer = open("anna");
  drive(*old);
  say(*newer, R"({"type":"drive","robot":"robot_2"})");
  EXPECT_EQ(old->texts("driven").back().find("silent"), std::string::npos) << "or both take it for ever";
  pass(2.1);
  EXPECT_NE(newer->texts("driven").back().find(R"("robot":"robot_2","silent":true)"), std::string::npos);
}

TEST_F(TeleopDeskTest, SaysWhoDrivesBeforeItSaysWhichRobotsThereAre) {
  auto anna = open("anna");
  drive(*anna);
  auto bert = open("bert");
  ASSERT_EQ(bert->texts("").size(), 2U);
  EXPECT_NE(bert->texts("")[0].find(R"("by":"anna")"), std::string::npos);
  EXPECT_NE(bert->texts("")[1].find(R"("type":"robots")"), std::string::npos);
}

TEST_F(TeleopDeskTest, RefusesARobotThatAnotherConsoleDrives) {
  OperatorWord word;
  word.name = "joystick_1";
  word.robot = "trainee";
  word.text = "joystick";
  desk_->hear(word);
  auto page = open("anna");
  drive(*page);
  EXPECT_NE(page->texts("refused").back().find("joystick_1"), std::string::npos);
  pass(1.1);
  drive(*page);
  EXPECT_EQ(desk_->driving().size(), 1U) << "silent for a second: it is lost";
}

TEST_F(TeleopDeskTest, LetsGoOfARobotThatIsGone) {
  auto page = open("anna");
  drive(*page, "robot_2");
  twist(*page, 0.5);
  heard();
  desk_->set_robots({robots()[0]});
  EXPECT_EQ(heard()[agent_teleop].back(), 0);
  EXPECT_TRUE(desk_->driving().empty());
  EXPECT_NE(page->texts("refused").back().find("'robot_2' was removed"), std::string::npos);
  twist(*page, 0.5);
  EXPECT_TRUE(heard().empty());
}

TEST_F(TeleopDeskTest, SaysWhichRobotsCannotBeDrivenAndWhy) {
  std::vector<TeleopRobot> all = robots();
  all[0].why_not = "it is a recording";
  desk_->set_robots(all);
  auto page = open("anna");
  EXPECT_NE(page->texts("robots")[0].find(R"("drivable":false)"), std::string::npos);
  EXPECT_NE(page->texts("robots")[0].find(R"("why":"it is a recording")"), std::string::npos);
  drive(*page);
  EXPECT_NE(page->texts("refused").back().find("it is a recording"), std::string::npos);
  twist(*page, 0.5);
  EXPECT_TRUE(heard().empty());
  drive(*page, "robot_2");
  twist(*page, 0.5);
  EXPECT_TRUE(moves(heard()[agent_teleop])) << "the others can be";
  ASSERT_TRUE(desk_->stop("trainee", "ines").ok()) << "and all can be stopped";
}

}  // namespace
}  // namespace parhelion::station
