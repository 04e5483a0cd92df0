// The demo from end to end on the recording of Debian's mrpt-common, and promise 4 on its output.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "server/review/review.hpp"
#include "tests/recordings.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

constexpr const char* kTrainingYaml = R"(training:
  tasks:
    - {name: set off, points: 50, done: {event: movement_started}}
    - {name: never, points: 50, done: {event: battery_low}}  # what is done whole is graded no further
  penalties: [{name: touched, points: 10, when: {event: contact_started}}]
)";

/// What if a barrel had stood at the robot's position `t` s after the start? Nothing else differs.
std::string with_barrel(std::string scenario, const review::SessionReview& review, double t) {
  const auto points = review.path.track.points();
  const auto there =
      std::find_if(points.begin(), points.end(), [&](const review::TrackPoint& p) { return p.t >= t; });
  if (there == points.end()) return "";
  return scenario.insert(scenario.find("agents:\n") + 8,
                         "  - {name: barrel, kind: barrel, pose: {x: " + std::to_string(there->x) +
                             " m, y: " + std::to_string(there->y) + " m}}\n");
}

/// Replays the recorded log with other agents, graded by the same rules, and compares the two runs.
void ask_what_if(const test::TemporaryFolder& folder) {
  const auto again = [&](const std::string& name, const std::string& scenario) {
    std::ofstream(folder / ("demo/" + name + ".yaml")) << scenario;
    const auto ran = test::run({"replay", folder / "demo/localized.lcm", "--scenario",
                                folder / ("demo/" + name + ".yaml"), "-o", folder / (name + ".lcm")},
                               folder / "again.txt");
    EXPECT_EQ(ran.exit, 0) << ran.output;
    return review::review_session(folder / (name + ".lcm"));
  };
  const std::string scenario = test::bytes_of(folder / "demo/scenario.yaml") + kTrainingYaml;
  const auto alone = again("alone", scenario);
  ASSERT_TRUE(alone.ok()) << alone.error().message;
  EXPECT_TRUE(alone->grade->deductions.empty());
  EXPECT_EQ(alone->grade->score, 50);
  const auto met = again("met", with_barrel(scenario, *alone, 32));
  ASSERT_TRUE(met.ok()) << met.error().message;
  // A wandering robot drives otherwise where there is a barrel, and may be touched, too.
  const auto& deductions = met->grade->deductions;
  const auto touched =
      std::find_if(deductions.begin(), deductions.end(),
                   [](const training::Deduction& each) { return each.cause->object == "barrel"; });
  ASSERT_NE(touched, deductions.end());
  EXPECT_EQ(touched->cause->pair, PairKind::real_virtual);
  // The barrel is not in the real scans; its returns were injected.
  const auto near = met->series.at("nearest_injected").samples();
  EXPECT_TRUE(
      std::any_of(near.begin(), near.end(), [](const review::Series::Sample& s) { return s.value < 0.5; }));
  const auto page =
      test::run({"report", folder / "alone.lcm", "--against", folder / "met.lcm", "-o", folder / "both.html"},
                folder / "report.txt");
  EXPECT_EQ(page.exit, 0) << page.output;
  const std::string html = test::bytes_of(folder / "both.html");
  EXPECT_NE(html.find("\"log\":\"alone.lcm\""), std::string::npos);
  EXPECT_NE(html.find("\"log\":\"met.lcm\""), std::string::npos);
}

/// Number of pictures in a session log that differ from the camera's picture of that instant.
std::size_t changed_pictures(const std::string& log) {
  std::map<SensorTime, std::vector<std::uint8_t>> taken;
  std::size_t changed = 0;
  auto reader = LogReader::open(log);
  EXPECT_TRUE(reader.ok());
  while (reader.ok()) {
    const auto next = reader->next();
    if (!next.ok() || !*next) break;
    Image image;
    const bool camera = (*next)->channel == channel::kCamera;
    if ((!camera && (*next)->channel != channel::kMrCamera) ||
        !decode((*next)->channel, (*next)->payload, image).ok())
      continue;
    if (camera)
      taken[image.stamp] = image.bytes;
    else
      changed += taken.at(image.stamp) != image.bytes;
  }
  return changed;
}

