// One operator drives exactly one robot at a time.
#include "server/station/console/operator_console.hpp"

#include <gtest/gtest.h>

#include "protocols/channels.hpp"

namespace parhelion::station {
namespace {

SensorTime at(double s) { return SensorTime::from_utime(1'700'000'000'000'000) + seconds(s); }

class OperatorConsoleTest : public testing::Test {
 protected:
  OperatorConsoleTest() : console_bus_(hub_.connect()), server_(hub_.connect()) {
    EXPECT_TRUE(server_->subscribe(".*", 1000).ok());
    console_.set_robots({{"trainee", "TELEOP", "JOINT_CMD"}, {"robot_2", "MR_AGENT_robot_2_TELEOP", ""}});
  }
  std::vector<Message> published() {
    std::vector<Message> all;
    Message message;
    while (true) {
      const auto received = server_->receive(message, Duration{0});
      if (!received.ok() || !*received) return all;
      all.push_back(message);
    }
  }
  template <class T>
  static T read(const Message& message) {
    T item;
    EXPECT_TRUE(decode(message.channel, message.payload, item).ok());
    return item;
  }

  MemoryBusHub hub_;
  std::unique_ptr<Bus> console_bus_, server_;
  OperatorConsole console_{*console_bus_, "anna", "keyboard"};
};

TEST_F(OperatorConsoleTest, FindsTheTraineesRobotFirstAndEachRobotOnce) {
  WorldMessage world;
  const auto add = [&](const char* entity, AgentKind kind, BodyOwner owner) {
    WorldMessage::Entry body;
    body.entity = entity;
    body.kind = kind;
    body.owner = owner;
    world.bodies.push_back(body);
  };
  add("robot_2", AgentKind::robot, BodyOwner::agent);
  add("robot_2", AgentKind::robot, BodyOwner::agent);
  add("person_1", AgentKind::person, BodyOwner::agent);
  add("trainee", AgentKind::robot, BodyOwner::real_robot);
  world.robot = "trainee";
  const auto robots = robots_in(world);
  ASSERT_EQ(robots.size(), 2U);
  EXPECT_EQ(robots[0].name, "trainee");
  EXPECT_EQ(robots[0].teleop, channel::kTeleop);
  EXPECT_EQ(robots[1].teleop, "MR_AGENT_robot_2_TELEOP");
}

TEST_F(OperatorConsoleTest, FindsTheTraineesRobotWhileItsPoseIsUnknown) {
  WorldMessage world;
  world.robot = "trainee";
  const auto robots = robots_in(world);
  ASSERT_EQ(robots.size(), 1U);
  EXPECT_EQ(robots[0].name, "trainee");
  EXPECT_EQ(robots[0].teleop, channel::kTeleop);
  EXPECT_EQ(robots[0].joints, channel::kJointCmd);
}

TEST_F(OperatorConsoleTest, PublishesNothingBeforeARobotIsChosenAndNamesKnownRobots) {
  EXPECT_TRUE(console_.command({1, 0, 0}, at(0)).ok());
  EXPECT_TRUE(published().empty());
  const Status wrong = console_.drive("robto", at(0));
  ASSERT_FALSE(wrong.ok());
  EXPECT_NE(wrong.error().message.find("trainee, robot_2"), std::string::npos) << wrong.error().message;
}

TEST_F(OperatorConsoleTest, StopsOneRobotBeforeDrivingAnother) {
  ASSERT_TRUE(console_.drive("trainee", at(0)).ok());
  ASSERT_TRUE(console_.command({0.5, 0, 0.1}, at(0.1)).ok());
  auto messages = published();
  ASSERT_EQ(messages.size(), 2U);
  EXPECT_EQ(messages[0].channel, channel::kOperators);
  EXPECT_EQ(messages[1].channel, channel::kTeleop);
  ASSERT_TRUE(console_.drive_next(at(0.2)).ok());
  ASSERT_TRUE(console_.command({0.4, 0, 0}, at(0.3)).ok());
  messages = published();
  ASSERT_EQ(messages.size(), 5U);
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(messages[static_cast<std::size_t>(i)].channel, channel::kTeleop);
    EXPECT_EQ(read<TwistCommand>(messages[static_cast<std::size_t>(i)]).twist.vx, 0);
  }
  EXPECT_EQ(read<OperatorStatus>(messages[3]).robot, "robot_2");
  EXPECT_EQ(messages[4].channel, "MR_AGENT_robot_2_TELEOP");
  EXPECT_FALSE(console_.joints({"arm"}, {1}, at(0.4)).ok());
}

TEST_F(OperatorConsoleTest, SendsHeartbeatsAtStandstillAndStopsOnLossOrExit) {
  ASSERT_TRUE(console_.drive("trainee", at(0)).ok());
  int statuses = 0;
  for (int i = 1; i <= 40; ++i) ASSERT_TRUE(console_.beat(at(0.05 * i)).ok());
  for (const Message& message : published()) statuses += message.channel == channel::kOperators;
  EXPECT_GE(statuses, 5) << "in two seconds, the first included";
  EXPECT_LE(statuses, 7);
  ASSERT_TRUE(console_.lose("unplugged", at(3)).ok());
  auto messages = published();
  ASSERT_EQ(messages.size(), 4U);
  EXPECT_EQ(read<TwistCommand>(messages[0]).twist.vx, 0);
  const auto status = read<OperatorStatus>(messages[3]);
  EXPECT_EQ(status.state, OperatorStatus::State::lost);
  EXPECT_EQ(status.robot, "trainee");
  EXPECT_EQ(status.text, "unplugged");
  ASSERT_TRUE(console_.command({1, 0, 0}, at(3.1)).ok());
  EXPECT_TRUE(published().empty()) << "drives nobody any more";
  ASSERT_TRUE(console_.drive("trainee", at(4)).ok());
  ASSERT_TRUE(console_.end(at(5)).ok());
  EXPECT_EQ(read<OperatorStatus>(published().back()).state, OperatorStatus::State::ended);
}

TEST_F(OperatorConsoleTest, ReleasesARobotThatIsGone) {
  ASSERT_TRUE(console_.drive("robot_2", at(0)).ok());
  console_.set_robots({{"trainee", "TELEOP", "JOINT_CMD"}});
  EXPECT_EQ(console_.driven(), nullptr);
}

}  // namespace
}  // namespace parhelion::station
