// Records of trainees: storing, finding, and files that are not records.
#include <gmock/gmock.h>
#include <sys/stat.h>

#include <cmath>

#include "server/training/records_schema.hpp"
#include "tests/server/training/records_fixture.hpp"

namespace parhelion::training {
namespace {

namespace fs = std::filesystem;
using test::RecordsTest;
using testing::HasSubstr;
using testing::Not;
using Stored = Records::Stored;

TEST_F(RecordsTest, ASessionRoundTripsExactly) {
  const SessionRecord session = test::recorded_session(1);
  std::string pseudonym;
  {
    Records records = open();
    pseudonym = add(records, "Anna Schmidt").pseudonym;
    EXPECT_EQ(*records.store(pseudonym, session), Stored::added);
  }
  Records records = open(false);
  const auto sessions = records.sessions(pseudonym);
  ASSERT_TRUE(sessions.ok()) << sessions.error().message;
  ASSERT_EQ(sessions->size(), 1U);
  EXPECT_EQ(test::text_of(sessions->front()), test::text_of(session));
}

TEST_F(RecordsTest, ARepeatedSessionIsStoredOnce) {
  Records records = open();
  const std::string anna = add(records, "Anna").pseudonym;
  SessionRecord session = test::recorded_session(1);
  EXPECT_EQ(*records.store(anna, session), Stored::added);
  session.grade.score = 1;
  EXPECT_EQ(*records.store(anna, session), Stored::present);
  EXPECT_NE(records.sessions(anna)->front().grade.score, 1) << "unchanged";
  EXPECT_EQ(*records.store(anna, session, true), Stored::replaced);
  EXPECT_EQ(records.sessions(anna)->front().grade.score, 1);
  EXPECT_EQ(records.sessions(anna)->size(), 1U);
}

TEST_F(RecordsTest, RefusesASessionOfAnotherTraineeAndNamesThem) {
  Records records = open();
  const std::string anna = add(records, "Anna").pseudonym, ben = add(records, "Ben").pseudonym;
  const SessionRecord session = test::recorded_session(1);
  ASSERT_TRUE(records.store(anna, session).ok());
  for (const bool again : {false, true}) {
    const auto stored = records.store(ben, session, again);
    ASSERT_FALSE(stored.ok()) << again;
    EXPECT_THAT(stored.error().message,
                HasSubstr("belongs to another trainee: " + anna + "; was the right trainee named?"));
  }
  EXPECT_TRUE(records.sessions(ben)->empty());
  EXPECT_EQ(records.sessions(anna)->size(), 1U);
}

TEST_F(RecordsTest, OnlyGeneratedNamesArePseudonyms) {
  Records records = open();
  EXPECT_TRUE(is_pseudonym(add(records, "Anna").pseudonym));
  for (const char* other : {"", "Anna", "t-7", "t-0123456789aB", "t-0123456789abc", "x-0123456789ab"})
    EXPECT_FALSE(is_pseudonym(other)) << other;
}

TEST_F(RecordsTest, TraineesAreFoundByAnyOfTheirNames) {
  Records records = open();
  const TraineeRecord anna = add(records, "Anna");
  EXPECT_THAT(anna.pseudonym, testing::MatchesRegex("t-[0-9a-f]{12}"));
  const std::string mbox(40, 'a');
  ASSERT_TRUE(records.add({"t-7", "", mbox}).ok());
  EXPECT_EQ(records.find("Anna")->pseudonym, anna.pseudonym);
  EXPECT_EQ(records.find(anna.pseudonym)->name, "Anna");
  EXPECT_EQ(records.find(mbox)->pseudonym, "t-7");
  EXPECT_THAT(records.find("Ana").error().message, HasSubstr("did you mean 'Anna'?"));
  EXPECT_EQ(records.trainees()->size(), 2U);
}

TEST_F(RecordsTest, InvalidTraineesAreRefused) {
  Records records = open();
  const TraineeRecord anna = add(records, "Anna");
  EXPECT_THAT(records.add({"", "Anna", ""}).error().message, HasSubstr("there is a trainee 'Anna' already"));
  EXPECT_FALSE(records.add({anna.pseudonym, "Ben", ""}).ok());
  EXPECT_FALSE(records.add({"", anna.pseudonym, ""}).ok()) << "a name that is another's pseudonym";
  EXPECT_THAT(records.add({"", "Ben", "ABC"}).error().message, HasSubstr("40 hex digits"));
  EXPECT_FALSE(records.add({"", "two\nlines", ""}).ok());
  EXPECT_FALSE(records.store("t-0", test::recorded_session(1)).ok());
  EXPECT_FALSE(records.sessions("t-0").ok());
  EXPECT_FALSE(records.erase("t-0").ok());
}

TEST_F(RecordsTest, InvalidSessionsAreRefused) {
  Records records = open();
  const std::string anna = add(records, "Anna").pseudonym;
  const auto refused = [&](auto change) {
    SessionRecord session = test::recorded_session(1);
    change(session);
    const auto stored = records.store(anna, session);
    return stored ? std::string("stored") : stored.error().message;
  };
  EXPECT_THAT(refused([](auto& session) { session.identity.clear(); }), HasSubstr("no identity"));
  EXPECT_THAT(refused([](auto& session) { session.level = 4; }), HasSubstr("level"));
  EXPECT_THAT(refused([](auto& session) { std::swap(session.grade.begin, session.grade.end); }),
              HasSubstr("ends before it begins"));
  EXPECT_THAT(refused([](auto& session) { session.grade.fraction = std::nan(""); }), HasSubstr("finite"));
  EXPECT_TRUE(records.sessions(anna)->empty());
}

TEST_F(RecordsTest, TheFileIsReadableOnlyByItsOwner) {
  Records records = open();
  add(records, "Anna");
  for (const auto& entry : fs::directory_iterator(folder_)) {
    struct stat found {};
    ASSERT_EQ(stat(entry.path().c_str(), &found), 0);
    EXPECT_EQ(found.st_mode & 0077, 0U) << entry.path();
  }
}

TEST_F(RecordsTest, AClockSetBackKeepsTheOrder) {
  Records records = open();
  const std::string anna = add(records, "Anna").pseudonym;
  SessionRecord late = test::recorded_session(1), early = test::recorded_session(2);
  early.grade.begin = late.grade.begin - seconds(86400.0 * 365);
  ASSERT_TRUE(records.store(anna, late).ok());
  ASSERT_TRUE(records.store(anna, early).ok());
  const auto sessions = records.sessions(anna);
  EXPECT_EQ(sessions->at(0).identity, late.identity);
  EXPECT_EQ(sessions->at(1).grade.begin, early.grade.begin);
}

TEST_F(RecordsTest, BatchesAreAllOrNothing) {
  Records records = open();
  const Status failed = records.together([&]() -> Status {
    add(records, "Anna");
    return Error{"stop"};
  });
  EXPECT_EQ(failed.error().message, "stop");
  EXPECT_TRUE(records.trainees()->empty());
}

TEST_F(RecordsTest, AFileThatIsNoRecordsFileIsRefusedUnchanged) {
  EXPECT_THAT(Records::open(path_, false).error().message, HasSubstr("there are no records"));
  EXPECT_FALSE(fs::exists(path_));
  const std::string text(5000, 'x');
  std::ofstream(path_) << text;
  EXPECT_THAT(Records::open(path_, true).error().message, HasSubstr("is not an SQLite database"));
  EXPECT_EQ(bytes(), text);
  EXPECT_FALSE(Records::open((folder_ / "no" / "records.db").string(), true).ok());
  fs::remove(path_);
  ASSERT_TRUE(Database::open(path_, true, 0)->execute("CREATE TABLE songs(title TEXT)"));
  const std::string songs = bytes();
  EXPECT_THAT(Records::open(path_, true).error().message, HasSubstr("a database of another program"));
  EXPECT_EQ(bytes(), songs);
}

TEST_F(RecordsTest, EveryOlderSchemaBecomesTheNewest) {
  for (std::int64_t schema = 1; schema < newest_schema(); ++schema) {
    {
      auto old = Database::open(path_, true, 0);
      ASSERT_TRUE(migrate(*old, schema));
      EXPECT_EQ(**old->number("PRAGMA user_version"), schema);
      // As written by that schema's program.
      ASSERT_TRUE(old->execute(
          "INSERT INTO trainees(pseudonym, name) VALUES('t-1', 'Anna');"
          "INSERT INTO sessions(trainee, identity, scenario, programme, level, robot, log, skipped_bytes, "
          "begin_ns, "
          "end_ns) VALUES(1, 'a', 'lesson', '', 1, 'rover', 'a.lcm', 0, 5, 9);"
          "INSERT INTO scores VALUES(1, 7.5, 8, 0.5, 10, 0.75, 'B', 1, 1, 1);"
          "INSERT INTO tasks(session, position, name, required, outcome, points) VALUES(1, 0, 'in', 0, "
          "'done', 8);"
          "INSERT INTO deductions(session, position, at_ns, rule, points) VALUES(1, 0, 6, 'bump', 0.5);"));
    }
    Records records = open(false);
    const auto sessions = records.sessions(records.find("Anna")->pseudonym);
    ASSERT_TRUE(sessions.ok()) << sessions.error().message;
    EXPECT_EQ(sessions->at(0).grade.fraction, 0.75);
    EXPECT_EQ(sessions->at(0).grade.tasks.at(0).name, "in");
    EXPECT_EQ(sessions->at(0).grade.deductions.at(0).rule, "bump");
    EXPECT_EQ(*records.store("t-1", test::recorded_session(1)), Stored::added);
    for (const char* end : {"", "-wal", "-shm"}) fs::remove(path_ + end);
  }
}

TEST_F(RecordsTest, ConsequencesOfAnEventAreFoundByIndex) {
  open();
  auto database = Database::open(path_, false, 0);
  for (const std::string table : {"tasks", "deductions"}) {
    std::string plan;
    // The query that SQLite runs for each erased event.
    ASSERT_TRUE(database->each("EXPLAIN QUERY PLAN SELECT 1 FROM " + table + " WHERE cause = 1", {},
                               [&](const SqlRow& row) {
                                 plan += row.text(3);
                                 return Status();
                               }));
    EXPECT_THAT(plan, HasSubstr(table + "_by_cause"));
  }
}

TEST_F(RecordsTest, AFailedMigrationChangesNothing) {
  auto old = Database::open(path_, true, 0);
  ASSERT_TRUE(migrate(*old, 1));
  ASSERT_TRUE(old->execute("CREATE TABLE skills(mine TEXT)"));  // blocks the next migration step
  EXPECT_FALSE(Records::open(path_, false).ok());
  EXPECT_EQ(**old->number("PRAGMA user_version"), 1);
  ASSERT_TRUE(old->execute("DROP TABLE skills"));
  EXPECT_TRUE(Records::open(path_, false).ok());
}

TEST_F(RecordsTest, ANewerSchemaIsRefused) {
  open();
  ASSERT_TRUE(Database::open(path_, false, 0)->execute("PRAGMA user_version = 99"));
  const auto records = Records::open(path_, true);
  ASSERT_FALSE(records.ok());
  EXPECT_THAT(records.error().message, HasSubstr("has schema version 99"));
  EXPECT_THAT(records.error().message, HasSubstr("use the newer parhelion"));
}

TEST_F(RecordsTest, ReportsADamagedFile) {
  {
    Records records = open();
    const std::string anna = add(records, "Anna").pseudonym;
    for (int i = 0; i < 50; ++i) ASSERT_TRUE(records.store(anna, test::recorded_session(i)).ok());
  }
  {
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(4096);
    file << std::string(fs::file_size(path_) - 4096, 'x');
  }
  auto records = Records::open(path_, false);
  const std::string error_text = records ? records->trainees().error().message : records.error().message;
  EXPECT_THAT(error_text, HasSubstr("is damaged"));
}

}  // namespace
}  // namespace parhelion::training