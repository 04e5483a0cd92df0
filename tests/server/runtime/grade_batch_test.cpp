// Many sessions: the same table for any number of processes, and one bad log does not stop the rest.
#include "server/runtime/grade_batch.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "tests/server/tick/graded_log.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::runtime {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class GradeBatch : public testing::Test {
 protected:
  void SetUp() override {
    std::filesystem::create_directory(folder_ / "b");
    for (int i = 0; i < 12; ++i)
      test::write_log(folder_ / ((i % 2 == 0 ? "" : "b/") + std::to_string(i) + ".lcm"),
                      test::lesson(i, i % 4, i % 3 == 0));
  }
  test::TemporaryFolder folder_;
};

TEST_F(GradeBatch, RowsAreSortedByNameForAnyNumberOfProcesses) {
  std::ofstream(folder_ / "0bad.lcm") << "no log at all";
  std::ofstream(folder_ / "note.txt") << "not for us";
  const auto logs = session_logs({folder_ / "b", folder_ / "", folder_ / "b/1.lcm"});
  ASSERT_TRUE(logs.ok()) << logs.error().message;
  ASSERT_EQ(logs->size(), 13U) << "each once";
  EXPECT_TRUE(std::is_sorted(logs->begin(), logs->end()));
  std::size_t last = 0;
  const auto one = grade_batch(*logs, 1, [&](std::size_t done, std::size_t all) {
    EXPECT_EQ(done, ++last);
    EXPECT_EQ(all, 13U);
  });
  EXPECT_EQ(last, 13U);
  for (const unsigned at_once : {0U, 2U, 5U, 64U}) {
    const auto many = grade_batch(*logs, at_once);
    EXPECT_EQ(to_json(many), to_json(one)) << at_once;
    EXPECT_EQ(to_csv(many), to_csv(one)) << at_once;
  }
}

TEST_F(GradeBatch, ARowEqualsTheOutputOfGrade) {
  const std::string log = folder_ / "b/3.lcm";
  const auto rows = grade_batch({log}, 1);
  const auto session = grade_session(log);
  ASSERT_TRUE(session.ok()) << session.error().message;
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].error, "");
  EXPECT_EQ(rows[0].score, 100 - 3 * 7);
  EXPECT_EQ(rows[0].score, session->grade.score);
  EXPECT_EQ(rows[0].tasks_done, 2U);
  EXPECT_EQ(rows[0].deductions, 3U);
  EXPECT_TRUE(rows[0].passed);
  EXPECT_TRUE(rows[0].complete);
  EXPECT_EQ(rows[0].level, 3);
  EXPECT_EQ(rows[0].identity, session_record(log)->identity);
}

TEST_F(GradeBatch, ABadLogIsReportedAndTheOthersAreGraded) {
  std::ofstream(folder_ / "b/bad.lcm") << "no log at all";
  test::write_log(folder_ / "b/recording.lcm", test::drive(0.5));
  const auto rows = grade_batch(*session_logs({folder_ / "b"}), 2);
  ASSERT_EQ(rows.size(), 8U);
  std::size_t bad = 0;
  for (const BatchRow& row : rows) {
    if (row.error.empty()) continue;
    ++bad;
    EXPECT_THAT(row.error, HasSubstr(row.log));
  }
  EXPECT_EQ(bad, 2U);
  const auto json = nlohmann::json::parse(to_json(rows));
  EXPECT_TRUE(json[6].contains("error"));
  EXPECT_EQ(json[0]["tasks"], 2);
  // Each line of the table has the same number of fields.
  const std::string csv = to_csv(rows);
  EXPECT_EQ(std::count(csv.begin(), csv.begin() + static_cast<long>(csv.find('\r')), ','), 18);
}

/// Crashes at 3.lcm, allocates without end at 5.lcm, never ends at 7.lcm. The memory is not written to: its
/// limit is one of address space, and filling it can take longer than the processor time that the child has.
BatchRow hostile_grade(const std::string& log) {
  if (log.ends_with("3.lcm")) raise(SIGSEGV);
  std::vector<std::unique_ptr<char[]>> memory;
  while (log.ends_with("5.lcm")) memory.push_back(std::make_unique_for_overwrite<char[]>(1 << 24U));
  while (log.ends_with("7.lcm")) getpid();
  return grade_log(log);
}

TEST_F(GradeBatch, ALogWhoseGradingDiesIsReportedAndTheOthersAreGraded) {
#ifdef PARHELION_ADDRESS_SANITIZER
  GTEST_SKIP() << "memory is not limited under this sanitizer";
#endif
  const auto logs = *session_logs({folder_ / "b"});
  const GradeProcess process{std::uint64_t{1} << 28U, 1, hostile_grade};
  for (const unsigned at_once : {1U, 4U}) {
    const auto rows = grade_batch(logs, at_once, {}, process);
    ASSERT_EQ(rows.size(), 6U);
    for (const BatchRow& row : rows) {
      if (row.log.ends_with("3.lcm"))
        EXPECT_THAT(row.error, AllOf(HasSubstr("b/3.lcm: "), HasSubstr("crashed (Segmentation fault)")));
      else if (row.log.ends_with("5.lcm"))
        EXPECT_THAT(row.error, AllOf(HasSubstr("b/5.lcm: "), HasSubstr("needs more than 256 MB")));
      else if (row.log.ends_with("7.lcm"))
        EXPECT_THAT(row.error, AllOf(HasSubstr("b/7.lcm: "), HasSubstr("1 s of processor time")));
      else
        EXPECT_EQ(row.error, "") << row.log;
    }
    EXPECT_EQ(to_csv({rows[0]}), to_csv({grade_log(rows[0].log)})) << "the same row as in this process";
  }
}

TEST_F(GradeBatch, ATruncatedLogIsGradedAsTheSameSession) {
  const std::string log = folder_ / "b/3.lcm";
  const auto whole = grade_batch({log}, 1);
  std::filesystem::resize_file(log, std::filesystem::file_size(log) - 300);
  const auto cut = grade_batch({log}, 1);
  EXPECT_EQ(cut[0].error, "");
  EXPECT_EQ(cut[0].identity, whole[0].identity);
  EXPECT_NE(cut[0].identity, grade_batch({folder_ / "b/5.lcm"}, 1)[0].identity);
}

TEST_F(GradeBatch, ShardsCoverAllLogsExactlyOnce) {
  const auto logs = session_logs({folder_ / ""});
  std::vector<std::string> all;
  for (std::size_t shard = 0; shard < 5; ++shard)
    for (const std::string& log : shard_of(*logs, shard, 5)) all.push_back(log);
  std::sort(all.begin(), all.end());
  EXPECT_EQ(all, *logs);
}

TEST_F(GradeBatch, MissingFilesAreReportedBeforeWorkBegins) {
  EXPECT_THAT(session_logs({folder_ / "none"}).error().message, HasSubstr("no such file or folder"));
  std::filesystem::create_directory(folder_ / "empty");
  EXPECT_THAT(session_logs({folder_ / "empty"}).error().message, HasSubstr("no session log"));
}

}  // namespace
}  // namespace parhelion::runtime
