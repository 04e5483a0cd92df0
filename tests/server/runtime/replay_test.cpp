// Promise 4 (same log, same bytes), and malformed logs.
#include "server/runtime/replay.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/file_bytes.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::runtime {
namespace {

using test::agent;
using test::bytes_of;

/// A drive, its model and its scenario.
void write_files(const test::TemporaryFolder& folder) {
  Scenario scenario;
  scenario.name = "synthetic";
  scenario.model = folder / "model.yaml";
  scenario.agents = {agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander),
                     agent("person_1", AgentKind::person, -3, 1, BehaviourKind::wander),
                     agent("barrel_1", AgentKind::barrel, 0, 0)};
  std::ofstream(folder / "model.yaml") << to_yaml(test::room());
  std::ofstream(folder / "scenario.yaml") << to_yaml(scenario);
  test::write_log(folder / "drive.lcm", test::drive(6));
}

class ReplayTest : public testing::Test {
 protected:
  void SetUp() override { write_files(folder_); }
  ReplayOptions options(const std::string& session) {
    ReplayOptions options;
    options.log = folder_ / "drive.lcm";
    options.scenario = folder_ / "scenario.yaml";
    options.session = folder_ / session;
    return options;
  }
  Report run(const ReplayOptions& options) {
    auto report = replay(options);
    EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
    return report.ok() ? *report : Report{};
  }
  /// Replays the session a.lcm and compares.
  void expect_same_session_again() {
    ReplayOptions again;
    again.log = folder_ / "a.lcm";
    again.session = folder_ / "b.lcm";
    run(again);
    EXPECT_EQ(bytes_of(folder_ / "a.lcm"), bytes_of(folder_ / "b.lcm"));
  }

  test::TemporaryFolder folder_;
};

TEST_F(ReplayTest, ReplayPublishesEveryScan) {
  const Report report = run(options("a.lcm"));
  EXPECT_EQ(report.tally.scans_in, 60U);
  EXPECT_EQ(report.tally.scans_out, 60U);
  EXPECT_GT(report.tally.beams_replaced, 0U);
  EXPECT_TRUE(report.complete);
}

TEST_F(ReplayTest, ReplayGivesTheSameBytesForAnyThreadCountAndSpeed) {
  const Report first = run(options("a.lcm"));
  const std::string reference = bytes_of(folder_ / "a.lcm");
  ASSERT_FALSE(reference.empty());
  int number = 0;
  for (const int threads : {1, 2, 8}) {
    for (const double rate : {0.0, 30.0, 7.0}) {
      ReplayOptions other = options("b" + std::to_string(number++) + ".lcm");
      other.threads = threads;
      other.rate = rate;
      EXPECT_EQ(run(other).hash, first.hash);
      EXPECT_EQ(bytes_of(other.session), reference) << threads << " threads at rate " << rate;
    }
  }
}

TEST_F(ReplayTest, ReplayGivesTheSameBytesWhereverTheFilesLie) {
  const test::TemporaryFolder elsewhere;
  write_files(elsewhere);
  ReplayOptions moved;
  moved.log = elsewhere / "drive.lcm";
  moved.scenario = elsewhere / "scenario.yaml";
  moved.session = elsewhere / "a.lcm";
  EXPECT_EQ(run(moved).hash, run(options("a.lcm")).hash);
  EXPECT_EQ(bytes_of(elsewhere / "a.lcm"), bytes_of(folder_ / "a.lcm"));
}

/// PARHELION_HASHES names a file: the first tested build writes it, and each later one must agree.
TEST_F(ReplayTest, ReplayGivesTheSameBytesInEveryBuild) {
  const char* path = std::getenv("PARHELION_HASHES");
  if (path == nullptr) GTEST_SKIP() << "PARHELION_HASHES names no file to compare with (tools/test does)";
  std::string hashes;
  for (const auto& [channel, hash] : run(options("a.lcm")).hash) hashes += channel + " " + hash + "\n";
  ASSERT_NE(hashes.find(channel::kMrScan), std::string::npos);
  if (!std::filesystem::exists(path)) std::ofstream(path) << hashes;
  EXPECT_EQ(bytes_of(path), hashes) << "another build gave other bytes";
}

TEST_F(ReplayTest, ReplayOfASessionLogReproducesTheSession) {
  run(options("a.lcm"));
  expect_same_session_again();
}

TEST_F(ReplayTest, ReplayWithOtherAgentsKeepsTheInputs) {
  run(options("a.lcm"));
  Scenario empty;
  empty.name = "nobody";
  empty.model = folder_ / "model.yaml";
  std::ofstream(folder_ / "empty.yaml") << to_yaml(empty);
  ReplayOptions other;
  other.log = folder_ / "a.lcm";
  other.scenario = folder_ / "empty.yaml";
  const Report report = run(other);
  EXPECT_EQ(report.tally.scans_in, 60U);
  EXPECT_EQ(report.tally.beams_replaced, 0U);
}

