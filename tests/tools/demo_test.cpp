// The demo from end to end on the recording of Debian's mrpt-common, and promise 4 on what it leaves.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/recordings.hpp"
#include "tests/server/synthetic.hpp"
#include "tests/tools/process.hpp"

namespace parhelion {
namespace {

TEST(Demo, DemoPutsVirtualRobotsIntoTheScansAndTheVideoOfARealRecording) {
  PARHELION_NEEDS_RECORDING(test::sena_rawlog());
  const test::Folder folder;
  const auto ran = test::run({"demo", "--headless", "--fast", "--silent", "--folder", folder / "demo", "-o",
                              folder / "session.lcm", "--report", folder / "report.json"},
                             folder / "demo.txt");
  ASSERT_EQ(ran.exit, 0) << ran.output;
  const auto report = nlohmann::json::parse(test::text_of(folder / "report.json"));
  EXPECT_EQ(report["scans"]["in"], 225);
  EXPECT_EQ(report["scans"]["out"], 225);
  EXPECT_GT(report["beams"]["replaced"], 500);
  EXPECT_GT(report["frames"]["composited"], 10);
  EXPECT_EQ(report["frames"]["in"], report["frames"]["out"]);
  EXPECT_TRUE(std::filesystem::file_size(folder / "demo/map.png") > 10'000);
  EXPECT_TRUE(std::filesystem::file_size(folder / "demo/camera.jpg") > 5'000);

  // The session log is enough to have it all again, to the byte.
  const auto again =
      test::run({"replay", folder / "session.lcm", "-o", folder / "again.lcm", "--threads", "1"},
                folder / "replay.txt");
  ASSERT_EQ(again.exit, 0) << again.output;
  EXPECT_TRUE(test::text_of(folder / "session.lcm") == test::text_of(folder / "again.lcm"));
}

TEST(Demo, EveryCommandExplainsItselfWithAnExample) {
  const test::Folder folder;
  for (const char* name : {"demo", "import", "slam", "map", "serve", "replay", "grade", "report", "inject",
                           "drive", "joystick", "topic", "validate", "doctor"}) {
    const auto ran = test::run({name, "--help"}, folder / "help.txt");
    EXPECT_EQ(ran.exit, 0) << name;
    EXPECT_NE(ran.output.find("Example"), std::string::npos) << name;
    EXPECT_EQ(test::run({name, "--no-such-option"}, folder / "help.txt").exit, 2) << name;
  }
}

}  // namespace
}  // namespace parhelion
