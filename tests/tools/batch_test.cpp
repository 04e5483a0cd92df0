// `parhelion batch` as a process: a log that needs too much memory does not end it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/server/tick/graded_log.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(Batch, ALogThatNeedsTooMuchMemoryIsReportedAndTheOthersAreGraded) {
  const test::TemporaryFolder folder;
  auto heavy = test::lesson(1, 0, true);
  heavy.push_back({"BALLAST", heavy.back().arrival, std::vector<std::uint8_t>(std::size_t{100} << 20U)});
  test::write_log(folder / "1_heavy.lcm", heavy);
  test::write_log(folder / "2_light.lcm", test::lesson(2, 1, true));
  const std::string table = folder / "table.csv";
  const auto ran = test::run({"batch", folder / "", "-o", table, "--memory", "64"}, folder / "output.txt");
  EXPECT_EQ(ran.exit, 1) << ran.output;
  EXPECT_THAT(ran.output, AllOf(HasSubstr("1_heavy.lcm: its grading needs more than 64 MB"),
                                HasSubstr("1 session graded"), HasSubstr("1 could not be graded")));
  EXPECT_THAT(test::bytes_of(table),
              AllOf(HasSubstr("1_heavy.lcm: its grading needs more than 64 MB"), HasSubstr("2_light.lcm,,")));
  const auto again = test::run({"batch", folder / "", "-o", table, "--force"}, folder / "output.txt");
  EXPECT_EQ(again.exit, 0) << again.output;
}

}  // namespace
}  // namespace parhelion::tools