TEST(Demo, DemoInjectsVirtualRobotsIntoARealRecording) {
  PARHELION_NEEDS_RECORDING(test::sena_rawlog());
  const test::TemporaryFolder folder;
  const auto ran = test::run({"demo", "--headless", "--fast", "--silent", "--folder", folder / "demo", "-o",
                              folder / "session.lcm", "--report", folder / "report.json"},
                             folder / "demo.txt");
  ASSERT_EQ(ran.exit, 0) << ran.output;
  const auto report = nlohmann::json::parse(test::bytes_of(folder / "report.json"));
  EXPECT_EQ(report["scans"]["in"], 225);
  EXPECT_EQ(report["scans"]["out"], 225);
  // Just below the deterministic results for this recording and these agents: 1,643 and 276.
  EXPECT_GE(report["beams"]["replaced"], 1600);
  EXPECT_GE(report["frames"]["composited"], 270);
  EXPECT_EQ(report["frames"]["in"], 591);
  EXPECT_EQ(changed_pictures(folder / "session.lcm"), report["frames"]["composited"]);
  EXPECT_EQ(report["frames"]["in"], report["frames"]["out"]);
  EXPECT_TRUE(std::filesystem::file_size(folder / "demo/map.png") > 10'000);
  EXPECT_TRUE(std::filesystem::file_size(folder / "demo/camera.jpg") > 5'000);

  // The session log reproduces everything, byte for byte.
  const auto again =
      test::run({"replay", folder / "session.lcm", "-o", folder / "again.lcm", "--threads", "1"},
                folder / "replay.txt");
  ASSERT_EQ(again.exit, 0) << again.output;
  EXPECT_TRUE(test::bytes_of(folder / "session.lcm") == test::bytes_of(folder / "again.lcm"));
  ask_what_if(folder);
}

class DemoWithEngine : public ::testing::TestWithParam<const char*> {};

/// Import, SLAM, server, injection and compositing.
TEST_P(DemoWithEngine, FeedsTheWholeChainFromImportToComposition) {
  PARHELION_NEEDS_RECORDING(test::sena_rawlog());
  const test::TemporaryFolder folder;
  const auto ran = test::run({"demo", "--headless", "--fast", "--silent", "--engine", GetParam(), "--folder",
                              folder / "demo", "--report", folder / "report.json"},
                             folder / "demo.txt");
  ASSERT_EQ(ran.exit, 0) << ran.output;
  const auto report = nlohmann::json::parse(test::bytes_of(folder / "report.json"));
  std::printf("%s: %s beams replaced, %s of %s frames composited\n", GetParam(),
              report["beams"]["replaced"].dump().c_str(), report["frames"]["composited"].dump().c_str(),
              report["frames"]["in"].dump().c_str());
  EXPECT_EQ(report["scans"]["in"], 225);
  EXPECT_EQ(report["scans"]["out"], 225);
  EXPECT_EQ(report["frames"]["in"], report["frames"]["out"]);
  // Half of what Parhelion's own engine gives: maps differ, and with them where agents are placed.
  EXPECT_GE(report["beams"]["replaced"], 700);
  EXPECT_GE(report["frames"]["composited"], 115);
}

INSTANTIATE_TEST_SUITE_P(Engines, DemoWithEngine,
                         ::testing::Values("mrpt-icp", "mrpt-rbpf", "mrpt-localization"),
                         [](const auto& param) {
                           std::string name = param.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST(Demo, EveryCommandExplainsItselfWithAnExample) {
  const test::TemporaryFolder folder;
  for (const char* name : {"demo", "import", "slam", "map", "serve", "replay", "grade", "report", "inject",
                           "drive", "joystick", "topic", "validate", "doctor"}) {
    const auto ran = test::run({name, "--help"}, folder / "help.txt");
    EXPECT_EQ(ran.exit, 0) << name;
    EXPECT_NE(ran.output.find("Example"), std::string::npos) << name;
    EXPECT_EQ(test::run({name, "--no-such-option"}, folder / "help.txt").exit, 2) << name;
  }
}

}  // namespace
}  // namespace parhelion::tools
