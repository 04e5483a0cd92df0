#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <memory>
#include <sstream>

#include "protocols/robot.hpp"
#include "server/tick/configuration.hpp"
#include "tools/command.hpp"
#include "tools/robot/check_description.hpp"
#include "tools/robot/new_description.hpp"
#include "tools/robot/plausible_size.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

constexpr const char* kNewFooter =
    "Example: parhelion robot new --urdf rover.urdf --log drive.lcm -o rover.yaml\n\n"
    "In a terminal it asks for values that neither file has; Enter accepts the value in brackets. Without a\n"
    "terminal, or with --yes, it uses the values in brackets. A comment behind each value names its source.\n"
    "Measure the values marked [guess]. Then run `parhelion robot check` and `parhelion calibrate`.\n\n"
    "Exit code 1: the description is incomplete, for example without a laser; stderr names what is missing.";
constexpr const char* kCheckFooter =
    "Example: parhelion robot check rover.yaml --log drive.lcm\n\n"
    "Compares sensors, angles, times, sentinels, own returns, the sense of turning, image sizes and speeds.\n"
    "Exit code 1: something contradicts.";

struct Arguments {
  std::string urdf, log, output = "-", description;
  GivenParts given;
  bool yes = false, overwrite = false;
};

Exit failed(const char* command, const Error& error) {
  std::fprintf(stderr, "parhelion robot %s: %s\n", command, error.message.c_str());
  return Exit::failed;
}

/// On the terminal; an empty line takes what is likely.
std::optional<std::string> ask_person(const std::string& question, const std::string& likely) {
  std::fprintf(stderr, "%s [%s]: ", question.c_str(), likely.c_str());
  std::string answer;
  if (!std::getline(std::cin, answer)) return std::nullopt;
  return answer.empty() ? likely : answer;
}

/// Wrong answers are refused one by one: those before them are kept.
Dialogue dialogue(bool with_person) {
  if (!with_person) return {[](const std::string&, const std::string&) { return std::nullopt; }, {}};
  return {ask_person, [](const std::string& words) { std::fprintf(stderr, "%s\n", words.c_str()); }};
}

void show_findings(const char* command, const std::vector<std::string>& findings) {
  for (const std::string& finding : findings)
    std::fprintf(stderr, "parhelion robot %s: warning: %s\n", command, finding.c_str());
}

std::size_t lines_with(const std::string& text, const std::string& mark) {
  std::istringstream lines(text);
  std::size_t count = 0;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t comment = line.find('#');
    count += comment != std::string::npos && comment > 0 && line.find(mark, comment) != std::string::npos;
  }
  return count;
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
  const auto made = new_description(*urdf, log, dialogue(person), arguments.given);
  if (!made) return failed("new", made.error());
  const auto robot = parse_robot_description(made->text, "the new description");
  if (!robot) return failed("new", robot.error());
  const Status written = write_text(arguments.output, made->text, arguments.overwrite);
  if (!written) return failed("new", written.error());
  show_findings("new", made->notes);
  show_findings("new", implausible_values(*robot));
  if (const Status usable = tick::check_robot(*robot); !usable) return failed("new", usable.error());
  std::printf("%s: robot description '%s'; lines with a [guess]: %zu. Measure these values\n",
              arguments.output.c_str(), robot->name.c_str(), lines_with(made->text, " [guess]"));
  return Exit::done;
}

Exit run_check(const Arguments& arguments) {
  const auto robot = load_robot_description(arguments.description);
  if (!robot) return failed("check", robot.error());
  const auto log = survey_log(arguments.log);
  if (!log) return failed("check", log.error());
  show_findings("check", log->findings);
  show_findings("check", implausible_values(*robot));
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
      app.add_subcommand("robot", "Make a robot description from a URDF and a log, or check one");
  robot->require_subcommand(1);
  CLI::App* make =
      robot->add_subcommand("new", "Make a robot description from a URDF and a log of the robot's sensors");
  make->footer(kNewFooter);
  make->add_option("--urdf", arguments->urdf, "URDF of the robot; its meshes give the outline")->required();
  make->add_option("--log", arguments->log,
                   "LCM log with SCAN, and where there are any ODOMETRY, CAMERA, DEPTH, IMU");
  make->add_option("-o,--output", arguments->output, "File to write; - is standard output")
      ->capture_default_str();
  make->add_option("--laser", arguments->given.lasers,
                   "Laser on SCAN: its link, or its position X,Y,Z or X,Y,Z,YAW in base_link (m, degrees). "
                   "NAME=LINK or NAME=X,Y,Z,YAW: a further laser, on SCAN_NAME; repeat it for each")
      ->allow_extra_args(false);
  make->add_option(
      "--footprint", arguments->given.footprint,
      "Outline in place of the URDF's: LENGTH,WIDTH about base_link, or corners \"X,Y X,Y X,Y\" (m)");
  make->add_flag("--yes", arguments->yes, "Ask nothing, take likely values");
  make->add_flag("--force", arguments->overwrite, "Overwrite a file that exists");
  make->callback([arguments, &exit] { exit = run_new(*arguments); });
  CLI::App* check =
      robot->add_subcommand("check", "List the values of a robot description that a log contradicts");
  check->footer(kCheckFooter);
  check->add_option("DESCRIPTION", arguments->description, "Robot description (YAML)")->required();
  check->add_option("--log", arguments->log, "LCM log of the robot's sensors, a minute with turns")
      ->required();
  check->callback([arguments, &exit] { exit = run_check(*arguments); });
}

}  // namespace parhelion::tools
