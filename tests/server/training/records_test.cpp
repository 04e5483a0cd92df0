// Records of trainees: nothing acknowledged is lost, nothing erased is left.
#include "server/training/records.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <random>
#include <tuple>

#include "server/training/records_schema.hpp"
#include "tests/long_run.hpp"
#include "tests/server/training/recorded_session.hpp"

namespace parhelion {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;
using Stored = Records::Stored;

/// Some 100 ns a call, until the child has ended by itself.
void pass_time(unsigned calls, pid_t child) {
  for (unsigned i = 0; i < calls; ++i) {
    siginfo_t ended{};
    if (waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT) != 0 ||
        ended.si_pid != 0)
      return;
  }
}

class RecordsTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "parhelion-records-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    path_ = (folder_ / "records.db").string();
  }
  void TearDown() override { fs::remove_all(folder_); }

  Records open(bool create = true) {
    auto records = Records::open(path_, create);
    EXPECT_TRUE(records.ok()) << records.error().message;
    return std::move(*records);
  }
  TraineeRecord add(Records& records, const std::string& name) {
    auto trainee = records.add({"", name, ""});
    EXPECT_TRUE(trainee.ok()) << trainee.error().message;
    return *trainee;
  }
  /// All bytes of all files of the database.
  std::string bytes() const {
    std::string bytes;
    for (const auto& entry : fs::directory_iterator(folder_)) {
      std::ifstream file(entry.path(), std::ios::binary);
      bytes.append(std::istreambuf_iterator<char>(file), {});
    }
    return bytes;
  }

  fs::path folder_;
  std::string path_;
};

