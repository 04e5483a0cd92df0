#include "tools/stop_memory.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::tools {
namespace {

class StopMemoryTest : public testing::Test {
 protected:
  test::TemporaryFolder folder_;
  const std::filesystem::path state_ = folder_ / "state";
};

TEST_F(StopMemoryTest, AStopPersistsUntilReset) {
  StopMemory memory(state_, "udpm://a", "rover");
  EXPECT_FALSE(memory.holds());
  ASSERT_TRUE(memory.keep(true).ok());
  EXPECT_TRUE(StopMemory(state_, "udpm://a", "rover").holds());
  ASSERT_TRUE(memory.keep(true).ok()) << "twice does no harm";
  ASSERT_TRUE(memory.keep(false).ok());
  ASSERT_TRUE(memory.keep(false).ok());
  EXPECT_FALSE(StopMemory(state_, "udpm://a", "rover").holds());
}

TEST_F(StopMemoryTest, IsSeparateForEachRobotAndBus) {
  ASSERT_TRUE(StopMemory(state_, "udpm://a", "../rover").keep(true).ok());
  EXPECT_TRUE(StopMemory(state_, "udpm://a", "../rover").holds());
  EXPECT_FALSE(StopMemory(state_, "udpm://b", "../rover").holds());
  EXPECT_FALSE(StopMemory(state_, "udpm://a", "rover").holds());
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "")) EXPECT_EQ(entry.path(), state_);
}

TEST_F(StopMemoryTest, AnUnreadableMemoryCountsAsStopped) {
  std::ofstream(folder_ / "state") << "no folder";
  StopMemory memory(state_, "udpm://a", "rover");
  EXPECT_TRUE(memory.holds());
  const Status kept = memory.keep(true);
  ASSERT_FALSE(kept.ok());
  EXPECT_NE(kept.error().message.find("state"), std::string::npos);
}

}  // namespace
}  // namespace parhelion::tools
