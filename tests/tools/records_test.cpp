// `parhelion records` and `batch` in normal use.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/server/tick/graded_log.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class RecordsCommand : public testing::Test {
 protected:
  test::Ran run_command(std::vector<std::string> arguments) {
    const bool records = arguments[0] == "records";
    if (records) arguments.insert(arguments.begin() + 2, {"--database", folder_ / "records.db"});
    return test::run(arguments, folder_ / "said.txt");
  }
  std::string lesson(int number) {
    const std::string path = folder_ / ("lesson-" + std::to_string(number) + ".lcm");
    test::write_log(path, test::lesson(number, 1, true));
    return path;
  }
  test::TemporaryFolder folder_;
};

TEST_F(RecordsCommand, ATraineeIsAddedGradedListedExportedAndErased) {
  EXPECT_EQ(run_command({"records", "list"}).exit, 1) << "nothing is there yet";
  const auto added = run_command({"records", "add", "Anna Schmidt"});
  ASSERT_EQ(added.exit, 0) << added.output;
  const std::string pseudonym = added.output.substr(0, added.output.find('\n'));
  EXPECT_THAT(pseudonym, testing::MatchesRegex("t-[0-9a-f]{12}"));
  const std::string log = lesson(1);
  const auto graded = run_command({"records", "grade", "Anna Schmidt", log, lesson(2)});
  EXPECT_EQ(graded.exit, 0);
  EXPECT_THAT(graded.output, AllOf(HasSubstr(pseudonym + "  lesson: 93.00 of 100.00 points, passed; stored"),
                                   Not(HasSubstr("Anna"))));
  EXPECT_THAT(run_command({"records", "grade", pseudonym, log}).output, HasSubstr("is stored already"));
  EXPECT_THAT(run_command({"records", "grade", pseudonym, log, "--again"}).output, HasSubstr("graded again"));
  EXPECT_THAT(run_command({"records", "list"}).output,
              AllOf(HasSubstr("2 sessions"), HasSubstr("Anna Schmidt")));
  EXPECT_THAT(run_command({"records", "list", "Anna Schmidt"}).output, HasSubstr("lesson-2.lcm"));
  const std::string out = folder_ / "out.csv";
  EXPECT_EQ(run_command({"records", "export", "--format", "csv", "-o", out}).exit, 0);
  EXPECT_THAT(test::bytes_of(out),
              AllOf(HasSubstr(pseudonym), Not(HasSubstr("Anna")), Not(HasSubstr("lesson-1.lcm"))));
  EXPECT_THAT(run_command({"records", "export", "--format", "csv", "-o", out}).output,
              HasSubstr("exists already"));
  EXPECT_EQ(run_command({"records", "export", "--format", "csv", "--names", "--force", "-o", out}).exit, 0);
  EXPECT_THAT(test::bytes_of(out), AllOf(HasSubstr("Anna"), HasSubstr("lesson-1.lcm")));
  struct stat found {};
  ASSERT_EQ(stat(out.c_str(), &found), 0);
  EXPECT_EQ(found.st_mode & 0777, 0600U) << "it has names, and its owner alone reads it";
  EXPECT_THAT(run_command({"records", "erase", "Anna Schmidt"}).output, HasSubstr("confirm with --yes"));
  EXPECT_EQ(run_command({"records", "erase", "Anna Schmidt", "--yes"}).exit, 0);
  EXPECT_EQ(run_command({"records", "list", "Anna Schmidt"}).exit, 1);
  std::filesystem::remove(out);
  for (const char* file : {"records.db", "records.db-wal", "records.db-shm"})
    EXPECT_THAT(test::bytes_of(folder_ / file), Not(HasSubstr("Anna"))) << file;
}

TEST_F(RecordsCommand, ASessionOfAnotherTraineeIsRefused) {
  const std::string anna = run_command({"records", "add", "Anna"}).output.substr(0, 14);
  ASSERT_EQ(run_command({"records", "add", "Ben"}).exit, 0);
  const std::string log = lesson(1);
  ASSERT_EQ(run_command({"records", "grade", "Anna", log}).exit, 0);
  const auto refused = run_command({"records", "grade", "Ben", log});
  EXPECT_EQ(refused.exit, 1);
  EXPECT_THAT(refused.output, AllOf(HasSubstr(log), HasSubstr("belongs to another trainee: " + anna)));
}

TEST_F(RecordsCommand, ReportsOutputThatCannotBeWritten) {
  ASSERT_EQ(run_command({"records", "add", "Anna"}).exit, 0);
  const std::vector<std::string> exported{"records", "export", "--database", folder_ / "records.db",
                                          "-o",      "-"};
  EXPECT_EQ(test::run(exported, folder_ / "said.txt").exit, 0);
  EXPECT_EQ(test::Process(exported, "/dev/full").wait(), 1);
}

TEST_F(RecordsCommand, AHomePageIsAnAddress) {
  ASSERT_EQ(run_command({"records", "add", "Anna"}).exit, 0);
  const auto ran =
      run_command({"records", "export", "--format", "xapi", "--home-page", "school", "-o", folder_ / "out"});
  EXPECT_EQ(ran.exit, 2);
  EXPECT_THAT(ran.output, HasSubstr("expected as https://school.example"));
}

