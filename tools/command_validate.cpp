#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "server/runtime/session_files.hpp"
#include "server/training/briefing.hpp"
#include "tools/command.hpp"
#include "tools/validate.hpp"

namespace parhelion::tools {
namespace {

constexpr const char* kDescription =
    "Check files: scenario (with the model and robot that it names), course, semantic model, robot "
    "description, "
    "laser preset, ROS map, LCM log";
constexpr const char* kFooter =
    "Example:\n  parhelion validate lab.yaml drive.lcm\n  parhelion validate --briefing scenario.yaml\n\n"
    "Prints one line per file, for a log one more per channel. Errors go to stderr with file and line, "
    "channel or offset;\n"
    "exit code 1 if there are any.";

/// For a person; the scenario has passed the checks.
void print_briefing(const std::string& path) {
  const auto files = runtime::load_session_files(path, "");
  if (!files) return;
  const Scenario& scenario = files->scenario;
  const std::string named = scenario.training ? scenario.training->robot : "";
  std::vector<std::string> robots;
  if (named.empty())
    for (const ScenarioRobot& robot : scenario.robots) robots.push_back(robot.name);
  if (robots.empty()) {
    robots.push_back(!named.empty()     ? named
                     : scenario.trainee ? scenario.trainee->name
                     : files->robot     ? files->robot->name
                                        : "the robot");
  }
  const std::string text = training::briefing(scenario, robots);
  std::printf("%s", text.empty() ? "the scenario has no 'training': there is no briefing\n" : text.c_str());
}

Exit run(const std::vector<std::string>& paths, bool with_briefing) {
  Exit exit = Exit::done;
  for (const std::string& path : paths) {
    const Validation validation = validate_file(path);
    for (const std::string& error : validation.errors)
      std::fprintf(stderr, "parhelion validate: %s\n", error.c_str());
    if (!validation.errors.empty()) exit = Exit::failed;
    const char* result = validation.errors.empty() ? "ok" : "bad";
    std::printf("%s: %s%s%s\n", path.c_str(), result, validation.summary.empty() ? "" : ": ",
                validation.summary.c_str());
    for (const std::string& note : validation.notes) std::printf("  %s\n", note.c_str());
    if (with_briefing && validation.errors.empty()) print_briefing(path);
  }
  return exit;
}

}  // namespace

void add_validate(CLI::App& app, Exit& exit) {
  auto paths = std::make_shared<std::vector<std::string>>();
  CLI::App* command = app.add_subcommand("validate", kDescription);
  command->footer(kFooter);
  command->add_option("FILE", *paths, "Files to check")->required();
  auto with_briefing = std::make_shared<bool>(false);
  command->add_flag("--briefing", *with_briefing, "Print the briefing of a scenario's trainee");
  command->callback([paths, with_briefing, &exit] { exit = run(*paths, *with_briefing); });
}

}  // namespace parhelion::tools
