// parhelion grade: computes a session's score from its log.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "server/runtime/grade_session.hpp"
#include "tools/command.hpp"
#include "tools/progress.hpp"

namespace parhelion::tools {
namespace {

struct Arguments {
  std::string log, robot;
  bool json = false;
};

/// For programs an object, or, of several robots, an array.
Exit print(const Arguments& arguments, const std::vector<runtime::GradedSession>& sessions) {
  std::string text;
  bool complete = true;
  std::size_t printed = 0;
  for (const runtime::GradedSession& each : sessions) {
    if (!arguments.robot.empty() && each.robot != arguments.robot) continue;
    if (arguments.json && printed > 0) text += ",\n";
    text += arguments.json ? to_json(each) : runtime::to_text(each);
    complete = complete && each.grade.complete;
    ++printed;
  }
  if (printed == 0) {
    std::fprintf(stderr, "parhelion grade: no robot '%s' is graded in %s\n", arguments.robot.c_str(),
                 arguments.log.c_str());
    return Exit::failed;
  }
  if (arguments.json && printed > 1) text = "[\n" + text + "]\n";
  std::fputs(text.c_str(), stdout);
  return complete ? Exit::done : Exit::failed;
}

Exit run(const Arguments& arguments) {
  Progress progress("grade", "MB");
  const auto sessions = runtime::grade_robots(arguments.log, [&](std::uint64_t done, std::uint64_t all) {
    progress.update(static_cast<double>(done) / 1e6, static_cast<double>(all) / 1e6);
  });
  progress.finish();
  if (!sessions) {
    std::fprintf(stderr, "parhelion grade: %s\n", sessions.error().message.c_str());
    return Exit::failed;
  }
  return print(arguments, *sessions);
}

}  // namespace

void add_grade(CLI::App& app, Exit& exit) {
  CLI::App* command =
      app.add_subcommand("grade", "Score a session by its scenario's training; deterministic");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("log", arguments->log, "Session log, as serve and replay -o write it")->required();
  command->add_option("--robot", arguments->robot, "Only this one of several graded robots");
  command->add_flag("--json", arguments->json, "For programs: every point with its event, rule and instant");
  command->footer(
      "Example: parhelion grade session.lcm\n\n"
      "Reads the log and simulates nothing. A log that stops in the middle is graded as far as it\n"
      "goes, and the command then ends with 1.");
  command->callback([arguments, &exit] { exit = run(*arguments); });
}

}  // namespace parhelion::tools
