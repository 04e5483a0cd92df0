// `parhelion records` and `batch`, as a person calls them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/server/lesson_log.hpp"
#include "tests/tools/process.hpp"

namespace parhelion {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class RecordsCommand : public testing::Test {
 protected:
  test::Ran say(std::vector<std::string> arguments) {
    const bool records = arguments[0] == "records";
    if (records) arguments.insert(arguments.begin() + 2, {"--database", folder_ / "records.db"});
    return test::run(arguments, folder_ / "said.txt");
  }
  std::string lesson(int number) {
    const std::string path = folder_ / ("lesson-" + std::to_string(number) + ".lcm");
    test::write_log(path, test::lesson(number, 1, true));
    return path;
  }
  test::Folder folder_;
};

TEST_F(RecordsCommand, ATraineeIsAddedGradedListedExportedAndErased) {
  EXPECT_EQ(say({"records", "list"}).exit, 1) << "nothing is there yet";
  const auto added = say({"records", "add", "Anna Schmidt"});
  ASSERT_EQ(added.exit, 0) << added.output;
  const std::string pseudonym = added.output.substr(0, added.output.find('\n'));
  EXPECT_THAT(pseudonym, testing::MatchesRegex("t-[0-9a-f]{12}"));
  const std::string log = lesson(1);
  const auto graded = say({"records", "grade", "Anna Schmidt", log, lesson(2)});
  EXPECT_EQ(graded.exit, 0);
  EXPECT_THAT(graded.output, AllOf(HasSubstr(pseudonym + "  lesson: 93.00 of 100.00 points, passed; stored"),
                                   Not(HasSubstr("Anna"))));
  EXPECT_THAT(say({"records", "grade", pseudonym, log}).output, HasSubstr("is there already"));
  EXPECT_THAT(say({"records", "grade", pseudonym, log, "--again"}).output, HasSubstr("graded again"));
  EXPECT_THAT(say({"records", "list"}).output, AllOf(HasSubstr("2 sessions"), HasSubstr("Anna Schmidt")));
  EXPECT_THAT(say({"records", "list", "Anna Schmidt"}).output, HasSubstr("lesson-2.lcm"));
  const std::string out = folder_ / "out.csv";
  EXPECT_EQ(say({"records", "export", "--format", "csv", "-o", out}).exit, 0);
  EXPECT_THAT(test::text_of(out), AllOf(HasSubstr(pseudonym), Not(HasSubstr("Anna"))));
  EXPECT_THAT(say({"records", "export", "--format", "csv", "-o", out}).output, HasSubstr("exists already"));
  EXPECT_EQ(say({"records", "export", "--format", "csv", "--names", "--force", "-o", out}).exit, 0);
  EXPECT_THAT(test::text_of(out), HasSubstr("Anna"));
  EXPECT_THAT(say({"records", "erase", "Anna Schmidt"}).output, HasSubstr("give --yes"));
  EXPECT_EQ(say({"records", "erase", "Anna Schmidt", "--yes"}).exit, 0);
  EXPECT_EQ(say({"records", "list", "Anna Schmidt"}).exit, 1);
  std::filesystem::remove(out);
  for (const char* file : {"records.db", "records.db-wal", "records.db-shm"})
    EXPECT_THAT(test::text_of(folder_ / file), Not(HasSubstr("Anna"))) << file;
}

TEST_F(RecordsCommand, WhatIsExportedIsImportedElsewhereOnce) {
  const std::string pseudonym = say({"records", "add", "Anna"}).output.substr(0, 14);
  ASSERT_EQ(say({"records", "grade", "Anna", lesson(1)}).exit, 0);
  for (const char* format : {"json", "csv", "xapi"}) {
    const std::string out = folder_ / format;
    ASSERT_EQ(say({"records", "export", "--format", format, "-o", out}).exit, 0);
    const std::string other = folder_ / (std::string(format) + ".db");
    for (const char* said :
         {"1 trainees and 1 sessions are new", "0 sessions are new; 1 sessions were there"}) {
      const auto ran = test::run({"records", "import", out, "--database", other}, folder_ / "said.txt");
      EXPECT_EQ(ran.exit, 0) << ran.output;
      EXPECT_THAT(ran.output, HasSubstr(said));
    }
    const auto listed = test::run({"records", "list", pseudonym, "--database", other}, folder_ / "said.txt");
    EXPECT_THAT(listed.output, HasSubstr("93.00 of   100.00")) << format;
  }
  std::ofstream(folder_ / "bad.csv") << "trainee,marks\n";
  EXPECT_THAT(say({"records", "import", folder_ / "bad.csv"}).output,
              HasSubstr("bad.csv:1: there is no column 'marks'"));
}

TEST_F(RecordsCommand, NextNamesTheProgrammeAndOneReason) {
  const std::string course = std::string(PARHELION_SOURCE_DIR) + "/server/scenarios/programmes/course.yaml";
  ASSERT_EQ(say({"records", "add", "Anna"}).exit, 0);
  const auto next = say({"records", "next", "Anna", "--course", course});
  EXPECT_EQ(next.exit, 0) << next.output;
  EXPECT_THAT(next.output, AllOf(HasSubstr(" trains "), HasSubstr("should go well with"),
                                 HasSubstr("parhelion serve "), HasSubstr(".yaml")));
  const auto json = say({"records", "next", "Anna", "--course", course, "--json"});
  EXPECT_THAT(json.output, AllOf(HasSubstr("\"kind\": \"task\""), HasSubstr("\"tasks_seen\": 0")));
  EXPECT_EQ(say({"records", "next", "Ben", "--course", course}).exit, 1);
}

TEST_F(RecordsCommand, BatchWritesATableAndNamesTheBadLog) {
  lesson(1), lesson(2);
  const auto fine = say({"batch", folder_ / "", "--threads", "2"});
  EXPECT_EQ(fine.exit, 0) << fine.output;
  EXPECT_THAT(fine.output, AllOf(HasSubstr("lesson-2.lcm,,"), HasSubstr("2 sessions graded, 2 passed")));
  std::ofstream(folder_ / "bad.lcm") << "?";
  const std::string table = folder_ / "table.json";
  const auto ran = say({"batch", folder_ / "", "-o", table});
  EXPECT_EQ(ran.exit, 1);
  EXPECT_THAT(ran.output, AllOf(HasSubstr("bad.lcm"), HasSubstr("2 sessions graded, 2 passed, 1 could not")));
  EXPECT_THAT(test::text_of(table), HasSubstr("\"score\": 93.0"));
  EXPECT_THAT(say({"batch", folder_ / "", "-o", table}).output, HasSubstr("--force"));
  EXPECT_EQ(say({"batch", folder_ / "", "--shard", "3/2"}).exit, 2);
  EXPECT_THAT(say({"batch", folder_ / "", "--shard", "2/3"}).output,
              AllOf(HasSubstr("lesson-1.lcm"), Not(HasSubstr("lesson-2.lcm"))));
}

}  // namespace
}  // namespace parhelion
