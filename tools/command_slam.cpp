#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <deque>
#include <memory>
#include <optional>

#include "protocols/bus/bus.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/yaml/document.hpp"
#include "tools/bus_options.hpp"
#include "tools/command.hpp"
#include "tools/place_argument.hpp"
#include "tools/progress.hpp"
#include "tools/slam/slam_log.hpp"
#include "tools/text_file.hpp"

namespace parhelion::tools {
namespace {

constexpr const char* kDescription =
    "Localize in a map, or build one: SCAN and ODOMETRY in, POSE_COV and POSE out. Live on the bus, or over "
    "a log with --log";
constexpr const char* kFooter =
    "Examples:\n"
    "  parhelion slam --log drive.lcm -o mapped.lcm --save-map site     # builds site.simplemap, .yaml, "
    ".pgm, .png\n"
    "  parhelion slam --log drive.lcm -o located.lcm --map site.yaml --start 0,0,0\n"
    "  parhelion slam --map site.simplemap                              # live, finds itself\n"
    "  parhelion slam --log drive.lcm --engine mrpt-rbpf --save-map site  # MRPT's particle filter\n\n"
    "The same log gives the same bytes; step times are in the summary only. Mapping writes the final\n"
    "trajectory, marked as not causal. For injection use --causal, or localize in a map.";

volatile std::sig_atomic_t stop_asked = 0;
void ask_to_stop(int) { stop_asked = 1; }

struct Arguments {
  SlamLogOptions options;
  std::string start, delay = "20ms", summary, engine = "parhelion";
  bool no_odometry = false;
  BusOptions bus;
};

Exit usage(const std::string& what) {
  std::fprintf(stderr, "parhelion slam: %s\n", what.c_str());
  return Exit::usage;
}

Exit failed(const Error& error) {
  std::fprintf(stderr, "parhelion slam: %s\n", error.message.c_str());
  return Exit::failed;
}

/// "20ms", "0.02s" or "500us".
bool parse_delay(const std::string& text, Duration& delay) {
  double value = 0;
  char unit[4] = "";
  if (std::sscanf(text.c_str(), "%lf%3s", &value, unit) != 2 || !(value >= 0)) return false;
  const std::string u = unit;
  const double scale = u == "us" ? 1e-6 : u == "ms" ? 1e-3 : u == "s" ? 1 : -1;
  if (scale < 0 || value * scale > 60) return false;
  delay = seconds(value * scale);
  return true;
}

void print_map_files(const std::filesystem::path& prefix) {
  std::printf("map: %s\n", joined_map_files(prefix).c_str());
}

Exit over_log(const Arguments& arguments) {
  const SlamLogOptions& options = arguments.options;
  Progress line("slam", "%");
  const SlamProgress progress = [&line](double done, double total) { line.update(done, total); };
  const auto report = options.map.empty() ? map_log(options, progress) : localize_log(options, progress);
  line.finish();
  if (!report) return failed(report.error());
  for (const std::string& finding : report->findings)
    std::fprintf(stderr, "parhelion slam: %s\n", finding.c_str());
  for (const pose::OdometryFinding& finding : report->odometry_findings)
    std::fprintf(stderr, "parhelion slam: %s\n", dated(finding, report->first_scan).c_str());
  if (const std::string note = offset_note(report->odometry_offset); !note.empty())
    std::fprintf(stderr, "parhelion slam: note: %s\n", note.c_str());
  std::printf("%s\n", report->summary.c_str());
  if (options.map.empty() && !options.save_map.empty()) print_map_files(options.save_map);
  if (!arguments.summary.empty()) {
    const Status written = write_text(arguments.summary, to_json(*report), options.overwrite);
    if (!written) return failed(written.error());
  }
  if (options.map.empty() || report->tracking > 0) return Exit::done;
  return failed(Error{options.map.string() + ": the robot of " + options.input.string() +
                      " was not found in it; give its first pose with --start X,Y,YAW, or check that the "
                      "map is of the same place"});
}

constexpr const char* kStates[] = {"initializing: not localized yet", "tracking: localized",
                                   "lost: scans do not fit the map; the server injects nothing",
                                   "unsure: the pose is a guess; the server injects nothing"};

/// SLAM on the bus; ends at SIGINT or SIGTERM.
class LiveSlam {
 public:
  explicit LiveSlam(const SlamLogOptions& options) : options_(options) {}

