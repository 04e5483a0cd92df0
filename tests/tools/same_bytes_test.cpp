// Promise 4 for the whole program: the same log gives the same bytes for any number of threads, any rate and
// any build. PARHELION_OTHER_PROGRAM names the parhelion of another build, such as debug's.
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/long_run.hpp"
#include "tests/recordings.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::tools {
namespace {

struct Pace {
  int threads;
  const char* rate;
};

class SameBytesTest : public testing::Test {
 protected:
  /// The programs to compare: this build's and, if one is named, another's.
  static std::vector<std::string> programs() {
    std::vector<std::string> all{test::program()};
    if (const char* other = std::getenv("PARHELION_OTHER_PROGRAM")) all.emplace_back(other);
    return all;
  }
  /// All threads with all rates in a long test run, else each once.
  static std::vector<Pace> paces() {
    if (!test::long_run()) return {{1, "0"}, {2, "60"}, {8, "30"}};
    std::vector<Pace> all;
    for (const int threads : {1, 2, 8}) {
      for (const char* rate : {"0", "30", "10"}) all.push_back({threads, rate});
    }
    return all;
  }
  nlohmann::json replay(const std::string& program, const std::string& log, const std::string& scenario,
                        const Pace& pace) {
    const auto ran = test::run(
        {"replay", log, "--scenario", scenario, "-o", folder_ / "session.lcm", "--report",
         folder_ / "report.json", "--threads", std::to_string(pace.threads), "--rate", pace.rate, "--force"},
        folder_ / "replay.txt", program);
    EXPECT_EQ(ran.exit, 0) << program << ": " << ran.output;
    return nlohmann::json::parse(test::bytes_of(folder_ / "report.json"), nullptr, false);
  }
  void expect_the_same_bytes(const std::string& log, const std::string& scenario,
                             const std::vector<std::string>& channels) {
    nlohmann::json first;
    std::string first_session;
    for (const std::string& program : programs()) {
      for (const Pace& pace : paces()) {
        const auto report = replay(program, log, scenario, pace);
        const std::string session = test::bytes_of(folder_ / "session.lcm");
        if (first.is_null()) {
          first = report;
          first_session = session;
          for (const std::string& name : channels) EXPECT_TRUE(first["hash"].contains(name)) << name;
          EXPECT_GT(first["beams"]["replaced"], 0);
        }
        EXPECT_EQ(report["hash"], first["hash"])
            << program << " with " << pace.threads << " threads at rate " << pace.rate;
        EXPECT_TRUE(session == first_session) << "the session logs differ";
      }
    }
  }

  const test::TemporaryFolder folder_;
};

TEST_F(SameBytesTest, ASyntheticDriveIsIdenticalAtAnySpeedAndBuild) {
  Scenario scenario;
  scenario.name = "synthetic";
  scenario.model = "model.yaml";
  scenario.agents = {test::agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander),
                     test::agent("person_1", AgentKind::person, -3, 1, BehaviourKind::wander),
                     test::agent("barrel_1", AgentKind::barrel, 0, 0)};
  scenario.agents[0].laser = "lms-200";
  std::ofstream(folder_ / "model.yaml") << to_yaml(test::room());
  std::ofstream(folder_ / "scenario.yaml") << to_yaml(scenario);
  test::write_log(folder_ / "drive.lcm", test::drive(20));
  expect_the_same_bytes(folder_ / "drive.lcm", folder_ / "scenario.yaml",
                        {channel::kMrScan, channel::kMrScanInfo, channel::kMrWorld, channel::kMrEvents,
                         "MR_AGENT_robot_1_SCAN"});
}

TEST_F(SameBytesTest, ARealDriveIsIdenticalAtAnySpeedAndBuild) {
  PARHELION_NEEDS_RECORDING(test::sena_rawlog());
  const auto ran = test::run({"demo", "--headless", "--fast", "--silent", "--folder", folder_ / "demo"},
                             folder_ / "demo.txt");
  ASSERT_EQ(ran.exit, 0) << ran.output;
  expect_the_same_bytes(
      folder_ / "demo/with-camera.lcm", folder_ / "demo/scenario.yaml",
      {channel::kMrScan, channel::kMrScanInfo, channel::kMrWorld, channel::kMrEvents, channel::kMrCamera});
}

}  // namespace
}  // namespace parhelion::tools
