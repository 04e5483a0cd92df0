#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "tools/calibration/calibration_log.hpp"
#include "tools/command.hpp"
#include "tools/progress.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

constexpr const char* kDescription =
    "Measure odometry scale, mounting of the laser, time offsets of odometry, inertial sensor and camera, "
    "and the laser's own noise from a drive, and write them into the robot description";
constexpr const char* kFooter =
    "Examples:\n"
    "  parhelion calibrate drive.lcm -o robot.yaml --picture calibration.png\n"
    "  parhelion calibrate drive.lcm --map site.yaml --track-width 0.45 -o robot.yaml\n\n"
    "The end of the drive is kept for validation: odometry is compared with the scans there, before and "
    "after.\n"
    "A value that the drive does not show is kept, with a line that says which drive would show it. Height\n"
    "and tilt of the laser need images of a depth camera that is fixed to the base, and furniture.\n\n"
    "Exit code 0: the description is written. Exit code 1: the result is refused, and no description is "
    "written:\n"
    "odometry or laser are faulty, odometry agrees worse with the scans than before, or the validation part "
    "is too\n"
    "short; the reason is printed. The JSON of --summary has verdict: better, as_good (no better than "
    "before,\n"
    "within the noise of the drive), not_checked (--validation 0) or refused.";

struct Arguments {
  CalibrationOptions options;
  std::string output, summary, picture;
  bool overwrite = false, write_refused = false;
};

Exit failed(const Error& error) {
  std::fprintf(stderr, "parhelion calibrate: %s\n", error.message.c_str());
  return Exit::failed;
}

Status write(const Arguments& arguments, const CalibrationReport& report) {
  Status written;
  if (report.verdict != CalibrationVerdict::refused || arguments.write_refused)
    written = write_text(arguments.output, to_yaml(report.after), arguments.overwrite);
  if (written.ok() && !arguments.summary.empty())
    written = write_text(arguments.summary, to_json(report, arguments.options), arguments.overwrite);
  if (written.ok() && !arguments.picture.empty() && report.check_after.windows > 0)
    written = draw_calibration(report, arguments.picture);
  return written;
}

Exit run(const Arguments& arguments) {
  for (const std::string& path : {arguments.output, arguments.summary, arguments.picture}) {
    if (const Status free = check_writable(path, arguments.overwrite); !free) return failed(free.error());
  }
  if (!arguments.picture.empty() && arguments.options.validation_fraction == 0) {
    std::fprintf(stderr, "parhelion calibrate: --picture shows the validation part: raise --validation\n");
    return Exit::usage;
  }
  Progress line("calibrate", "%");
  auto report =
      calibrate_log(arguments.options, [&line](double done, double total) { line.update(done, total); });
  line.finish();
  if (!report) return failed(report.error());
  for (const std::string& finding : report->findings)
    std::fprintf(stderr, "parhelion calibrate: %s\n", finding.c_str());
  if (report->refused > 0)
    std::fprintf(stderr, "parhelion calibrate: %llu events in all could not be read\n",
                 static_cast<unsigned long long>(report->refused));
  std::fputs(to_text(*report, arguments.options).c_str(), stdout);
  if (const Status written = write(arguments, *report); !written) return failed(written.error());
  if (report->verdict != CalibrationVerdict::refused) return Exit::done;
  std::fprintf(stderr, "parhelion calibrate: the result is refused; %s is %s\n", arguments.output.c_str(),
               arguments.write_refused ? "written nevertheless" : "not written");
  return Exit::failed;
}

}  // namespace

void add_calibrate(CLI::App& app, Exit& exit) {
  auto arguments = std::make_shared<Arguments>();
  CalibrationOptions& options = arguments->options;
  CLI::App* command = app.add_subcommand("calibrate", kDescription);
  command->footer(kFooter);
  command
      ->add_option(
          "LOG", options.input,
          "LCM log of a drive, with SCAN and ODOMETRY, and where there are any IMU, CAMERA and DEPTH")
      ->required();
  command->add_option("-o,--output", arguments->output, "Robot description to write")->required();
  command->add_flag("--force", arguments->overwrite, "Overwrite files that exist");
  command->add_flag("--write-refused", arguments->write_refused,
                    "Write the description even where the result is refused; the exit code stays 1");
  command->add_option("--map", options.map,
                      ".simplemap or ROS map YAML of the site; without it the drive makes its own");
  command->add_option("--reference", options.reference_channel,
                      "Channel with poses of the base from elsewhere (pose_t), as REFERENCE_POSE");
  command->add_option("--robot", options.robot,
                      "Robot description to start from, instead of the one on ROBOT");
  command->add_option("--scan-channel", options.scan_channel, "The raw scan")->capture_default_str();
  command->add_option("--odometry-channel", options.odometry_channel, "Wheel odometry")
      ->capture_default_str();
  command->add_option("--imu-channel", options.imu_channel, "Inertial sensor")->capture_default_str();
  command->add_option("--depth-channel", options.depth_channel, "Images of the depth camera")
      ->capture_default_str();
  command->add_option("--camera-channel", options.camera_channel, "Images of the camera")
      ->capture_default_str();
  command
      ->add_option("--validation", options.validation_fraction,
                   "Fraction of the drive that only checks the result")
      ->check(CLI::Range(0.0, 0.9))
      ->capture_default_str();
  command->add_flag("--validate-on-start", options.validate_on_start,
                    "Validate on its start instead of its end");
  command
      ->add_option("--track-width", options.track_width,
                   "m, assumed by the odometry of a two-wheeled robot: reports its wheels one by one")
      ->check(CLI::Range(0.01, 10.0));
  command->add_option("--summary", arguments->summary, "JSON file for the results");
  command->add_option("--picture", arguments->picture, "PNG of the validation part, before and after");
  command->callback([arguments, &exit] { exit = run(*arguments); });
}

}  // namespace parhelion::tools