  Status run(const BusOptions& options) {
    for (const std::string& channel : {options_.scan_channel, options_.odometry_channel}) {
      if (Status raw = check_raw_channel(channel); !raw) return raw;
    }
    auto bus = options.open("slam");
    if (!bus) return bus.error();
    bus_ = std::move(*bus);
    if (!options_.robot.empty()) {
      auto robot = load_robot_description(options_.robot.string());
      if (!robot) return robot.error();
      if (Status made = start(*robot); !made) return made;
    }
    // Odometry and attitude are interpolated and needed completely; of scans only the newest few are
    // processed.
    for (const auto& [channel, capacity] : {std::pair{options_.odometry_channel, 200},
                                            {options_.own(channel::kImu), 1000},
                                            {options_.scan_channel, 5},
                                            {options_.own(channel::kRobot), 1}}) {
      if (Status subscribed = bus_->subscribe(channel, capacity); !subscribed) return subscribed;
    }
    std::signal(SIGINT, ask_to_stop);
    std::signal(SIGTERM, ask_to_stop);
    const std::string also = options_.slam.has_odometry ? " and " + options_.odometry_channel : "";
    std::fprintf(stderr, "parhelion slam: waiting for %s%s\n", options_.scan_channel.c_str(), also.c_str());
    Message message;
    while (stop_asked == 0) {
      const auto received = bus_->receive(message, milliseconds(100));
      if (!received) return received.error();
      if (!*received) continue;
      if (Status taken = take(message); !taken) return taken;
    }
    return finish();
  }

  std::vector<double> steps;

 private:
  Status start(const RobotDescription& robot) {
    auto made = options_.map.empty() ? pose::make_mapper(robot, options_.slam)
                                     : pose::make_localizer(robot, options_.map.string(), options_.slam);
    if (!made) return made.error();
    slam_ = std::move(*made);
    return {};
  }

  /// Messages that cannot be decoded are reported and skipped: one bad message must not end a live run.
  template <class T>
  static bool read(const Message& message, T& item) {
    const Status status = decode(message.channel, message.payload, item);
    if (!status) std::fprintf(stderr, "parhelion slam: %s\n", status.error().message.c_str());
    return status.ok();
  }

  Status take(const Message& message) {
    if (message.channel == options_.own(channel::kRobot)) {
      RobotMessage robot_message;
      if (slam_ || !read(message, robot_message)) return {};
      auto robot = parse_robot_description(robot_message.yaml, "channel " + message.channel);
      return robot ? start(*robot) : Status(robot.error());
    }
    if (!slam_) {
      if (!asked_for_robot_)
        std::fprintf(stderr, "parhelion slam: no ROBOT message yet; describe the robot with --robot FILE\n");
      asked_for_robot_ = true;
      return {};
    }
    if (message.channel == options_.own(channel::kImu)) {
      ImuSample sample;
      if (read(message, sample)) slam_->add_inertial(sample);
      return {};
    }
    if (message.channel == options_.odometry_channel) {
      Odometry odometry;
      if (!read(message, odometry)) return {};
      if (options_.slam.has_odometry)
        slam_->add(odometry);
      else
        warn_of_other(odometry);
      return {};
    }
    Scan scan;
    return read(message, scan) ? answer(scan) : Status{};
  }