TEST_F(RecordsCommand, AnEmptyVariableEqualsAnUnsetOne) {
  ASSERT_EQ(setenv("PARHELION_RECORDS", "", 1), 0);
  ASSERT_EQ(setenv("XDG_DATA_HOME", (folder_ / "data").c_str(), 1), 0);
  const auto ran = test::run({"records", "add", "Anna"}, folder_ / "said.txt");
  unsetenv("PARHELION_RECORDS");
  unsetenv("XDG_DATA_HOME");
  EXPECT_EQ(ran.exit, 0) << ran.output;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "data/parhelion/records.db"));
}

TEST_F(RecordsCommand, ExportedRecordsAreImportedOnce) {
  const std::string pseudonym = run_command({"records", "add", "Anna"}).output.substr(0, 14);
  ASSERT_EQ(run_command({"records", "grade", "Anna", lesson(1)}).exit, 0);
  for (const char* format : {"json", "csv", "xapi"}) {
    const std::string out = folder_ / format;
    ASSERT_EQ(run_command({"records", "export", "--format", format, "-o", out}).exit, 0);
    const std::string other = folder_ / (std::string(format) + ".db");
    for (const char* expected :
         {"new: 1 trainee, 1 session; already there: 0 sessions", "0 sessions; already there: 1 session"}) {
      const auto ran = test::run({"records", "import", out, "--database", other}, folder_ / "said.txt");
      EXPECT_EQ(ran.exit, 0) << ran.output;
      EXPECT_THAT(ran.output, HasSubstr(expected));
    }
    const auto listed = test::run({"records", "list", pseudonym, "--database", other}, folder_ / "said.txt");
    EXPECT_THAT(listed.output, HasSubstr("93.00 of   100.00")) << format;
  }
  std::ofstream(folder_ / "bad.csv") << "trainee,marks\n";
  EXPECT_THAT(run_command({"records", "import", folder_ / "bad.csv"}).output,
              HasSubstr("bad.csv:1: there is no column 'marks'"));
}

TEST_F(RecordsCommand, NextNamesTheProgrammeAndOneReason) {
  const std::string course = std::string(PARHELION_SOURCE_DIR) + "/server/scenarios/programmes/course.yaml";
  ASSERT_EQ(run_command({"records", "add", "Anna"}).exit, 0);
  const auto next = run_command({"records", "next", "Anna", "--course", course});
  EXPECT_EQ(next.exit, 0) << next.output;
  EXPECT_THAT(next.output, AllOf(HasSubstr(" trains "), HasSubstr("should succeed with"),
                                 HasSubstr("parhelion serve "), HasSubstr(".yaml")));
  const auto json = run_command({"records", "next", "Anna", "--course", course, "--json"});
  EXPECT_THAT(json.output, AllOf(HasSubstr("\"kind\": \"task\""), HasSubstr("\"tasks_seen\": 0")));
  EXPECT_EQ(run_command({"records", "next", "Ben", "--course", course}).exit, 1);
  const std::string odd = folder_ / "\xff";  // invalid UTF-8
  std::filesystem::create_directory_symlink(std::filesystem::path(course).parent_path(), odd);
  const auto replaced = run_command({"records", "next", "Anna", "--course", odd + "/course.yaml", "--json"});
  EXPECT_EQ(replaced.exit, 0) << replaced.output;
  EXPECT_THAT(replaced.output, HasSubstr("\xEF\xBF\xBD"));
}

TEST_F(RecordsCommand, BatchWritesATableAndNamesTheBadLog) {
  lesson(1), lesson(2);
  const auto fine = run_command({"batch", folder_ / "", "--threads", "2"});
  EXPECT_EQ(fine.exit, 0) << fine.output;
  EXPECT_THAT(fine.output, AllOf(HasSubstr("lesson-2.lcm,,"), HasSubstr("2 sessions graded, 2 passed")));
  std::ofstream(folder_ / "bad.lcm") << "?";
  const std::string table = folder_ / "table.json";
  const auto ran = run_command({"batch", folder_ / "", "-o", table});
  EXPECT_EQ(ran.exit, 1);
  EXPECT_THAT(ran.output, AllOf(HasSubstr("bad.lcm"), HasSubstr("2 sessions graded, 2 passed, 1 could not")));
  EXPECT_THAT(test::bytes_of(table), HasSubstr("\"score\": 93.0"));
  EXPECT_THAT(run_command({"batch", folder_ / "", "-o", table}).output, HasSubstr("--force"));
  for (const char* shard : {"3/2", "1/-1", "+1/2", "1/", "0/1"})
    EXPECT_EQ(run_command({"batch", folder_ / "", "--shard", shard}).exit, 2) << shard;
  EXPECT_THAT(run_command({"batch", folder_ / "", "--shard", "2/3"}).output,
              AllOf(HasSubstr("lesson-1.lcm"), Not(HasSubstr("lesson-2.lcm"))));
}

}  // namespace
}  // namespace parhelion::tools
