// Output files of the commands: written atomically, and never overwritten without permission.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <set>

#include "protocols/bus/log_file.hpp"
#include "tests/recordings.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"
#include "tools/text_file.hpp"
#include "tools/topic_text.hpp"

namespace parhelion::tools {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Simulates a full disk for this process and its children: files are limited to `bytes`.
class SmallDisk {
 public:
  explicit SmallDisk(rlim_t bytes) : signal_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  ~SmallDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, signal_);
  }

 private:
  rlimit before_{};
  void (*signal_)(int);
};

std::string write_drive(const test::TemporaryFolder& folder) {
  const std::string path = folder / "drive.lcm";
  auto writer = LogWriter::create(path, false);
  EXPECT_TRUE(writer);
  EXPECT_TRUE(writer->write(test::drive(4)));
  return path;
}

std::set<std::string> names_in(const std::string& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.insert(entry.path().filename().string());
  return names;
}

TEST(WrittenFiles, SavedMapsAreNotOverwrittenWithoutForce) {
  const test::TemporaryFolder folder;
  const std::string log = write_drive(folder);
  const std::string site = folder / "site";
  std::ofstream(site + ".pgm") << "mine";
  const auto refused = test::run({"slam", "--log", log, "--save-map", site}, folder / "said.txt");
  EXPECT_EQ(refused.exit, 1);
  EXPECT_THAT(refused.output, AllOf(HasSubstr("site.pgm: exists already"), HasSubstr("--force")));
  EXPECT_EQ(test::bytes_of(site + ".pgm"), "mine");
  EXPECT_FALSE(std::filesystem::exists(site + ".yaml"));
  const auto forced = test::run({"slam", "--log", log, "--save-map", site, "--force"}, folder / "said.txt");
  EXPECT_EQ(forced.exit, 0) << forced.output;
  for (const char* end : {".simplemap", ".yaml", ".pgm", ".png"})
    EXPECT_GT(std::filesystem::file_size(site + end), 100U) << end;
  EXPECT_FALSE(std::filesystem::exists(site + ".part"));
}

