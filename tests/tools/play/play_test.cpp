// The keys of `play`, and the messages of a recording that are published on a network with robots.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/server/runtime/play/random_session.hpp"
#include "tools/play/play_keys.hpp"
#include "tools/play/played_bus.hpp"

namespace parhelion::tools {
namespace {

class PlayKeysTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string log = folder_ / "session.lcm";
    test::write_random_session(log, 1, 5000);
    auto recording = runtime::Recording::open(log);
    ASSERT_TRUE(recording.ok());
    player_ = std::make_unique<runtime::Player>(std::move(*recording), runtime::PlayOptions{},
                                                [this](const Message&) { ++sent_; });
    keys_ = std::make_unique<PlayKeys>(*player_);
    turn();
  }
  void turn() { ASSERT_TRUE(player_->turn(now_).ok()); }
  void press(std::string_view bytes) {
    keys_->feed(bytes);
    turn();
  }
  double position() const { return player_->state().position; }

  const test::PlayFolder folder_;
  const WallTime now_{1};
  std::size_t sent_ = 0;
  std::unique_ptr<runtime::Player> player_;
  std::unique_ptr<PlayKeys> keys_;
};

TEST_F(PlayKeysTest, SpacePausesAndRightArrowStepsOneMessage) {
  press(" ");
  EXPECT_TRUE(player_->state().paused);
  const std::size_t before = sent_;
  press("\x1b[C");
  EXPECT_EQ(sent_, before + 1);
  press("\x1b[C\x1b[C");
  EXPECT_EQ(sent_, before + 3);
  press(" ");
  EXPECT_FALSE(player_->state().paused);
}

TEST_F(PlayKeysTest, ArrowsChangeSpeedAndSeek) {
  press("\x1b[A");
  EXPECT_NEAR(player_->state().rate, 1.1, 1e-12);
  press("\x1b[B\x1b[B");
  EXPECT_NEAR(player_->state().rate, 1 / 1.1, 1e-12);
  press("\x1b[C");
  EXPECT_EQ(position(), 10);
  press("\x1b[D");
  EXPECT_EQ(position(), 0);
  for (int i = 0; i < 200; ++i) press("\x1b[B");
  EXPECT_EQ(player_->state().rate, runtime::Player::kSlowest);
}

TEST_F(PlayKeysTest, BracketsJumpBetweenMarks) {
  const auto& marks = player_->recording().marks();
  ASSERT_GT(marks.size(), 2U);
  double expected = 0;
  for (int i = 0; i < 3; ++i) {
    const auto next = std::find_if(marks.begin(), marks.end(), [&](const runtime::RecordedMark& mark) {
      return mark.t > expected + 1e-6;
    });
    ASSERT_NE(next, marks.end());
    expected = next->t;
    press("]");
    EXPECT_EQ(position(), expected);
  }
  press("[");
  EXPECT_LT(position(), expected);
  press("r");
  EXPECT_EQ(position(), 0);
}

TEST_F(PlayKeysTest, OtherKeysDoNothingAndXQuits) {
  press("\x1b[5~pPk\x1b[1;5Q");
  EXPECT_EQ(position(), 0);
  EXPECT_FALSE(keys_->quit());
  press("?");
  EXPECT_TRUE(keys_->take_help());
  EXPECT_FALSE(keys_->take_help());
  press("x");
  EXPECT_TRUE(keys_->quit());
}

TEST(PlayLineTest, ReportsThePlayPosition) {
  EXPECT_EQ(play_line({true, false, 2, 65.25, 200}), "  1:05.2 of 3:20.0  x2  paused");
}

class PlayedBusTest : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(robot_->subscribe(".*", 100).ok()); }
  PlayedBus played(const std::string& prefix) {
    Scenario scenario;
    scenario.channels[channel::kMrCmd] = "DRIVE";
    auto opened = PlayedBus::open(*bus_, scenario, prefix);
    EXPECT_TRUE(opened.ok());
    return *opened;
  }
  std::set<std::string> received_channels() {
    std::set<std::string> names;
    Message message;
    for (auto came = robot_->receive(message, Duration{}); came.ok() && *came;
         came = robot_->receive(message, Duration{}))
      names.insert(message.channel);
    return names;
  }
  static void publish_all(PlayedBus& bus) {
    for (const char* name :
         {"DRIVE", "TELEOP", "MR_JOINT_CMD", "JOINT_CMD", "MR_SPAWN", "MR_EMERGENCY_STOP", "OPERATOR",
          "MR_AGENT_robot_1_TELEOP", "MR_SCAN", "MR_WORLD", "MR_AGENT_robot_1_SCAN"})
      ASSERT_TRUE(bus.publish({name, {}, {1, 2, 3}}).ok());
  }

  MemoryBusHub hub_;
  std::unique_ptr<Bus> bus_ = hub_.connect(), robot_ = hub_.connect();
};

TEST_F(PlayedBusTest, RecordedCommandsNeverReachARobot) {
  PlayedBus bare = played("");
  publish_all(bare);
  EXPECT_EQ(received_channels(), (std::set<std::string>{"MR_SCAN", "MR_WORLD", "MR_AGENT_robot_1_SCAN"}));
  EXPECT_EQ(bare.suppressed_commands(), 8U);
}

TEST_F(PlayedBusTest, WithAPrefixAllChannelsAreRenamed) {
  PlayedBus prefixed = played("PLAY_");
  publish_all(prefixed);
  const auto names = received_channels();
  EXPECT_EQ(names.size(), 11U);
  for (const std::string& name : names) EXPECT_TRUE(name.starts_with("PLAY_")) << name;
  for (const char* bad : {"a b", "ä", "this_is_far_too_long_for_a_prefix"})
    EXPECT_FALSE(PlayedBus::open(*bus_, {}, bad).ok()) << bad;
}

}  // namespace
}  // namespace parhelion::tools
