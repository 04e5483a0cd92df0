// parhelion grade: computes a session's score from its log.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "server/runtime/grade_session.hpp"
#include "tools/command.hpp"
#include "tools/progress.hpp"

namespace parhelion::tools {
namespace {

struct Arguments {
  std::string log;
  bool json = false;
};

Exit run(const Arguments& arguments) {
  Progress progress("grade", "MB");
  const auto session = runtime::grade_session(arguments.log, [&](std::uint64_t done, std::uint64_t all) {
    progress.update(static_cast<double>(done) / 1e6, static_cast<double>(all) / 1e6);
  });
  progress.finish();
  if (!session) {
    std::fprintf(stderr, "parhelion grade: %s\n", session.error().message.c_str());
    return Exit::failed;
  }
  std::fputs((arguments.json ? to_json(*session) : runtime::to_text(*session)).c_str(), stdout);
  return session->grade.complete ? Exit::done : Exit::failed;
}

}  // namespace

void add_grade(CLI::App& app, Exit& exit) {
  CLI::App* command =
      app.add_subcommand("grade", "Score a session by its scenario's training; deterministic");
  auto arguments = std::make_shared<Arguments>();
  command->add_option("log", arguments->log, "Session log, as serve and replay -o write it")->required();
  command->add_flag("--json", arguments->json, "For programs: every point with its event, rule and instant");
  command->footer(
      "Example: parhelion grade session.lcm\n\n"
      "Reads the log and simulates nothing. A log that stops in the middle is graded as far as it\n"
      "goes, and the command then ends with 1.");
  command->callback([arguments, &exit] { exit = run(*arguments); });
}

}  // namespace parhelion::tools
