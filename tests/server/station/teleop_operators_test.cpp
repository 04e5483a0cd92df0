// Allocation of robots: one operator per robot.
#include "tests/server/station/teleop_fixture.hpp"

namespace parhelion::station {
namespace {

TEST_F(TeleopServiceTest, AllowsOneOperatorPerRobot) {
  auto anna = open("anna"), bert = open("bert");
  drive(*anna);
  twist(*anna, 0.5);
  discard_published();
  drive(*bert);
  EXPECT_NE(bert->texts("refused").back().find("'anna'"), std::string::npos);
  twist(*bert, 0.9);
  EXPECT_EQ(published().count(channel::kTeleop), 0U);
  twist(*anna, 0.5);
  EXPECT_TRUE(moves(published()[channel::kTeleop])) << "the one that drives is not disturbed";
  send_text(*bert, R"({"type":"drive","robot":"robot_2"})");
  send_text(*bert, R"({"type":"release"})");
  twist(*bert, 0.3);
  EXPECT_TRUE(moves(published()[kAgentTeleop]));
  EXPECT_EQ(service_->driving().size(), 2U);
}

TEST_F(TeleopServiceTest, NobodyDrivesAfterTheSession) {
  auto anna = open("anna"), bert = open("bert");
  drive(*anna);
  twist(*anna, 0.5);
  discard_published();
  service_->end_session();
  EXPECT_FALSE(moves(published()[channel::kTeleop])) << "the robot is stopped";
  EXPECT_NE(anna->texts("refused").back().find("the session has ended"), std::string::npos);
  discard_published();
  drive(*anna);
  twist(*anna, 0.5);
  send_text(*bert, R"({"type":"drive","robot":"robot_2"})");
  EXPECT_NE(bert->texts("refused").back().find("the session has ended"), std::string::npos);
  twist(*bert, 0.5);
  const auto after = published();
  EXPECT_EQ(after.count(channel::kTeleop) + after.count(kAgentTeleop), 0U);
  EXPECT_TRUE(service_->driving().empty());
}

TEST_F(TeleopServiceTest, LetsAnInstructorTakeOverAfterAStop) {
  auto anna = open("anna");
  auto ines = open("ines", Role::instructor);
  drive(*anna);
  twist(*anna, 0.5);
  discard_published();
  send_text(*ines, R"({"type":"drive","robot":"trainee"})");
  EXPECT_EQ(published()[channel::kTeleop].back(), 0);
  EXPECT_NE(anna->texts("driven").back().find(R"("by":"ines")"), std::string::npos);
  twist(*anna, 0.5);
  EXPECT_EQ(published().count(channel::kTeleop), 0U);
  drive(*anna);
  EXPECT_NE(anna->texts("refused").back().find("'ines'"), std::string::npos);
}

TEST_F(TeleopServiceTest, TheNewerPageOfAnAccountDrives) {
  auto old = open("anna"), newer = open("anna");
  drive(*old);
  twist(*old, 0.5);
  discard_published();
  send_text(*newer, R"({"type":"drive","robot":"robot_2"})");
  EXPECT_FALSE(moves(published()[channel::kTeleop]));
  EXPECT_NE(old->texts("refused").back().find("another page"), std::string::npos);
  twist(*old, 0.5);
  EXPECT_EQ(published().count(channel::kTeleop), 0U);
  EXPECT_EQ(service_->driving().size(), 1U);
}

TEST_F(TeleopServiceTest, DistinguishesRobotsReleasedForSilenceFromTakenOnes) {
  auto old = open("anna"), newer = open("anna");
  drive(*old);
  send_text(*newer, R"({"type":"drive","robot":"robot_2"})");
  EXPECT_EQ(old->texts("driven").back().find("silent"), std::string::npos)
      << "a page takes control again after silence: the two pages would take it from each other forever";
  pass(2.1);
  EXPECT_NE(newer->texts("driven").back().find(R"("robot":"robot_2","silent":true)"), std::string::npos);
}

TEST_F(TeleopServiceTest, ReportsTheDriversBeforeTheRobots) {
  auto anna = open("anna");
  drive(*anna);
  auto bert = open("bert");
  ASSERT_EQ(bert->texts("").size(), 2U);
  EXPECT_NE(bert->texts("")[0].find(R"("by":"anna")"), std::string::npos);
  EXPECT_NE(bert->texts("")[1].find(R"("type":"robots")"), std::string::npos);
}

TEST_F(TeleopServiceTest, RefusesARobotThatAnotherConsoleDrives) {
  OperatorStatus status;
  status.name = "joystick_1";
  status.robot = "trainee";
  status.text = "joystick";
  service_->handle(status);
  auto client = open("anna");
  drive(*client);
  EXPECT_NE(client->texts("refused").back().find("joystick_1"), std::string::npos);
  pass(1.1);
  drive(*client);
  EXPECT_EQ(service_->driving().size(), 1U) << "silent for a second: it is lost";
}

TEST_F(TeleopServiceTest, ReleasesARobotThatIsGone) {
  auto client = open("anna");
  drive(*client, "robot_2");
  twist(*client, 0.5);
  discard_published();
  const TeleopRobot trainee = robots()[0];
  service_->set_robots({trainee});
  EXPECT_EQ(published()[kAgentTeleop].back(), 0);
  EXPECT_TRUE(service_->driving().empty());
  EXPECT_NE(client->texts("refused").back().find("'robot_2' was removed"), std::string::npos);
  twist(*client, 0.5);
  EXPECT_TRUE(published().empty());
}

TEST_F(TeleopServiceTest, ReportsWhichRobotsCannotBeDrivenAndWhy) {
  std::vector<TeleopRobot> all = robots();
  all[0].why_not = "it is a recording";
  service_->set_robots(all);
  auto client = open("anna");
  EXPECT_NE(client->texts("robots")[0].find(R"("drivable":false)"), std::string::npos);
  EXPECT_NE(client->texts("robots")[0].find(R"("why":"it is a recording")"), std::string::npos);
  drive(*client);
  EXPECT_NE(client->texts("refused").back().find("it is a recording"), std::string::npos);
  twist(*client, 0.5);
  EXPECT_TRUE(published().empty());
  drive(*client, "robot_2");
  twist(*client, 0.5);
  EXPECT_TRUE(moves(published()[kAgentTeleop])) << "the others can be";
  ASSERT_TRUE(service_->stop("trainee", "ines").ok()) << "and all can be stopped";
}

}  // namespace
}  // namespace parhelion::station
