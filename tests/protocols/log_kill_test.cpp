// Promise 6: acknowledged events are in the log, whatever happens to the process or the disk.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <functional>
#include <random>

#include "protocols/bus/log_file.hpp"
#include "tests/long_run.hpp"

namespace parhelion {
namespace {

namespace fs = std::filesystem;

class LogSurvives : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (fs::temp_directory_path() / "parhelion-kill-XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

std::vector<std::uint8_t> payload_of(std::uint32_t number) {
  std::vector<std::uint8_t> payload(20 + number * 37 % 5000, static_cast<std::uint8_t>(number));
  for (std::size_t i = 0; i < 4; ++i) payload[i] = static_cast<std::uint8_t>(number >> (8 * i));
  return payload;
}

/// Writes events until it is killed; the number of each goes through the pipe after its write.
[[noreturn]] void write_forever(const std::string& path, int acknowledge) {
  auto writer = LogWriter::create(path, false);
  if (!writer) _exit(1);
  for (std::uint32_t number = 0;; ++number) {
    if (!writer->write("COMMAND", ArrivalTime::from_utime(number), payload_of(number))) _exit(2);
    if (number % 64 == 63 && !writer->sync()) _exit(3);
    if (write(acknowledge, &number, sizeof number) != sizeof number) _exit(4);
  }
}

/// Events in order with their own payloads; `errors`: number of damaged places.
std::uint32_t count_events(const std::string& path, int& errors) {
  auto reader = LogReader::open(path);
  EXPECT_TRUE(reader) << reader.error().message;
  std::uint32_t count = 0;
  errors = 0;
  while (true) {
    const auto event = reader->next();
    if (!event) {
      ++errors;
    } else if (!event->has_value()) {
      return count;
    } else {
      EXPECT_EQ((*event)->payload, payload_of(count));
      ++count;
    }
  }
}

TEST_F(LogSurvives, AKillAtAnyMomentLosesNoAcknowledgedData) {
  const int kills = test::long_run() ? 1000 : 50;
  std::mt19937 random(23);
  for (int kill_number = 0; kill_number < kills; ++kill_number) {
    const std::string path = (folder_ / std::to_string(kill_number)).string();
    std::array<int, 2> pipe_ends;
    ASSERT_EQ(pipe(pipe_ends.data()), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) write_forever(path, pipe_ends[1]);
    close(pipe_ends[1]);
    // Reads some acknowledgements, so that the kill falls in the middle of the work, then kills it and reads
    // the rest.
    std::uint32_t acknowledged = 0;
    for (std::uint32_t wanted = 1 + random() % 300, number; acknowledged < wanted;
         acknowledged = number + 1) {
      ASSERT_EQ(read(pipe_ends[0], &number, sizeof number), static_cast<ssize_t>(sizeof number));
    }
    kill(child, SIGKILL);
    for (std::uint32_t number; read(pipe_ends[0], &number, sizeof number) == sizeof number;)
      acknowledged = number + 1;
    close(pipe_ends[0]);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the writer ended by itself with " << WEXITSTATUS(status);
    int errors = 0;
    const std::uint32_t found = count_events(path, errors);
    EXPECT_GE(found, acknowledged) << "kill " << kill_number;
    EXPECT_LE(errors, 1);
    fs::remove(path);
  }
}

/// Fills the disk until an error, then checks that only whole events remain and that writing continues once
/// there is room again.
void fill_up(const std::string& path, const std::function<void()>& make_room) {
  auto writer = LogWriter::create(path, false);
  ASSERT_TRUE(writer) << writer.error().message;
  std::uint32_t written = 0;
  Status status;
  while (written < 100'000) {
    status = writer->write("SCAN", ArrivalTime::from_utime(written), payload_of(written));
    if (!status) break;
    ++written;
  }
  ASSERT_FALSE(status) << "the disk never became full";
  EXPECT_NE(status.error().message.find(path + ": byte "), std::string::npos) << status.error().message;
  int errors = 0;
  EXPECT_EQ(count_events(path, errors), written);
  EXPECT_EQ(errors, 0) << "half an event was left";
  make_room();
  EXPECT_TRUE(writer->write("SCAN", ArrivalTime::from_utime(written), payload_of(written)));
  EXPECT_EQ(count_events(path, errors), written + 1);
  EXPECT_EQ(errors, 0);
}

TEST_F(LogSurvives, AFullDiskLeavesWholeEventsAndIsUsedAgainLater) {
  const fs::path disk = folder_ / "disk";
  fs::create_directory(disk);
  if (mount("parhelion-test", disk.c_str(), "tmpfs", 0, "size=256k") != 0) {
    GTEST_SKIP() << "cannot mount a small tmpfs here (needs root)";
  }
  std::ignore = std::system(("head -c 65536 /dev/zero > " + (disk / "ballast").string()).c_str());
  fill_up((disk / "log.lcm").string(), [&] { fs::remove(disk / "ballast"); });
  EXPECT_EQ(umount2(disk.c_str(), MNT_DETACH), 0);
}

TEST_F(LogSurvives, AFileSizeLimitLeavesWholeEvents) {
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = signal(SIGXFSZ, SIG_IGN);
  const rlimit small{100'000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  fill_up((folder_ / "log.lcm").string(), [&] { EXPECT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0); });
  EXPECT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  signal(SIGXFSZ, handler);
}

}  // namespace
}  // namespace parhelion
