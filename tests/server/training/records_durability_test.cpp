// Records of trainees: acknowledged data is never lost, erased data is never left.
#include <gmock/gmock.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <random>
#include <tuple>

#include "server/training/records_schema.hpp"
#include "tests/long_run.hpp"
#include "tests/server/training/records_fixture.hpp"

namespace parhelion::training {
namespace {

namespace fs = std::filesystem;
using test::RecordsTest;
using testing::HasSubstr;
using testing::Not;
using StoredAs = Records::Stored;

/// About 100 ns per call, until the child has ended.
void pass_time(unsigned calls, pid_t child) {
  for (unsigned i = 0; i < calls; ++i) {
    siginfo_t ended{};
    if (waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT) != 0 ||
        ended.si_pid != 0)
      return;
  }
}

TEST_F(RecordsTest, AnErasedTraineeLeavesNoByteInAnyFile) {
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

TEST_F(RecordsTest, AnErasureBlockedByAReaderIsCompletedLater) {
  const std::string name = "Wilhelmina Featherstonehaugh";
  Records records = open();
  const std::string erased = add(records, name).pseudonym;
  {
    // Another program is reading the data to be erased.
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

TEST_F(RecordsTest, AKilledErasureIsCompleteOrNotStarted) {
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
    // From zero to about the duration of the operation, so that kills hit every part of it.
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

/// Stores sessions until it is killed; writes each session's number to the pipe after it was stored.
[[noreturn]] void store_forever(const std::string& path, const std::string& pseudonym, int first,
                                int acknowledge) {
  auto records = Records::open(path, false);
  if (!records) _exit(1);
  for (int number = first;; ++number) {
    if (!records->store(pseudonym, test::recorded_session(number))) _exit(2);
    if (write(acknowledge, &number, sizeof number) != sizeof number) _exit(3);
  }
}

TEST_F(RecordsTest, AKillAtAnyMomentLosesNoAcknowledgedData) {
  const int kills = test::long_run() ? 1000 : 50;
  std::mt19937 random(23);
  const std::string anna = add(*std::make_unique<Records>(open()), "Anna").pseudonym;
  int acknowledged = -1;
  for (int round = 0; round < kills; ++round) {
    const int first = acknowledged + 2;  // one more than acknowledged may be stored
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
    // Compared as text, which covers most fields; a session is complete or absent.
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
    // Kept short, so that later rounds take no longer.
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

TEST_F(RecordsTest, ReportsATimeoutWaitingForAnotherProgram) {
  Records records = open();
  const std::string anna = add(records, "Anna").pseudonym;
  auto impatient = Records::open(path_, false, 1);
  ASSERT_TRUE(impatient.ok());
  Status store_status;
  ASSERT_TRUE(records.together([&] {
    const auto stored = impatient->store(anna, test::recorded_session(1));
    if (!stored) store_status = stored.error();
    return Status();
  }));
  ASSERT_FALSE(store_status.ok());
  EXPECT_THAT(store_status.error().message, HasSubstr("another program"));
  EXPECT_EQ(*impatient->store(anna, test::recorded_session(1)), StoredAs::added) << "afterwards it can";
}

/// Stores until an error, then checks that all acknowledged sessions exist and that storing works again with
/// free space.
void fill_up(Records& records, const std::string& pseudonym, const std::string& expected,
             const std::function<void()>& make_room) {
  int stored = 0;
  std::string error;
  for (; stored < 20'000 && error.empty(); ++stored) {
    const auto done = records.store(pseudonym, test::recorded_session(stored));
    if (!done) error = done.error().message;
  }
  --stored;
  EXPECT_THAT(error, HasSubstr(expected));
  EXPECT_THAT(error, HasSubstr("nothing was stored"));
  make_room();
  EXPECT_EQ(records.sessions(pseudonym)->size(), static_cast<std::size_t>(stored));
  EXPECT_EQ(*records.store(pseudonym, test::recorded_session(stored)), StoredAs::added);
  EXPECT_EQ(test::text_of(records.sessions(pseudonym)->back()),
            test::text_of(test::recorded_session(stored)));
}

TEST_F(RecordsTest, AFullDiskLosesNothingAndIsUsedAgainLater) {
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

TEST_F(RecordsTest, AFileSizeLimitLosesNothing) {
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

}  // namespace
}  // namespace parhelion::training
