#include "tools/stop_memory.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

class StopMemoryTest : public testing::Test {
 protected:
  test::TemporaryFolder folder_;
  const std::filesystem::path state_ = folder_ / "state";
};

TEST_F(StopMemoryTest, AStopPersistsUntilReset) {
  StopMemory memory(state_, "239.255.76.67:7667", "rover");
  EXPECT_FALSE(memory.holds());
  ASSERT_TRUE(memory.keep(true).ok());
  EXPECT_TRUE(StopMemory(state_, "239.255.76.67:7667", "rover").holds());
  ASSERT_TRUE(memory.keep(true).ok()) << "twice does no harm";
  ASSERT_TRUE(memory.keep(false).ok());
  ASSERT_TRUE(memory.keep(false).ok());
  EXPECT_FALSE(StopMemory(state_, "239.255.76.67:7667", "rover").holds());
}

TEST_F(StopMemoryTest, IsSeparateForEachRobotAndBus) {
  ASSERT_TRUE(StopMemory(state_, "239.255.76.67:7667", "../rover").keep(true).ok());
  EXPECT_TRUE(StopMemory(state_, "239.255.76.67:7667", "../rover").holds());
  EXPECT_FALSE(StopMemory(state_, "239.255.76.67:7668", "../rover").holds());
  EXPECT_FALSE(StopMemory(state_, "239.255.76.67:7667", "rover").holds());
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "")) EXPECT_EQ(entry.path(), state_);
}

TEST_F(StopMemoryTest, ActiveStopsOfAllRobotsAreListed) {
  EXPECT_TRUE(active_stops(state_).empty()) << "there is no folder";
  for (const char* robot : {"rover", "dog"})
    ASSERT_TRUE(StopMemory(state_, "239.255.76.67:7667", robot).keep(true));
  ASSERT_TRUE(StopMemory(state_, "239.255.76.67:7667", "cat").keep(true));
  ASSERT_TRUE(StopMemory(state_, "239.255.76.67:7667", "cat").keep(false));
  const auto stops = active_stops(state_);
  ASSERT_EQ(stops.size(), 2U);
  EXPECT_NE(stops[0].find("'dog' on the bus 239.255.76.67:7667 is active"), std::string::npos) << stops[0];
  EXPECT_NE(stops[1].find("'rover'"), std::string::npos) << stops[1];
}

TEST_F(StopMemoryTest, AnUnreadableMemoryCountsAsStopped) {
  std::ofstream(folder_ / "state") << "no folder";
  StopMemory memory(state_, "239.255.76.67:7667", "rover");
  EXPECT_TRUE(memory.holds());
  const Status kept = memory.keep(true);
  ASSERT_FALSE(kept.ok());
  EXPECT_NE(kept.error().message.find("state"), std::string::npos);
}

// Others could remove the stop, or plant a link in its place.
TEST_F(StopMemoryTest, AServerWhoseStateFolderOthersCanChangeDoesNotStart) {
  std::filesystem::create_directories(state_);
  std::filesystem::permissions(state_, std::filesystem::perms::all);
  std::ofstream(folder_ / "robot.yaml") << to_yaml(test::robot());
  std::ofstream(folder_ / "scenario.yaml") << "name: open\nlevel: 3\nrobot: robot.yaml\n";
  const auto ran = test::run({"serve", folder_ / "scenario.yaml", "-o", folder_ / "session.lcm", "--url",
                              test::bus_url(), "--no-restart", "--state-folder", state_},
                             folder_ / "serve.txt");
  EXPECT_EQ(ran.exit, 1);
  EXPECT_NE(ran.output.find("other users may change what is in this folder; run: chmod 700"),
            std::string::npos)
      << ran.output;
}

}  // namespace
}  // namespace parhelion::tools
