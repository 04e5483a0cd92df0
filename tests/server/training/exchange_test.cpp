// Export and import of records.
#include "server/training/exchange.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "server/training/iso8601.hpp"
#include "tests/server/training/exported_group.hpp"

namespace parhelion::training {
namespace {

using nlohmann::json;
using test::group;
using test::kMbox;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::string text_of(const std::vector<TraineeHistory>& trainees) {
  std::string text;
  for (const TraineeHistory& history : trainees) {
    text +=
        history.trainee.pseudonym + '|' + history.trainee.name + '|' + history.trainee.mbox_sha1sum + '\n';
    for (const SessionRecord& session : history.sessions) text += test::text_of(session);
  }
  return text;
}

TEST(Exchange, JsonRoundTripsExactly) {
  const auto read = histories_from(to_json(group()), "a.json");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(text_of(read->trainees), text_of(group()));
}

TEST(Exchange, CsvRoundTripsAllButTasksAndDeductions) {
  auto expected = group();
  for (TraineeHistory& history : expected)
    for (SessionRecord& session : history.sessions) {
      session.grade.tasks.clear();
      session.grade.deductions.clear();
      session.skills.clear();
    }
  const std::string csv = to_csv(group());
  const auto read = histories_from(csv, "a.csv");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(text_of(read->trainees), text_of(expected));
  EXPECT_EQ(to_csv(read->trainees), csv);
}

TEST(Exchange, CsvMayHaveAnyColumnOrderAndLineEnds) {
  const auto read = histories_from_csv(
      "identity,trainee,scenario,programme,level,robot,log,skipped_bytes,begin_ns,end_ns,score,awarded,"
      "deducted,"
      "max,fraction,grade,passed,ended,complete\n"
      "s1,t-1,\"two\nlines, \"\"quoted\"\"\",,1,r,,0,5,10,1.5,2,0.5,10,0.15,,0,1,1\n\n",
      "a.csv");
  ASSERT_TRUE(read.ok()) << read.error().message;
  const SessionRecord& session = read->trainees.at(0).sessions.at(0);
  EXPECT_EQ(session.scenario, "two\nlines, \"quoted\"");
  EXPECT_EQ(session.grade.score, 1.5);
  EXPECT_TRUE(session.grade.complete);
}

TEST(Exchange, BadCsvIsRefusedWithItsLineAndColumn) {
  std::string csv = to_csv(group());
  const auto error = [](const std::string& text) {
    const auto read = histories_from_csv(text, "a.csv");
    return read ? std::string("none") : read.error().message;
  };
  EXPECT_THAT(error("trainee,scor\n"),
              HasSubstr("a.csv:1: there is no column 'scor', did you mean 'score'?"));
  EXPECT_THAT(error("trainee\n"), HasSubstr("column 'identity' is missing"));
  EXPECT_THAT(error(csv + "t-1,x\r\n"), HasSubstr("2 fields; expected 21"));
  EXPECT_THAT(error(csv + "\"t-1"), HasSubstr("a quote is not closed"));
  std::string worse = csv;
  worse.replace(worse.find("rover"), 0, "\"\r\n\",");
  EXPECT_THAT(error(worse), HasSubstr("a.csv:2: 22 fields"));
  const std::size_t passed = csv.rfind(",1,1\r\n");
  EXPECT_THAT(error(csv.replace(passed, 2, ",2")), HasSubstr("ended '2'; expected 0 or 1"));
}

TEST(Exchange, ReadsCsvFromASpreadsheet) {
  std::string csv = "\xEF\xBB\xBF" + to_csv(group());
  csv += std::string(20, ',') + "\r\n";
  const auto read = histories_from(csv, "a.csv");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(to_csv(read->trainees), to_csv(group()));
  EXPECT_TRUE(histories_from("\xEF\xBB\xBF" + to_json(group()), "a.json").ok());
  EXPECT_FALSE(histories_from("\xEF\xBB\xBF", "a").ok());
}

TEST(Exchange, ALineWithoutATraineeIsRefused) {
  const std::string csv = to_csv({{{"", "", ""}, {test::recorded_session(1)}}});
  const auto read = histories_from_csv(csv, "a.csv");
  ASSERT_FALSE(read.ok());
  EXPECT_THAT(read.error().message, HasSubstr("a.csv:2: it names no trainee"));
}

TEST(Exchange, BadJsonIsRefusedWithItsPlace) {
  const auto error = [](json changed) {
    const auto read = histories_from_json(changed.dump(), "a.json");
    return read ? std::string("none") : read.error().message;
  };
  const json good = json::parse(to_json(group()));
  ASSERT_EQ(error(good), "none");
  json bad = good;
  bad["version"] = 2;
  EXPECT_THAT(error(bad), HasSubstr("newer version"));
  bad = good;
  bad["trainees"][0]["sessions"][1]["begin_ns"] = 1.5;
  EXPECT_THAT(error(bad), AllOf(HasSubstr("/trainees/0/sessions/1/begin_ns"), HasSubstr("whole number")));
  bad = good;
  bad["trainees"][0]["sessions"][1]["tasks"][0]["outcome"] = "won";
  EXPECT_THAT(error(bad), HasSubstr("'won' is not known here"));
  bad = good;
  bad["trainees"][0]["sessions"][0].erase("fraction");
  EXPECT_THAT(error(bad), AllOf(HasSubstr("/trainees/0/sessions/0"), HasSubstr("'fraction'")));
  const auto cut = histories_from(to_json(group()).substr(0, 300), "a.json");
  EXPECT_THAT(cut.error().message, HasSubstr("a.json: parse error at line"));
  EXPECT_FALSE(histories_from(" \n", "a").ok());
}

TEST(Exchange, AStatementContainsWhatTheSpecificationRequires) {
  const json statements = json::parse(to_xapi(group(), "https://school.example"));
  ASSERT_EQ(statements.size(), 9U) << "three sessions, of each two tasks that were begun";
  const json& first = statements[0];
  EXPECT_THAT(first["id"].get<std::string>(),
              testing::MatchesRegex("[0-9a-f]{8}-[0-9a-f]{4}-5[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}"));
  EXPECT_EQ(first["actor"]["account"]["name"], "t-0123456789ab");
  EXPECT_EQ(first["actor"]["account"]["homePage"], "https://school.example");
  EXPECT_EQ(statements[6]["actor"]["mbox_sha1sum"], kMbox);
  EXPECT_FALSE(statements[6]["actor"].contains("account")) << "exactly one identifier";
  EXPECT_EQ(first["verb"]["id"], "http://adlnet.gov/expapi/verbs/failed");
  EXPECT_EQ(statements[3]["verb"]["id"], "http://adlnet.gov/expapi/verbs/passed");
  EXPECT_EQ(first["object"]["id"], "https://parhelion.invalid/scenario/first%20lesson");
  const json& score = first["result"]["score"];
  EXPECT_LE(score["min"], score["raw"]);
  EXPECT_LE(score["raw"], score["max"]);
  EXPECT_EQ(first["result"]["duration"], "PT600.100000000S");
  EXPECT_THAT(to_xapi(group(), "x"), Not(HasSubstr("Schmidt")));
}

TEST(Exchange, EachStartedTaskHasItsOwnStatement) {
  const json statements = json::parse(to_xapi(group(), "https://school.example"));
  const json &session = statements[0], &done = statements[1], &failed = statements[2];
  EXPECT_EQ(done["verb"]["id"], "http://adlnet.gov/expapi/verbs/completed");
  EXPECT_EQ(failed["verb"]["id"], "http://adlnet.gov/expapi/verbs/failed");
  EXPECT_EQ(done["object"]["id"], "https://parhelion.invalid/scenario/first%20lesson/task/task%201");
  EXPECT_EQ(done["context"]["contextActivities"]["parent"][0]["id"], session["object"]["id"]);
  EXPECT_EQ(done["result"]["score"]["raw"], 50.1);
  EXPECT_EQ(done["result"]["duration"], "PT30.000000000S");
  EXPECT_EQ(failed["result"]["success"], false);
  std::set<std::string> ids;
  for (const json& statement : statements) ids.insert(statement["id"].get<std::string>());
  EXPECT_EQ(ids.size(), statements.size());
  for (const json* each : {&done, &failed}) {
    EXPECT_EQ((*each)["actor"], session["actor"]);
    EXPECT_EQ((*each)["context"]["registration"], session["context"]["registration"]);
  }
}

TEST(Exchange, ATaskWithoutItsSessionIsOmitted) {
  json statements = json::parse(to_xapi(group(), "https://school.example"));
  statements.erase(0);
  const auto read = histories_from_xapi(statements.dump(), "a.json");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->skipped, 2U);
  ASSERT_EQ(read->trainees.size(), 2U);
  EXPECT_EQ(read->trainees[0].sessions.size(), 1U);
}

TEST(Exchange, AScoreOutsideTheSpecificationIsOmitted) {
  for (const auto& [score, fraction] :
       {std::pair(130.0, 130.0 / 120), {-5.0, 0.0}, {60.0, 1.5}, {60.0, -0.5}}) {
    auto trainees = group();
    trainees[0].sessions[0].grade.score = score;
    trainees[0].sessions[0].grade.fraction = fraction;
    const json statements = json::parse(to_xapi(trainees, "https://school.example"));
    EXPECT_FALSE(statements[0]["result"].contains("score")) << score << ' ' << fraction;
    EXPECT_TRUE(statements[3]["result"].contains("score"));
  }
}

TEST(Exchange, StatementsRoundTripToTheSameSessions) {
  auto expected = group();
  expected.pop_back();
  expected[0].trainee.name = "";
  expected[1].trainee.pseudonym = "";  // identified by the mail's hash
  for (TraineeHistory& history : expected)
    for (SessionRecord& session : history.sessions) {
      session.skipped_bytes = 0;
      session.grade.tasks.pop_back();  // not started
      session.skills.pop_back();
      for (TaskGrade& task : session.grade.tasks) task.cause.reset();
      session.grade.deductions.clear();
    }
  const auto read = histories_from(to_xapi(group(), "https://school.example"), "a.json");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(text_of(read->trainees), text_of(expected));
}

TEST(Exchange, StatementsOfOtherSystemsAreTaken) {
  const std::string statement = R"({"statements": [
    {"actor": {"account": {"homePage": "https://lms.example", "name": "a.schmidt"}},
     "verb": {"id": "http://adlnet.gov/expapi/verbs/completed"}, "object": {"id": "https://lms.example/crane"},
     "result": {"score": {"raw": 15, "min": 10, "max": 30}, "duration": "PT1M30S"},
     "timestamp": "2024-02-29T13:00:00+01:00"},
    {"actor": {"mbox_sha1sum": "cccccccccccccccccccccccccccccccccccccccc"},
     "verb": {"id": "http://adlnet.gov/expapi/verbs/passed"}, "object": {"id": "x",
     "definition": {"name": {"de": "Kran"}}}, "result": {"score": {"scaled": 0.75}},
     "timestamp": "2024-03-01T00:00:00.5Z"},
    {"actor": {"mbox_sha1sum": "cccccccccccccccccccccccccccccccccccccccc"},
     "verb": {"id": "http://adlnet.gov/expapi/verbs/launched"}, "object": {"id": "x"}}], "more": ""})";
  const auto read = histories_from(statement, "a.json");
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->skipped, 1U);
  ASSERT_EQ(read->trainees.size(), 2U);
  EXPECT_EQ(read->trainees[0].trainee.name, "a.schmidt");
  EXPECT_EQ(read->trainees[0].trainee.pseudonym, "") << "a name is no pseudonym";
  const SessionRecord& crane = read->trainees[0].sessions.at(0);
  EXPECT_EQ(crane.grade.score, 5);
  EXPECT_EQ(crane.grade.max, 20);
  EXPECT_EQ(crane.grade.fraction, 0.25);
  EXPECT_EQ(crane.grade.end.ns, 1'709'208'000'000'000'000);
  EXPECT_EQ((crane.grade.end - crane.grade.begin).seconds(), 90);
  const SessionRecord& second = read->trainees[1].sessions.at(0);
  EXPECT_TRUE(second.grade.passed);
  EXPECT_EQ(second.scenario, "Kran");
  EXPECT_EQ(second.grade.fraction, 0.75);
}

