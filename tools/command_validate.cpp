#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "tools/command.hpp"
#include "tools/validate.hpp"

namespace parhelion {
namespace {

constexpr const char* description =
    "Check files: scenario (with the model and robot that it names), course, semantic model, robot "
    "description, "
    "laser preset, ROS map, LCM log";
constexpr const char* footer =
    "Example:\n  parhelion validate lab.yaml drive.lcm\n\n"
    "Prints one line per file, for a log one more per channel. Errors go to stderr with file and line, "
    "channel or offset;\n"
    "exit code 1 where there are any.";

Exit run(const std::vector<std::string>& paths) {
  Exit exit = Exit::done;
  for (const std::string& path : paths) {
    const Verdict verdict = validate_file(path);
    for (const std::string& error : verdict.errors)
      std::fprintf(stderr, "parhelion validate: %s\n", error.c_str());
    if (!verdict.errors.empty()) exit = Exit::failed;
    const char* result = verdict.errors.empty() ? "ok" : "bad";
    std::printf("%s: %s%s%s\n", path.c_str(), result, verdict.summary.empty() ? "" : ": ",
                verdict.summary.c_str());
    for (const std::string& note : verdict.notes) std::printf("  %s\n", note.c_str());
  }
  return exit;
}

}  // namespace

void add_validate(CLI::App& app, Exit& exit) {
  auto paths = std::make_shared<std::vector<std::string>>();
  CLI::App* command = app.add_subcommand("validate", description);
  command->footer(footer);
  command->add_option("FILE", *paths, "Files to check")->required();
  command->callback([paths, &exit] { exit = run(*paths); });
}

}  // namespace parhelion
