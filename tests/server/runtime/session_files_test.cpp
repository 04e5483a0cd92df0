#include "server/runtime/session_files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/allocations.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::runtime {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

class SessionFilesTest : public testing::Test {
 protected:
  std::string write(const std::string& text) const {
    std::ofstream(folder_ / "lab.yaml") << text;
    return folder_ / "lab.yaml";
  }
  static std::string many(const char* head, int count, const std::string& item) {
    std::string text = head;
    for (int i = 0; i < count; ++i) text += "  - {name: a" + std::to_string(i) + item;
    return text;
  }
  std::string error_of(const std::string& text) const {
    const auto files = load_session_files(write(text), "");
    return files ? "" : files.error().message;
  }
  std::size_t allocations_of(const std::string& text) const {
    const std::string path = write(text);
    const test::AllocationWatch watch;
    const auto files = load_session_files(path, "");
    EXPECT_TRUE(files.ok()) << files.error().message;
    return watch.count();
  }
  const test::TemporaryFolder folder_;
};

/// The file is not read again for each agent, task or penalty: twice as many cost twice as much.
TEST_F(SessionFilesTest, CostGrowsAsTheFile) {
  const auto agents = [](int count) {
    return many("name: x\nlevel: 3\nagents:\n", count, ", kind: box, pose: {x: 1 m}}\n");
  };
  EXPECT_LT(allocations_of(agents(400)), 3 * allocations_of(agents(200)));
  const auto tasks = [](int count) {
    const std::string head = "name: x\nlevel: 3\ntraining:\n  tasks:\n";
    return many(head.c_str(), count, ", points: 1, limit: 10 s, done: {still: 3 s}}\n");
  };
  EXPECT_LT(allocations_of(tasks(60)), 3 * allocations_of(tasks(30)));
}

TEST_F(SessionFilesTest, NamesTheLineOfTheAgentWhoseRobotModelIsMissing) {
  EXPECT_THAT(error_of("name: x\nlevel: 3\nagents:\n"
                       "  - {name: a, kind: box, pose: {x: 1 m}}\n"
                       "  - {name: b, kind: robot, model: rovr, pose: {x: 3 m}}\n"),
              StartsWith(folder_ / "lab.yaml:5: "));
}

TEST_F(SessionFilesTest, NamesTheMapThatIsNoText) {
  std::ofstream(folder_ / "noise.yaml", std::ios::binary) << std::string("a\0\xff", 3);
  EXPECT_THAT(error_of("name: x\nlevel: 3\nmap: noise.yaml\n"),
              HasSubstr(folder_ / "noise.yaml: a binary file, expected a YAML file"));
}

}  // namespace
}  // namespace parhelion::runtime