TEST(Exchange, BadStatementsAreRefusedWithTheirPlace) {
  const json good = json::parse(to_xapi(group(), "https://school.example"));
  const auto error = [](const json& changed) {
    const auto read = histories_from_xapi(changed.dump(), "a.json");
    return read ? std::string("none") : read.error().message;
  };
  json bad = good;
  bad[1]["timestamp"] = "yesterday";
  EXPECT_THAT(error(bad), AllOf(HasSubstr("/1/timestamp"), HasSubstr("expected an instant")));
  bad = good;
  bad[1]["result"]["duration"] = "P1Y";
  EXPECT_THAT(error(bad), HasSubstr("expected a duration"));
  bad = good;
  bad[0]["actor"] = {{"mbox", "mailto:anna@example.org"}};
  EXPECT_THAT(error(bad), HasSubstr("account or mbox_sha1sum"));
  bad = good;
  bad[0]["result"]["score"]["scaled"] = 7;
  EXPECT_THAT(error(bad), HasSubstr("expected -1 to 1"));
  for (const double raw : {9.0, 31.0}) {
    bad = good;
    bad[3]["result"]["score"] = {{"raw", raw}, {"min", 10}, {"max", 30}};
    EXPECT_THAT(error(bad), AllOf(HasSubstr("/3/result/score"), HasSubstr("expected raw from min to max")));
  }
  bad = good;
  bad[1]["context"]["extensions"]["https://parhelion.invalid/xapi/outcome"] = "won";
  EXPECT_THAT(error(bad), AllOf(HasSubstr("/1/context/extensions"), HasSubstr("the outcome of a task")));
}

