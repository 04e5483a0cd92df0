#include "tools/progress.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace parhelion::tools {
namespace {

TEST(Progress, TerminalLineHasPercentageAndTimeLeft) {
  EXPECT_EQ(progress_line("import", 25, 100, "MB", 10, true), "import   25 %  25.0 of 100.0 MB  30 s left");
  EXPECT_EQ(progress_line("import", 10, 100, "MB", 60, true),
            "import   10 %  10.0 of 100.0 MB  9:00 min left");
}

TEST(Progress, WithoutATotalThereIsNoTimeEstimate) {
  EXPECT_EQ(progress_line("slam", 7, 0, "scans", 3, true), "slam  7.0 scans");
}

TEST(Progress, OutputThatIsNoTerminalIsJsonLines) {
  const auto line = nlohmann::json::parse(progress_line("import", 25, 100, "MB", 10, false));
  EXPECT_EQ(line.at("task"), "import");
  EXPECT_EQ(line.at("left_s"), 30);
  EXPECT_EQ(line.at("total"), 100);
}

TEST(Progress, AnInvalidUtf8NameGivesValidJson) {
  EXPECT_TRUE(nlohmann::json::accept(progress_line("\xff.lcm", 1, 2, "MB", 3, false)));
}

}  // namespace
}  // namespace parhelion::tools