  /// What this program has published comes back to it.
  void warn_of_other(const Odometry& odometry) {
    if (warned_ || std::find(made_.begin(), made_.end(), odometry.stamp) != made_.end()) return;
    warned_ = true;
    std::fprintf(stderr,
                 "parhelion slam: %s: another program publishes odometry, too; if it is the robot's, omit "
                 "--no-odometry\n",
                 options_.odometry_channel.c_str());
  }

  void print_new_findings() {
    const auto findings = slam_->odometry_findings();
    for (; printed_ < findings.size(); ++printed_)
      std::fprintf(stderr, "parhelion slam: %s\n", findings[printed_].text.c_str());
  }

  Status answer(const Scan& scan) {
    const auto before = std::chrono::steady_clock::now();
    auto word = slam_->add(scan);
    const auto took = std::chrono::steady_clock::now() - before;
    steps.push_back(std::chrono::duration<double, std::micro>(took).count());
    if (!word) return {};
    print_new_findings();
    if (word->state != state_) {
      std::fprintf(stderr, "parhelion slam: %s\n", kStates[static_cast<std::size_t>(word->state)]);
      state_ = word->state;
    }
    if (const auto odometry = slam_->odometry_by_scans()) {
      constexpr std::size_t kRemembered = 100;
      made_.push_back(odometry->stamp);
      if (made_.size() > kRemembered) made_.pop_front();
      encode(*odometry, bytes_);
      if (Status sent = bus_->publish(options_.odometry_channel, bytes_); !sent) return sent;
    }
    word->step_time = nanoseconds(std::chrono::duration_cast<std::chrono::nanoseconds>(took).count());
    encode(*word, bytes_);
    if (Status sent = bus_->publish(options_.own(channel::kPoseCov), bytes_); !sent) return sent;
    if (word->state != SlamState::tracking) return {};
    encode(PoseStamped{word->stamp, word->T_map_base}, bytes_);
    return bus_->publish(options_.own(channel::kPose), bytes_);
  }

  Status finish() {
    if (!slam_ || !options_.map.empty() || options_.save_map.empty()) return {};
    Progress loops("closing loops", "%");
    slam_->finish();
    const Status saved = save_map_files(*slam_, options_.save_map, options_.overwrite);
    if (saved) print_map_files(options_.save_map);
    return saved;
  }

