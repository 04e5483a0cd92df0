// A live server in its own process, with everything that it needs in a temporary folder.
#pragma once

#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "server/runtime/wall_clock.hpp"
#include "tests/server/tick/synthetic.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::test {

class ServerUnderTest {
 public:
  /// `port`: of the multicast group. `keys`: of the server; empty: no authentication.
  explicit ServerUnderTest(int port, std::string keys = "") : port_(port), keys_(std::move(keys)) {
    std::ofstream(folder_ / "model.yaml") << to_yaml(room());
    std::ofstream(folder_ / "robot.yaml") << to_yaml(robot());
    Scenario scenario;
    scenario.name = "faults";
    scenario.model = "model.yaml";
    scenario.robot = "robot.yaml";
    scenario.authentication = !keys_.empty();
    scenario.agents = {agent("person", AgentKind::person, 3.5, 1)};
    std::ofstream(folder_ / "scenario.yaml") << to_yaml(scenario);
    start();
  }

  std::string url() const { return "udpm://239.255.76.67:" + std::to_string(port_) + "?ttl=0"; }
  /// Starts a supervised server, in place of one before.
  void start() { process_ = std::make_unique<Process>(arguments("session"), folder_ / "serve.txt"); }
  /// A second server on the same bus, until the result is destroyed.
  std::unique_ptr<Process> another() const {
    return std::make_unique<Process>(arguments("another"), folder_ / "another.txt");
  }
  Process& supervisor() { return *process_; }
  /// The process that serves; 0: none now.
  pid_t child() const { return child_of(process_->pid()); }
  std::string session() const { return folder_ / "session.lcm"; }
  std::string output() const { return bytes_of(folder_ / "serve.txt"); }
  const TemporaryFolder& folder() const { return folder_; }

 private:
  std::vector<std::string> arguments(const std::string& session) const {
    std::vector<std::string> all{"serve",
                                 folder_ / "scenario.yaml",
                                 "-o",
                                 folder_ / (session + ".lcm"),
                                 "--url",
                                 url(),
                                 "--force",
                                 "--state-folder",
                                 folder_ / "state"};
    if (!keys_.empty()) all.insert(all.end(), {"--keys", keys_});
    return all;
  }

  const int port_;
  const std::string keys_;
  TemporaryFolder folder_;
  std::unique_ptr<Process> process_;
};

}  // namespace parhelion::test