TEST_F(ReplayTest, ReplayOverwritesASessionOnlyOnRequest) {
  run(options("a.lcm"));
  const auto second = replay(options("a.lcm"));
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().message.find("a.lcm"), std::string::npos);
}

TEST_F(ReplayTest, ReplayNeverWritesOverTheLogThatItReads) {
  const std::string before = bytes_of(folder_ / "drive.lcm");
  ReplayOptions onto_itself = options("./drive.lcm");
  onto_itself.overwrite = true;
  const auto report = replay(onto_itself);
  ASSERT_FALSE(report.ok());
  EXPECT_NE(report.error().message.find("drive.lcm"), std::string::npos);
  EXPECT_EQ(bytes_of(folder_ / "drive.lcm"), before);
}

TEST_F(ReplayTest, ReplayUsesTheRobotOfTheSession) {
  RobotDescription other = test::robot();
  other.laser->T_base_laser = Transform<Base, Laser>::planar(0.4, 0, 0, 0.3);
  std::ofstream(folder_ / "robot.yaml") << to_yaml(other);
  ReplayOptions with_file = options("a.lcm");
  with_file.robot = folder_ / "robot.yaml";
  const Report first = run(with_file);
  EXPECT_NE(first.hash.at(channel::kMrScan), run(options("c.lcm")).hash.at(channel::kMrScan));
  ReplayOptions again;
  again.log = folder_ / "a.lcm";
  EXPECT_EQ(run(again).hash, first.hash);
}

TEST_F(ReplayTest, AFailedReplayLeavesNoEmptySession) {
  std::ofstream(folder_ / "drive.lcm", std::ios::trunc);
  EXPECT_FALSE(replay(options("a.lcm")).ok());
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.lcm"));
}

TEST_F(ReplayTest, AFailedReplayKeepsTheSessionThatItWouldOverwrite) {
  run(options("a.lcm"));
  const std::string before = bytes_of(folder_ / "a.lcm");
  std::ofstream(folder_ / "drive.lcm", std::ios::trunc);
  ReplayOptions again = options("a.lcm");
  again.overwrite = true;
  EXPECT_FALSE(replay(again).ok());
  EXPECT_EQ(bytes_of(folder_ / "a.lcm"), before);
}

TEST_F(ReplayTest, TheSummaryGivesTheReasonWhereNothingWasInjected) {
  EXPECT_EQ(summary(run(options("a.lcm"))).find("no beam hit"), std::string::npos);
  Report report;
  report.tally.scans_in = report.tally.scans_out = 9;
  EXPECT_EQ(summary(report).find("because"), std::string::npos) << "a simulated laser measures agents itself";
  report.tally.scans_of_real_lasers = 9;
  EXPECT_NE(summary(report).find("no beam hit an agent"), std::string::npos);
  report.tally.scans_degraded[static_cast<std::size_t>(tick::Degraded::pose)] = 7;
  report.tally.scans_degraded[static_cast<std::size_t>(tick::Degraded::clock)] = 2;
  EXPECT_NE(summary(report).find("because 7 scans: no pose of the robot"), std::string::npos)
      << summary(report);
  report.tally.scans_in = report.tally.scans_out = report.tally.scans_of_real_lasers = 901;
  report.tally.beams_replaced = 1;
  EXPECT_EQ(summary(report).find("because"), std::string::npos) << "hardly any scan was degraded";
}

TEST_F(ReplayTest, TheSummaryDistinguishesHiddenAgentsFromThoseOutOfRange) {
  const auto summary_with = [&](const AgentDefinition& agent) {
    Scenario scenario;
    scenario.name = "one agent";
    scenario.model = folder_ / "model.yaml";
    scenario.agents = {agent};
    std::ofstream(folder_ / "one.yaml") << to_yaml(scenario);
    ReplayOptions replayed = options("one.lcm");
    replayed.overwrite = true;
    replayed.scenario = folder_ / "one.yaml";
    return summary(run(replayed));
  };
  // The laser's range is 30 m; the wall in between is at y = 4 m.
  const std::string far = summary_with(test::agent("far", AgentKind::box, 0, 45));
  EXPECT_NE(far.find("because no agent was within the range"), std::string::npos) << far;
  const std::string hidden = summary_with(test::agent("hidden", AgentKind::person, 0, 6));
  EXPECT_NE(hidden.find("hit agents only behind real obstacles"), std::string::npos) << hidden;
}

