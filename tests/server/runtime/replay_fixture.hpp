// Replays of messages with a scenario, both written by the test.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "server/runtime/replay.hpp"
#include "tests/file_bytes.hpp"
#include "tests/server/tick/same_bytes.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::test {

class ReplayFixture : public testing::Test {
 protected:
  /// The synthetic room, with `robot` in robot.yaml. The scenario's files are in the folder.
  void write(const Scenario& scenario, const RobotDescription& robot, const std::vector<Message>& log) {
    std::ofstream(folder_ / "model.yaml") << to_yaml(room());
    std::ofstream(folder_ / "robot.yaml") << to_yaml(robot);
    std::ofstream(folder_ / "scenario.yaml") << to_yaml(scenario);
    write_log(folder_ / "drive.lcm", log);
  }
  runtime::Report run(const runtime::ReplayOptions& options) {
    auto report = runtime::replay(options);
    EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
    return report.ok() ? *report : runtime::Report{};
  }
  runtime::ReplayOptions options(const std::string& session, int threads = 1) {
    runtime::ReplayOptions options;
    options.log = folder_ / "drive.lcm";
    options.scenario = folder_ / "scenario.yaml";
    options.session = folder_ / session;
    options.threads = threads;
    return options;
  }
  /// As a.lcm, whose report this is.
  void expect_same_bytes_for_any_thread_count(const runtime::Report& first) {
    for (const int threads : {1, 2, 8}) {
      const std::string session = "b" + std::to_string(threads) + ".lcm";
      EXPECT_EQ(run(options(session, threads)).hash, first.hash) << threads;
      EXPECT_TRUE(bytes_of(folder_ / session) == bytes_of(folder_ / "a.lcm"))
          << threads << " threads" << difference(folder_ / "a.lcm", folder_ / session);
    }
  }
  void expect_replay_without_files(const runtime::Report& first) {
    for (const char* file : {"model.yaml", "robot.yaml", "scenario.yaml"})
      std::filesystem::remove(folder_ / file);
    runtime::ReplayOptions again;
    again.log = folder_ / "a.lcm";
    again.session = folder_ / "b.lcm";
    EXPECT_EQ(run(again).hash, first.hash);
    EXPECT_TRUE(bytes_of(folder_ / "a.lcm") == bytes_of(folder_ / "b.lcm"));
  }

  TemporaryFolder folder_;
};

}  // namespace parhelion::test
