// A session log that is deleted, moved or replaced while the server writes it.
#include <filesystem>
#include <fstream>

#include "server/runtime/log_watch.hpp"
#include "tests/server/runtime/loop_fixture.hpp"

namespace parhelion::runtime {
namespace {

namespace fs = std::filesystem;

class LostLog : public test::LoopTest {
 protected:
  void SetUp() override {
    serve_in_background(test::configuration({}));
    ASSERT_FALSE(await(channel::kMrWorld, 1).empty());
  }
  /// Time until MR_STATUS says that the session is incomplete; its reason is in why_.
  Duration await_incomplete() {
    const WallTime from = steady_now();
    while (why_.empty() && steady_now() - from < seconds(20)) {
      ServerStatus status;
      for (const Message& message : await(channel::kMrStatus, 1)) {
        EXPECT_TRUE(decode(message.channel, message.payload, status).ok());
      }
      for (const auto& [name, note] : status.notes) {
        if (name == "session_log") why_ = note;
      }
    }
    return steady_now() - from;
  }
  void expect_incomplete(const std::string& because) {
    EXPECT_LT(await_incomplete(), seconds(1.0));
    EXPECT_NE(why_.find(folder_ / "session.lcm"), std::string::npos) << why_;
    EXPECT_NE(why_.find(because), std::string::npos) << why_;
    stop();
    ASSERT_TRUE(report_->ok()) << report_->error().message;
    EXPECT_FALSE((*report_)->complete);
    EXPECT_EQ((*report_)->incomplete_because, why_);
    EXPECT_NE(notices_.back().find(why_), std::string::npos) << notices_.back();
  }

  std::string why_;
};

TEST_F(LostLog, IsReportedWithinASecondWhenItIsDeleted) {
  fs::remove(folder_ / "session.lcm");
  expect_incomplete("deleted or moved");
}

TEST_F(LostLog, IsReportedWhenAnotherFileReplacesIt) {
  std::ofstream(folder_ / "other.lcm") << "another session";
  fs::rename(folder_ / "other.lcm", folder_ / "session.lcm");
  expect_incomplete("replaced by another file");
}

TEST_F(LostLog, IsReportedEvenIfTheServerIsStoppedAtOnce) {
  fs::remove(folder_ / "session.lcm");
  stop();
  ASSERT_TRUE(report_->ok()) << report_->error().message;
  EXPECT_FALSE((*report_)->complete);
}

TEST_F(LostLog, AcknowledgesNoCommandAnyMore) {
  fs::remove(folder_ / "session.lcm");
  await_incomplete();
  AgentSpawn command{.stamp = {wall_now().ns}, .request = 7};
  command.agent = test::agent("box_1", AgentKind::box, 1, 1);
  const Message spawn = test::message(channel::kMrSpawn, 0, command);
  ASSERT_TRUE(robot_->publish(spawn.channel, spawn.payload).ok());
  Event event;
  while (event.request != 7) {
    const auto events = await(channel::kMrEvents, 1);
    ASSERT_FALSE(events.empty());
    ASSERT_TRUE(decode(events[0].channel, events[0].payload, event).ok());
  }
  EXPECT_EQ(event.kind, EventKind::command_refused);
  EXPECT_NE(event.text.find("deleted or moved"), std::string::npos) << event.text;
}

TEST(LogWatch, FindsNothingWrongWithAFileThatGrows) {
  const test::TemporaryFolder folder;
  std::ofstream file(folder / "log");
  const LogWatch watch(folder / "log");
  file << "more" << std::flush;
  EXPECT_TRUE(watch.check());
  EXPECT_TRUE(LogWatch("").check()) << "no log at all";
  EXPECT_FALSE(LogWatch(folder / "missing").check());
}

}  // namespace
}  // namespace parhelion::runtime