TEST(Exchange, InstantsAndDurationsReadBack) {
  for (const std::int64_t ns : {0L, 1L, 951'782'399'999'999'999L, 1'709'208'000'000'000'000L}) {
    EXPECT_EQ(timestamp_of(timestamp_text({ns}))->ns, ns);
    EXPECT_EQ(duration_of(duration_text({ns}))->ns, ns);
  }
  EXPECT_EQ(timestamp_text({951'782'399'999'999'999}), "2000-02-28T23:59:59.999999999Z");
  EXPECT_EQ(duration_of("P1W2DT3H4M5.25S")->ns, 788'645'250'000'000);
  for (const char* bad :
       {"", "2024-02-30T00:00:00Z", "2024-01-01T00:00:00", "2024-01-01", "2024-01-01T25:00:00Z",
        "2024-01-01T00:00:00.Z", "2024-01-01T00:00:00Zx", "0000-01-01T00:00:00Z"})
    EXPECT_FALSE(timestamp_of(bad)) << bad;
  for (const char* bad : {"", "P", "PT", "P1Y", "PT1M1H", "1S", "PTS", "PT5", "P1S", "P9999999999W"})
    EXPECT_FALSE(duration_of(bad)) << bad;
}

}  // namespace
}  // namespace parhelion::training