TEST_F(RecordsTest, ASessionComesBackToTheBit) {
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

TEST_F(RecordsTest, TheSameSessionTwiceIsThereAlready) {
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

TEST_F(RecordsTest, ASessionOfAnotherTraineeIsRefusedAndSaysWhose) {
  Records records = open();
  const std::string anna = add(records, "Anna").pseudonym, ben = add(records, "Ben").pseudonym;
  const SessionRecord session = test::recorded_session(1);
  ASSERT_TRUE(records.store(anna, session).ok());
  for (const bool again : {false, true}) {
    const auto stored = records.store(ben, session, again);
    ASSERT_FALSE(stored.ok()) << again;
    EXPECT_THAT(stored.error().message,
                HasSubstr("another trainee's: of " + anna + "; was the right trainee named?"));
  }
  EXPECT_TRUE(records.sessions(ben)->empty());
  EXPECT_EQ(records.sessions(anna)->size(), 1U);
}

TEST_F(RecordsTest, WhatIsDrawnIsAPseudonymAndANameIsNone) {
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

TEST_F(RecordsTest, WhatCannotBeATraineeIsRefused) {
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

TEST_F(RecordsTest, WhatCannotBeASessionIsRefused) {
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
  EXPECT_THAT(refused([](auto& session) { session.grade.share = std::nan(""); }), HasSubstr("finite"));
  EXPECT_TRUE(records.sessions(anna)->empty());
}

TEST_F(RecordsTest, TheFileIsItsOwnersAlone) {
  Records records = open();
  add(records, "Anna");
  for (const auto& entry : fs::directory_iterator(folder_)) {
    struct stat found {};
    ASSERT_EQ(stat(entry.path().c_str(), &found), 0);
    EXPECT_EQ(found.st_mode & 0077, 0U) << entry.path();
  }
}

TEST_F(RecordsTest, AClockThatWasSetBackDisordersNothing) {
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

TEST_F(RecordsTest, TogetherIsAllOrNothing) {
  Records records = open();
  const Status failed = records.together([&]() -> Status {
    add(records, "Anna");
    return Error{"stop"};
  });
  EXPECT_EQ(failed.error().message, "stop");
  EXPECT_TRUE(records.trainees()->empty());
}

// ---- erasing

TEST_F(RecordsTest, WhoIsErasedLeavesNoByteInAnyFile) {
  const std::string name = "Wilhelmina Featherstonehaugh";
  Records records = open();
  const std::string ben = add(records, "Ben").pseudonym;
  const std::string erased = add(records, name).pseudonym;
  for (int i = 0; i < 60; ++i) {
    SessionRecord session = test::recorded_session(i);
    if (i % 2 == 0) session.log = name + ".lcm";
    ASSERT_TRUE(records.store(i % 2 == 0 ? erased : ben, session).ok());
  }
  ASSERT_THAT(bytes(), HasSubstr(name));
  ASSERT_THAT(bytes(), HasSubstr(erased));
  const Status done = records.erase(erased);
  ASSERT_TRUE(done.ok()) << done.error().message;
  EXPECT_THAT(bytes(), Not(HasSubstr(name)));
  EXPECT_THAT(bytes(), Not(HasSubstr("Featherstone")));
  EXPECT_THAT(bytes(), Not(HasSubstr(erased)));
  EXPECT_FALSE(records.find(name).ok());
  EXPECT_EQ(records.sessions(ben)->size(), 30U) << "others are untouched";
}

TEST_F(RecordsTest, AnErasureThatAReaderHoldsUpIsFinishedByTheNext) {
  const std::string name = "Wilhelmina Featherstonehaugh";
  Records records = open();
  const std::string erased = add(records, name).pseudonym;
  {
    // Another program, in the middle of reading what is to be erased.
    auto reader = Database::open(path_, false, 0);
    ASSERT_TRUE(reader.ok());
    Status held;
    ASSERT_TRUE(reader->read([&] {
      EXPECT_EQ(**reader->number("SELECT count(*) FROM trainees"), 1);
      auto impatient = Records::open(path_, false, 1);
      held = impatient->erase(erased);
      return Status();
    }));
    ASSERT_FALSE(held.ok());
    EXPECT_THAT(held.error().message, HasSubstr("the files are not rewritten yet"));
    EXPECT_THAT(held.error().message, Not(HasSubstr(name)));
    EXPECT_FALSE(records.find(name).ok()) << "erased it is";
    EXPECT_THAT(bytes(), HasSubstr(name));
  }
  open(false);
  EXPECT_THAT(bytes(), Not(HasSubstr(name)));
}

TEST_F(RecordsTest, AnErasureThatIsKilledIsWholeOrNotBegun) {
  const std::string name = "Wilhelmina Featherstonehaugh";
  std::mt19937 random(5);
  int erased = 0, kept = 0, cut_off = 0;
  for (int round = 0; round < (test::long_run() ? 500 : 20); ++round) {
    std::string pseudonym;
    {
      Records records = open();
      const auto there = records.find(name);
      pseudonym = there ? there->pseudonym : add(records, name).pseudonym;
      for (int i = 0; i < 4; ++i)
        ASSERT_TRUE(records.store(pseudonym, test::recorded_session(10 * round + i)).ok());
    }
    std::array<int, 2> begun{};
    ASSERT_EQ(pipe(begun.data()), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      auto records = Records::open(path_, false);
      std::ignore = write(begun[1], "b", 1);
      _exit(records->erase(pseudonym).ok() ? 0 : 1);
    }
    char letter = 0;
    ASSERT_EQ(read(begun[0], &letter, 1), 1);
    // From at once to about as long as it takes, so that kills fall everywhere in it.
    pass_time(1U << random() % 18, child);
    kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    if (WIFSIGNALED(status)) ++cut_off;
    close(begun[0]);
    close(begun[1]);
    Records records = open(false);
    if (records.find(name)) {
      ++kept;
      EXPECT_GE(records.sessions(pseudonym)->size(), 4U);
    } else {
      ++erased;
      EXPECT_THAT(bytes(), Not(HasSubstr(name))) << round;
    }
  }
  RecordProperty("erased", erased);
  RecordProperty("kept", kept);
  RecordProperty("cut off", cut_off);
  EXPECT_GT(erased, 0);
  EXPECT_GT(cut_off, 0);
}

// ---- what happens to processes and disks

/// Stores sessions until it is killed; each one's number goes through the pipe after it was stored.
[[noreturn]] void store_forever(const std::string& path, const std::string& pseudonym, int first,
                                int acknowledge) {
  auto records = Records::open(path, false);
  if (!records) _exit(1);
  for (int number = first;; ++number) {
    if (!records->store(pseudonym, test::recorded_session(number))) _exit(2);
    if (write(acknowledge, &number, sizeof number) != sizeof number) _exit(3);
  }
}

TEST_F(RecordsTest, AKillAtAnyMomentLosesNothingAcknowledged) {
  const int kills = test::long_run() ? 1000 : 50;
  std::mt19937 random(23);
  const std::string anna = add(*std::make_unique<Records>(open()), "Anna").pseudonym;
  int acknowledged = -1;
  for (int round = 0; round < kills; ++round) {
    const int first = acknowledged + 2;  // one more than acknowledged may be there
    std::array<int, 2> ends{};
    ASSERT_EQ(pipe(ends.data()), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) store_forever(path_, anna, first, ends[1]);
    close(ends[1]);
    for (int wanted = first + static_cast<int>(random() % 8), number = -1; number < wanted;
         acknowledged = number)
      ASSERT_EQ(read(ends[0], &number, sizeof number), static_cast<ssize_t>(sizeof number));
    pass_time(random() % 5'000, child);
    kill(child, SIGKILL);
    for (int number; read(ends[0], &number, sizeof number) == sizeof number;) acknowledged = number;
    close(ends[0]);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << "it ended by itself with " << WEXITSTATUS(status);
    // As text, as most of all that is stored is in it; whole or not at all.
    Records records = open(false);
    const auto sessions = records.sessions(anna);
    ASSERT_TRUE(sessions.ok()) << sessions.error().message;
    std::size_t found = 0;
    for (const SessionRecord& session : *sessions) {
      const int number = std::stoi(session.identity);
      ASSERT_EQ(test::text_of(session), test::text_of(test::recorded_session(number))) << round;
      if (number >= first && number <= acknowledged) ++found;
    }
    ASSERT_EQ(found, static_cast<std::size_t>(acknowledged - first + 1)) << "kill " << round;
    // Kept short, so that the thousandth round takes no longer than the first.
    if (sessions->size() > 100) {
      ASSERT_TRUE(records.erase(anna).ok());
      ASSERT_TRUE(records.add({anna, "Anna", ""}).ok());
    }
  }
}

TEST_F(RecordsTest, TwoProcessesMakeAndWriteTheSameRecordsAtOnce) {
  std::array<pid_t, 2> children{};
  for (int k = 0; k < 2; ++k) {
    children[k] = fork();
    ASSERT_GE(children[k], 0);
    if (children[k] == 0) {
      auto records = Records::open(path_, true);
      if (!records) {
        std::fprintf(stderr, "%s\n", records.error().message.c_str());
        _exit(1);
      }
      const auto trainee = records->add({"t-" + std::to_string(k), "", ""});
      if (!trainee) _exit(2);
      for (int i = 0; i < 50; ++i)
        if (!records->store(trainee->pseudonym, test::recorded_session(1000 * k + i))) _exit(3);
      _exit(0);
    }
  }
  for (const pid_t child : children) {
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_EQ(WEXITSTATUS(status), 0);
  }
  Records records = open(false);
  EXPECT_EQ(records.sessions("t-0")->size(), 50U);
  EXPECT_EQ(records.sessions("t-1")->size(), 50U);
}

TEST_F(RecordsTest, WhoWaitsTooLongForAnotherIsTold) {
  Records records = open();
  const std::string anna = add(records, "Anna").pseudonym;
  auto impatient = Records::open(path_, false, 1);
  ASSERT_TRUE(impatient.ok());
  Status told;
  ASSERT_TRUE(records.together([&] {
    const auto stored = impatient->store(anna, test::recorded_session(1));
    if (!stored) told = stored.error();
    return Status();
  }));
  ASSERT_FALSE(told.ok());
  EXPECT_THAT(told.error().message, HasSubstr("another program"));
  EXPECT_EQ(*impatient->store(anna, test::recorded_session(1)), Stored::added) << "afterwards it can";
}

/// Stores until an error, then checks that all that was acknowledged is there and that it goes on with room.
void fill_up(Records& records, const std::string& pseudonym, const std::string& says,
             const std::function<void()>& make_room) {
  int stored = 0;
  std::string error;
  for (; stored < 20'000 && error.empty(); ++stored) {
    const auto done = records.store(pseudonym, test::recorded_session(stored));
    if (!done) error = done.error().message;
  }
  --stored;
  EXPECT_THAT(error, HasSubstr(says));
  EXPECT_THAT(error, HasSubstr("nothing of this was stored"));
  make_room();
  EXPECT_EQ(records.sessions(pseudonym)->size(), static_cast<std::size_t>(stored));
  EXPECT_EQ(*records.store(pseudonym, test::recorded_session(stored)), Stored::added);
  EXPECT_EQ(test::text_of(records.sessions(pseudonym)->back()),
            test::text_of(test::recorded_session(stored)));
}

TEST_F(RecordsTest, AFullDiskLosesNothingAndIsUsedAgainOnceThereIsRoom) {
  const fs::path disk = folder_ / "disk";
  fs::create_directory(disk);
  if (mount("parhelion-test", disk.c_str(), "tmpfs", 0, "size=1m") != 0)
    GTEST_SKIP() << "cannot mount a small tmpfs here (needs root)";
  std::ignore = std::system(("head -c 131072 /dev/zero > " + (disk / "ballast").string()).c_str());
  path_ = (disk / "records.db").string();
  {
    Records records = open();
    fill_up(records, add(records, "Anna").pseudonym, "the disk is full",
            [&] { fs::remove(disk / "ballast"); });
  }
  EXPECT_EQ(umount2(disk.c_str(), MNT_DETACH), 0);
}

TEST_F(RecordsTest, AFileThatMayNotGrowLosesNothing) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = signal(SIGXFSZ, SIG_IGN);
  Records records = open();
  const std::string anna = add(records, "Anna").pseudonym;
  const rlimit small{300'000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  fill_up(records, anna, "cannot be read or written",
          [&] { EXPECT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0); });
  EXPECT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  signal(SIGXFSZ, handler);
}

// ---- what is no records, and older ones

TEST_F(RecordsTest, WhatIsNoRecordsIsRefusedAndLeftAlone) {
  EXPECT_THAT(Records::open(path_, false).error().message, HasSubstr("there are no records"));
  EXPECT_FALSE(fs::exists(path_));
  const std::string text(5000, 'x');
  std::ofstream(path_) << text;
  EXPECT_THAT(Records::open(path_, true).error().message, HasSubstr("is no SQLite database"));
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
      // As that schema's program wrote it.
      ASSERT_TRUE(old->execute(
          "INSERT INTO trainees(pseudonym, name) VALUES('t-1', 'Anna');"
          "INSERT INTO sessions(trainee, identity, scenario, programme, level, robot, log, damaged_bytes, "
          "begin_ns, "
          "end_ns) VALUES(1, 'a', 'lesson', '', 1, 'rover', 'a.lcm', 0, 5, 9);"
          "INSERT INTO scores VALUES(1, 7.5, 8, 0.5, 10, 0.75, 'B', 1, 1, 1);"
          "INSERT INTO tasks(session, position, name, required, outcome, points) VALUES(1, 0, 'in', 0, "
          "'done', 8);"
          "INSERT INTO charges(session, position, at_ns, rule, points) VALUES(1, 0, 6, 'bump', 0.5);"));
    }
    Records records = open(false);
    const auto sessions = records.sessions(records.find("Anna")->pseudonym);
    ASSERT_TRUE(sessions.ok()) << sessions.error().message;
    EXPECT_EQ(sessions->at(0).grade.share, 0.75);
    EXPECT_EQ(sessions->at(0).grade.tasks.at(0).name, "in");
    EXPECT_EQ(sessions->at(0).grade.charges.at(0).rule, "bump");
    EXPECT_EQ(*records.store("t-1", test::recorded_session(1)), Stored::added);
    for (const char* end : {"", "-wal", "-shm"}) fs::remove(path_ + end);
  }
}

TEST_F(RecordsTest, WhatAnEventCausedIsFoundWithoutLookingAtAll) {
  open();
  auto database = Database::open(path_, false, 0);
  for (const std::string table : {"tasks", "charges"}) {
    std::string plan;
    // As SQLite asks it of itself for each event that is erased.
    ASSERT_TRUE(database->each("EXPLAIN QUERY PLAN SELECT 1 FROM " + table + " WHERE cause = 1", {},
                               [&](const SqlRow& row) {
                                 plan += row.text(3);
                                 return Status();
                               }));
    EXPECT_THAT(plan, HasSubstr(table + "_by_cause"));
  }
}

TEST_F(RecordsTest, AMigrationThatFailsChangesNothing) {
  auto old = Database::open(path_, true, 0);
  ASSERT_TRUE(migrate(*old, 1));
  ASSERT_TRUE(old->execute("CREATE TABLE skills(mine TEXT)"));  // stands in the way of the next step
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
  EXPECT_THAT(records.error().message, HasSubstr("is of schema 99"));
  EXPECT_THAT(records.error().message, HasSubstr("use the newer parhelion"));
}

TEST_F(RecordsTest, ADamagedFileIsSaid) {
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
  const std::string said = records ? records->trainees().error().message : records.error().message;
  EXPECT_THAT(said, HasSubstr("is damaged"));
}

}  // namespace
}  // namespace parhelion