TEST_F(ReplayTest, ASessionWhoseHazardIsOfNobodyIsReplayedAsItWas) {
  Scenario scenario;
  scenario.name = "hazard";
  scenario.model = folder_ / "model.yaml";
  scenario.agents = {test::agent("case_1", AgentKind::box, 0, 0)};
  Hazard& device = scenario.hazards.emplace_back();
  device.name = "device";
  device.agent = "case_1";
  device.tilt = 1;
  std::ofstream(folder_ / "scenario.yaml") << to_yaml(scenario);
  run(options("a.lcm"));
  // A file with such a hazard is refused; logs from before that check may have one.
  std::string bytes = bytes_of(folder_ / "a.lcm");
  const auto name = bytes.find("case_1", bytes.find("hazards:"));
  ASSERT_NE(name, std::string::npos);
  bytes.replace(name, 6, "case_9");
  std::ofstream(folder_ / "old.lcm", std::ios::binary) << bytes;
  ReplayOptions again;
  again.log = folder_ / "old.lcm";
  EXPECT_EQ(run(again).tally.scans_in, 60U);
}

TEST_F(ReplayTest, ReplayReadsATruncatedLogAsFarAsItGoes) {
  const std::string whole = bytes_of(folder_ / "drive.lcm");
  for (const std::size_t cut : {std::size_t{1}, std::size_t{30}, whole.size() / 2, whole.size() - 1}) {
    std::ofstream(folder_ / "cut.lcm", std::ios::binary) << whole.substr(0, cut);
    ReplayOptions other = options("cut-session.lcm");
    other.log = folder_ / "cut.lcm";
    other.robot = folder_ / "robot.yaml";
    std::ofstream(folder_ / "robot.yaml") << to_yaml(test::robot());
    other.overwrite = true;
    const auto report = replay(other);
    if (!report.ok()) {
      EXPECT_NE(report.error().message.find("cut.lcm"), std::string::npos);
      EXPECT_NE(report.error().message.find("are lost"), std::string::npos) << report.error().message;
    } else {
      EXPECT_EQ(report->tally.scans_in, report->tally.scans_out);
      EXPECT_NE(summary(*report).find("bytes of the log were lost"), std::string::npos) << summary(*report);
    }
  }
}

TEST_F(ReplayTest, ReplaySurvivesFlippedBits) {
  const std::string whole = bytes_of(folder_ / "drive.lcm");
  std::uint32_t random = 12345;
  for (int round = 0; round < 30; ++round) {
    std::string damaged = whole;
    for (int flip = 0; flip < 20; ++flip) {
      random = random * 1664525U + 1013904223U;
      damaged[random % damaged.size()] ^= static_cast<char>(1 << (random >> 29));
    }
    std::ofstream(folder_ / "flipped.lcm", std::ios::binary) << damaged;
    std::ofstream(folder_ / "robot.yaml") << to_yaml(test::robot());
    ReplayOptions other = options("flipped-session.lcm");
    other.log = folder_ / "flipped.lcm";
    other.robot = folder_ / "robot.yaml";
    other.overwrite = true;
    const auto report = replay(other);
    if (report.ok()) {
      EXPECT_EQ(report->tally.scans_in, report->tally.scans_out);
    }
  }
}

TEST_F(ReplayTest, ReplaySkipsADayOfPauseAndReportsIt) {
  auto log = test::drive(2);
  auto later = test::drive(2);
  for (Message& each : later) each.arrival = each.arrival + seconds(86'400);
  log.insert(log.end(), later.begin(), later.end());
  test::write_log(folder_ / "paused.lcm", log);
  ReplayOptions other = options("a.lcm");
  other.log = folder_ / "paused.lcm";
  const Report report = run(other);
  EXPECT_EQ(report.tally.scans_in, 40U);
  EXPECT_EQ(report.tally.scans_out, 40U);
  EXPECT_LT(report.arrivals_corrected, 10U);
  expect_same_session_again();
}

TEST_F(ReplayTest, ReplayReportsMissingInputs) {
  ReplayOptions other = options("x.lcm");
  other.log = folder_ / "nothing.lcm";
  auto report = replay(other);
  ASSERT_FALSE(report.ok());
  EXPECT_NE(report.error().message.find("nothing.lcm"), std::string::npos);

  auto without_robot = test::drive(1);
  std::erase_if(without_robot, [](const Message& m) { return m.channel == channel::kRobot; });
  test::write_log(folder_ / "no-robot.lcm", without_robot);
  other.log = folder_ / "no-robot.lcm";
  report = replay(other);
  ASSERT_FALSE(report.ok());
  EXPECT_NE(report.error().message.find("--robot"), std::string::npos);
}

}  // namespace
}  // namespace parhelion::runtime
