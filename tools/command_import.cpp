#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "tools/command.hpp"
#include "tools/import/import.hpp"
#include "tools/progress.hpp"

namespace parhelion::tools {
namespace {

constexpr const char* kDescription =
    "Convert a recording of another system to an LCM log: MRPT rawlog, CARMEN log (also .gz, .bz2), ROS bag "
    "(.bag; "
    ".db3 and .mcap of ROS 2, or their folder), folder of RGB-D frames (7-Scenes, TUM)";
constexpr const char* kFooter =
    "Examples:\n  parhelion import drive.bag -o drive.lcm --topics SCAN=/front/scan,REFERENCE_POSE=/truth\n"
    "  parhelion import rosbag2_2026_11_30/ -o drive.lcm\n\n"
    "The log starts with ROBOT, the robot description. Events keep the order of the file and the sensors' "
    "own stamps;\n"
    "an event's arrival is the instant at which the source received it or, where the source does not say, "
    "its own stamp,\n"
    "and always later than the one before.\n\n"
    "Exit code 1 if the recording is cut off or damaged: the end of a bag, a rawlog or a compressed log, a "
    "line that is\n"
    "not complete, an image of an RGB-D folder that cannot be read. OUT then has what could be read.";

/// "SCAN=/scan,CAMERA=none" as CLI11 splits it.
bool parse_topics(const std::vector<std::string>& assignments, ImportOptions& options) {
  for (const std::string& assignment : assignments) {
    const auto equals = assignment.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == assignment.size()) {
      std::fprintf(stderr,
                   "parhelion import: --topics '%s': expected CHANNEL=TOPIC, such as SCAN=/front/scan\n",
                   assignment.c_str());
      return false;
    }
    options.topics[assignment.substr(0, equals)] = assignment.substr(equals + 1);
  }
  return true;
}

Exit run(ImportOptions options, const std::vector<std::string>& topics) {
  if (!parse_topics(topics, options)) return Exit::usage;
  if (options.scan_low >= options.scan_high) {
    std::fprintf(stderr, "parhelion import: --scan-band %g %g: the lower edge comes first\n",
                 options.scan_low, options.scan_high);
    return Exit::usage;
  }
  Progress progress("import", "MB");
  constexpr double megabyte = 1e6;
  const auto report = import_recording(
      options, [&](double done, double total) { progress.update(done / megabyte, total / megabyte); });
  progress.finish();
  if (!report) {
    std::fprintf(stderr, "parhelion import: %s\n", report.error().message.c_str());
    return Exit::failed;
  }
  for (const std::string& line : findings(*report))
    std::fprintf(stderr, "parhelion import: %s\n", line.c_str());
  std::printf("%s\n", summary_line(*report).c_str());
  return report->damaged > 0 ? Exit::failed : Exit::done;
}

struct Arguments {
  ImportOptions options;
  std::vector<std::string> topics;
  std::vector<double> band;
};

}  // namespace

void add_import(CLI::App& app, Exit& exit) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("import", kDescription);
  command->footer(kFooter);
  ImportOptions& options = arguments->options;
  command->add_option("IN", options.input, "Recording: a file, or a folder: of ROS 2, or of RGB-D frames")
      ->required();
  command->add_option("-o,--output", options.output, "LCM log to write")->required();
  command->add_flag("--force", options.overwrite, "Overwrite OUT");
  command
      ->add_option("--topics", arguments->topics,
                   "CHANNEL=TOPIC,... where the source has several (rawlog: sensor labels); CHANNEL=none "
                   "leaves it out")
      ->delimiter(',');
  command->add_option("--urdf", options.urdf, "File for the robot's URDF, if the ROS bag contains it");
  command->add_option("--robot-name", options.robot_name,
                      "Name in the robot description; default: IN's name");
  command
      ->add_option("--laser", options.laser_preset, "Preset of the laser (lms-200, s3000, ...), auto or none")
      ->capture_default_str();
  command->add_option("--laser-height", options.laser_height, "m above the floor, if IN does not contain it")
      ->capture_default_str();
  command
      ->add_option("--scan-band", arguments->band,
                   "LOW HIGH: m above the floor; band of the depth image for SCAN")
      ->expected(2)
      ->default_str("0.2 0.5");
  command
      ->add_option("--frame-rate", options.frame_rate,
                   "Frame rate of numbered RGB-D frames, which have no stamps, Hz")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->callback([arguments, &exit] {
    if (arguments->band.size() == 2) {
      arguments->options.scan_low = arguments->band[0];
      arguments->options.scan_high = arguments->band[1];
    }
    exit = run(arguments->options, arguments->topics);
  });
}

}  // namespace parhelion::tools
