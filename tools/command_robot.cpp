#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <memory>

#include "protocols/robot.hpp"
#include "tools/command.hpp"
#include "tools/robot/check_description.hpp"
#include "tools/robot/new_description.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

constexpr const char* kNewFooter =
    "Example: parhelion robot new --urdf rover.urdf --log drive.lcm -o rover.yaml\n\n"
    "In a terminal it asks for what neither shows; Enter takes the value in brackets. Without a terminal, or "
    "with\n"
    "--yes, it takes these values itself. Behind each value in the file is its source; those marked [guess] "
    "are to\n"
    "be measured. Afterwards `parhelion robot check` and `parhelion calibrate`.";
constexpr const char* kCheckFooter =
    "Example: parhelion robot check rover.yaml --log drive.lcm\n\n"
    "Compares sensors, angles, times, sentinels, own returns, the sense of turning, image sizes and speeds.\n"
    "Exit code 1: something contradicts.";

struct Arguments {
  std::string urdf, log, output = "-", description;
  bool yes = false, overwrite = false;
};

Exit failed(const char* command, const Error& error) {
  std::fprintf(stderr, "parhelion robot %s: %s\n", command, error.message.c_str());
  return Exit::failed;
}

/// On the terminal; an empty line takes what is likely.
std::string ask_person(const std::string& question, const std::string& likely) {
  std::fprintf(stderr, "%s [%s]: ", question.c_str(), likely.c_str());
  std::string answer;
  if (!std::getline(std::cin, answer) || answer.empty()) return likely;
  return answer;
}

void show_findings(const char* command, const std::vector<std::string>& findings) {
  for (const std::string& finding : findings)
    std::fprintf(stderr, "parhelion robot %s: warning: %s\n", command, finding.c_str());
}

Exit run_new(const Arguments& arguments) {
  if (const Status free = check_writable(arguments.output, arguments.overwrite); !free)
    return failed("new", free.error());
  const auto urdf = read_urdf_outline(arguments.urdf);
  if (!urdf) return failed("new", urdf.error());
  show_findings("new", urdf->warnings);
  std::optional<LogSurvey> log;
  if (!arguments.log.empty()) {
    auto survey = survey_log(arguments.log);
    if (!survey) return failed("new", survey.error());
    show_findings("new", survey->findings);
    log = std::move(*survey);
  }
  const bool person = !arguments.yes && isatty(STDIN_FILENO) == 1;
  const Ask likely = [](const std::string&, const std::string& value) { return value; };
  const auto text = new_description(*urdf, log, person ? Ask(ask_person) : likely);
  if (!text) return failed("new", text.error());
  if (const auto usable = parse_robot_description(*text, "the new description"); !usable)
    return failed("new", usable.error());
  const Status written = write_text(arguments.output, *text, arguments.overwrite);
  return written ? Exit::done : failed("new", written.error());
}

Exit run_check(const Arguments& arguments) {
  const auto robot = load_robot_description(arguments.description);
  if (!robot) return failed("check", robot.error());
  const auto log = survey_log(arguments.log);
  if (!log) return failed("check", log.error());
  show_findings("check", log->findings);
  const DescriptionCheck check = check_description(*robot, *log);
  for (const std::string& agreement : check.agreements) std::printf("agrees: %s\n", agreement.c_str());
  for (const std::string& contradiction : check.contradictions)
    std::printf("contradicts: %s\n", contradiction.c_str());
  return check.contradictions.empty() ? Exit::done : Exit::failed;
}

}  // namespace

void add_robot(CLI::App& app, Exit& exit) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* robot =
      app.add_subcommand("robot", "Robot descriptions: make one from a URDF and a log, check one");
  robot->require_subcommand(1);
  CLI::App* make = robot->add_subcommand("new", "Robot description from a URDF, and a log of its sensors");
  make->footer(kNewFooter);
  make->add_option("--urdf", arguments->urdf, "URDF of the robot; its meshes give the outline")->required();
  make->add_option("--log", arguments->log,
                   "LCM log with SCAN, and where there are any ODOMETRY, CAMERA, DEPTH, IMU");
  make->add_option("-o,--output", arguments->output, "File to write; - is standard output")
      ->capture_default_str();
  make->add_flag("--yes", arguments->yes, "Ask nothing, take likely values");
  make->add_flag("--force", arguments->overwrite, "Overwrite a file that exists");
  make->callback([arguments, &exit] { exit = run_new(*arguments); });
  CLI::App* check = robot->add_subcommand("check", "What a log contradicts in a robot description");
  check->footer(kCheckFooter);
  check->add_option("DESCRIPTION", arguments->description, "Robot description (YAML)")->required();
  check->add_option("--log", arguments->log, "LCM log of the robot's sensors, a minute with turns")
      ->required();
  check->callback([arguments, &exit] { exit = run_check(*arguments); });
}

}  // namespace parhelion::tools