  const SlamLogOptions& options_;
  std::unique_ptr<Bus> bus_;
  std::unique_ptr<pose::Slam> slam_;
  std::vector<std::uint8_t> bytes_;
  bool asked_for_robot_ = false, warned_ = false;
  std::deque<SensorTime> made_;     ///< stamps of the odometry that was published last
  std::optional<SlamState> state_;  ///< the last that was printed
  std::size_t printed_ = 0;         ///< findings
};

Exit live(const Arguments& arguments) {
  LiveSlam slam(arguments.options);
  if (const Status ended = slam.run(arguments.bus); !ended) return failed(ended.error());
  const StepPercentiles step = percentiles(slam.steps);
  std::printf("%zu scans; step p50 %.2f p90 %.2f p99 %.2f max %.2f ms\n", slam.steps.size(), step.p50 / 1e3,
              step.p90 / 1e3, step.p99 / 1e3, step.max / 1e3);
  return Exit::done;
}

Exit run(Arguments& arguments) {
  SlamLogOptions& options = arguments.options;
  if (!arguments.start.empty()) {
    const auto start = parse_place(arguments.start, true);
    if (!start) return usage("--start '" + arguments.start + "': " + start.error().message);
    options.slam.start = *start;
  }
  if (!options.robot_name.empty()) {
    if (const std::string fault = robot_name_fault(options.robot_name); !fault.empty())
      return usage("--robot-name: " + fault);
    if (options.scan_channel == channel::kScan) options.scan_channel = options.own(channel::kScan);
    if (options.odometry_channel == channel::kOdometry)
      options.odometry_channel = options.own(channel::kOdometry);
  }
  if (!parse_delay(arguments.delay, options.pose_delay))
    return usage("--pose-delay '" + arguments.delay + "': expected a time such as 20ms, 0.02s, at most 60s");
  options.slam.has_odometry = !arguments.no_odometry;
  options.slam.engine = pose::slam_engine(arguments.engine).value_or(pose::SlamEngine::parhelion);
  const bool localizing = !options.map.empty();
  for (const Status& free : {check_map_files(localizing ? "" : options.save_map, options.overwrite),
                             check_writable(arguments.summary, options.overwrite)}) {
    if (!free) return failed(free.error());
  }
  if (localizing && !options.save_map.empty()) return usage("--save-map is for mapping: omit --map");
  if (options.input.empty() && (!options.output.empty() || !arguments.summary.empty()))
    return usage("-o and --summary need --log");
  if (!options.input.empty() && options.output.empty() && options.save_map.empty() &&
      arguments.summary.empty()) {
    return usage("--log needs -o, --save-map or --summary");
  }
  if (options.map.extension() == ".yaml") {
    if (const Status readable = yaml::check_file(options.map.string()); !readable)
      return failed(readable.error());
  }
  return options.input.empty() ? live(arguments) : over_log(arguments);
}

}  // namespace

void add_slam(CLI::App& app, Exit& exit) {
  auto arguments = std::make_shared<Arguments>();
  SlamLogOptions& options = arguments->options;
  CLI::App* command = app.add_subcommand("slam", kDescription);
  command->footer(kFooter);
  command->add_option("--log", options.input, "LCM log to read; without it: live on the bus");
  command->add_option("-o,--output", options.output,
                      "LCM log to write: the events of --log, with POSE_COV and POSE");
  command->add_flag("--force", options.overwrite, "Overwrite files that exist");
  command->add_option("--map", options.map,
                      ".simplemap or ROS map YAML to localize in; without it a map is built");
  command->add_option("--start", arguments->start,
                      std::string(kPlaceFormat) + "; without it the whole map is searched");
  command->add_option("--save-map", options.save_map, "PREFIX: writes PREFIX.simplemap, .yaml, .pgm, .png");
  command->add_option("--resolution", options.slam.resolution, "m per cell of the grid map")
      ->capture_default_str();
  command->add_flag("--causal", options.causal,
                    "Mapping: the estimates of a live run, not the final trajectory");
  command
      ->add_option("--engine", arguments->engine,
                   "parhelion; or MRPT's: mrpt-icp and mrpt-rbpf build a map, mrpt-localization needs --map")
      ->check(CLI::IsMember(pose::slam_engines()))
      ->capture_default_str();
  command
      ->add_option("--mrpt-config", options.slam.engine_config,
                   "Configuration file of MRPT's icp-slam, rbpf-slam or pf-localization, for its engines")
      ->check(CLI::ExistingFile);
  command->add_option("--seed", options.slam.seed, "Random seed")->capture_default_str();
  command->add_option("--pose-delay", arguments->delay, "Delay of a pose after its scan, with --log")
      ->capture_default_str();
  command->add_option("--robot", options.robot, "Robot description, instead of the one on ROBOT");
  command->add_option(
      "--robot-name", options.robot_name,
      "With several robots: the one whose channels are used (SCAN.NAME, ODOMETRY.NAME, POSE_COV.NAME)");
  command->add_option("--scan-channel", options.scan_channel, "The raw scan")->capture_default_str();
  command->add_option("--odometry-channel", options.odometry_channel, "Wheel odometry")
      ->capture_default_str();
  command->add_flag("--no-odometry", arguments->no_odometry,
                    "The robot reports no odometry: make it from the scans, and publish it on ODOMETRY");
  command->add_option("--summary", arguments->summary, "JSON file for counts and times, with --log");
  arguments->bus.add_to(*command);
  command->callback([arguments, &exit] { exit = run(*arguments); });
}

}  // namespace parhelion::tools