TEST(WrittenFiles, AFullDiskLeavesTheOldMapIntact) {
  const test::TemporaryFolder folder;
  const std::string log = write_drive(folder);
  std::filesystem::create_directory(folder / "maps");
  const std::string site = folder / "maps/site";
  ASSERT_EQ(test::run({"slam", "--log", log, "--save-map", site}, folder / "said.txt").exit, 0);
  const std::string before = test::bytes_of(site + ".pgm");
  const auto names = names_in(folder / "maps");
  EXPECT_EQ(names.size(), 4U);
  const std::vector<std::string> again{"slam", "--log", log, "--save-map", site, "--force"};
  std::size_t failures = 0;
  for (const rlim_t bytes : {rlim_t{20}, rlim_t{2000}, rlim_t{6000}, rlim_t{20'000}}) {
    test::Ran ran;
    {
      const SmallDisk full(bytes);
      const std::string output_file = folder / "said.txt";
      std::filesystem::remove(output_file);
      ran = test::run(again, output_file);
    }
    EXPECT_EQ(names_in(folder / "maps"), names) << bytes;
    EXPECT_EQ(test::bytes_of(site + ".pgm"), before) << bytes;
    if (ran.exit == 0) continue;
    ++failures;
    EXPECT_EQ(ran.exit, 1) << ran.output;
  }
  EXPECT_GE(failures, 2U) << "the disk was never full";
}

TEST(WrittenFiles, ExtrudeChecksThePictureNameBeforeWriting) {
  const test::TemporaryFolder folder;
  const std::string site = folder / "site", model = folder / "model.yaml";
  ASSERT_EQ(test::run({"slam", "--log", write_drive(folder), "--save-map", site}, folder / "said.txt").exit,
            0);
  const std::string bad[] = {folder / "model.jpg", folder / "nowhere/model.png", site + ".png"};
  for (const std::string& picture : bad) {
    const auto ran =
        test::run({"map", "extrude", site + ".yaml", "-o", model, "--picture", picture}, folder / "said.txt");
    EXPECT_EQ(ran.exit, 1);
    EXPECT_THAT(ran.output, HasSubstr(picture));
    EXPECT_FALSE(std::filesystem::exists(model)) << picture;
  }
  EXPECT_EQ(test::run({"map", "extrude", site + ".yaml", "-o", model, "--picture", folder / "model.png"},
                      folder / "said.txt")
                .exit,
            0);
  EXPECT_GT(std::filesystem::file_size(folder / "model.png"), 1000U);
}

TEST(WrittenFiles, WriteBesideIsAllOrNothing) {
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder / "x";
  const auto write_one = [](const std::filesystem::path& into) -> Status {
    std::ofstream(into / "x.a") << "a";
    return Error{"no more room"};
  };
  const Status failed = write_beside(path, {"x.a", "x.b"}, write_one);
  EXPECT_EQ(failed.error().message, "no more room");
  EXPECT_THAT(names_in(path.parent_path()), IsEmpty());
  EXPECT_FALSE(check_writable(path / "y", true)) << "its folder is not there";
}

TEST(WrittenFiles, AnExistingReportIsRefusedBeforeTheReplay) {
  const test::TemporaryFolder folder;
  const std::string log = write_drive(folder), scenario = folder / "s.yaml", report = folder / "r.json";
  std::ofstream(scenario) << "name: x\n";
  std::ofstream(report) << "mine";
  const std::vector<std::string> replay{
      "replay", log, "--scenario", scenario, "-o", folder / "session.lcm", "--report", report};
  const auto ran = test::run(replay, folder / "said.txt");
  EXPECT_EQ(ran.exit, 1);
  EXPECT_THAT(ran.output, HasSubstr("r.json: exists already"));
  EXPECT_FALSE(std::filesystem::exists(folder / "session.lcm"));
  EXPECT_EQ(test::bytes_of(report), "mine");
}

TEST(Replay, ALogWithoutUsableScansFails) {
  const test::TemporaryFolder folder;
  auto messages = test::drive(1);
  for (Message& message : messages) {
    if (message.channel == "SCAN") message.payload[0] ^= 0x55;  // of its fingerprint
  }
  const std::string log = folder / "drive.lcm", scenario = folder / "s.yaml";
  ASSERT_TRUE(LogWriter::create(log, false)->write(messages));
  std::ofstream(scenario) << "name: x\n";
  const auto ran = test::run({"replay", log, "--scenario", scenario}, folder / "said.txt");
  EXPECT_EQ(ran.exit, 1);
  EXPECT_THAT(ran.output, AllOf(HasSubstr("planar_lidar_t"), HasSubstr("none of its scans could be used")));
}

TEST(TopicEcho, ARobotDescriptionIsPrintedAsItsYaml) {
  const Message message = test::message(
      "ROBOT", 5, RobotMessage{SensorTime::from_utime(test::kStartUs), "name: r2\nsource: \"\x1b[2J\"\n"});
  EXPECT_THAT(echo_text(message),
              AllOf(HasSubstr("robot_t"), HasSubstr("\n    name: r2\n    source: \"?[2J\"")));
}

TEST(DemoWithoutEgl, ContinuesWithoutTheCameraAndReportsWhy) {
  PARHELION_NEEDS_RECORDING(test::sena_rawlog());
  const test::TemporaryFolder folder;
  setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/none.json", 1);
  const auto ran = test::run({"demo", "--headless", "--fast", "--silent", "--folder", folder / "demo",
                              "--report", folder / "report.json"},
                             folder / "demo.txt");
  unsetenv("__EGL_VENDOR_LIBRARY_FILENAMES");
  EXPECT_EQ(ran.exit, 0) << ran.output;
  EXPECT_THAT(ran.output,
              HasSubstr("camera   none: the recording has none, and no stand-in can be rendered"));
  EXPECT_THAT(test::bytes_of(folder / "report.json"), HasSubstr("no stand-in can be rendered"));
  EXPECT_TRUE(std::filesystem::exists(folder / "demo/map.png"));
  EXPECT_FALSE(std::filesystem::exists(folder / "demo/camera.jpg"));
}

}  // namespace
}  // namespace parhelion::tools
