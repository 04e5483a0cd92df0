#include "tools/slam/slam_log.hpp"

#include <chrono>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "tools/slam/slam_log_writer.hpp"
#include "tools/slam/slam_report.hpp"
#include "tools/text_file.hpp"
#include "tools/validate_log.hpp"

namespace parhelion::tools {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Part of the mapping progress; the rest is loop closure.
constexpr double kReadingFraction = 0.5;

class LogSlam {
 public:
  LogSlam(const SlamLogOptions& options, const SlamProgress& progress, bool mapping)
      : options_(options), progress_(progress), mapping_(mapping) {}

  Result<SlamLogReport> run() {
    const Clock::time_point start = Clock::now();
    if (const Status checked = check(); !checked) return checked.error();
    if (const Status read = read_and_track(); !read) return read.error();
    if (outputs_.empty()) return no_output_error();
    if (mapping_) close_loops();
    report_.map = slam_->grid_map();
    report_.map_id = report_.map.id;
    if (mapping_ && !options_.save_map.empty()) {
      const Status saved = save_map_files(*slam_, options_.save_map, options_.overwrite);
      if (!saved) return saved.error();
    }
    count(outputs_, report_);
    report_.odometry_findings = slam_->odometry_findings();
    report_.odometry_offset = slam_->odometry_offset();
    if (!options_.output.empty()) {
      const SlamTrajectory trajectory{outputs_, robot_, mapping_, report_.causal, report_.map_id};
      const auto replaced = write_slam_log(options_, trajectory);
      if (!replaced) return replaced.error();
      report_.replaced = *replaced;
    }
    report_.step = percentiles(std::move(steps_));
    report_.seconds = since(start);
    report_.summary = summary_line(report_);
    return std::move(report_);
  }

 private:
  Status check() const {
    for (const std::string& channel : {options_.scan_channel, options_.odometry_channel}) {
      if (Status raw = check_raw_channel(channel); !raw) return raw;
    }
    std::error_code ignored;
    if (!options_.output.empty() && std::filesystem::equivalent(options_.input, options_.output, ignored)) {
      return Error{options_.output.string() + ": is the input; choose another name for the output"};
    }
    if (const Status free = check_writable(options_.output, options_.overwrite); !free) return free;
    return mapping_ ? check_map_files(options_.save_map, options_.overwrite) : Status{};
  }

  Error no_output_error() const {
    const auto holds_none = [this](const std::string& channel) {
      return holds_no_event(options_.input.string(), channel, report_.findings);
    };
    if (report_.scans == 0) return holds_none(options_.scan_channel);
    if (report_.odometry == 0 && options_.slam.has_odometry) {
      return {holds_none(options_.odometry_channel).message +
              " For a robot that reports no odometry give --no-odometry"};
    }
    return {options_.input.string() + ": SLAM gave no estimate for " + std::to_string(report_.scans) +
            " scans: no " + options_.odometry_channel + " came before any of them, or all scans were empty"};
  }

  void find(std::string what) {
    ++report_.refused;
    if (report_.findings.size() < 20) report_.findings.push_back(std::move(what));
  }

  Status start(const std::string& yaml, const std::string& origin) {
    auto robot = options_.robot.empty() ? parse_robot_description(yaml, origin)
                                        : load_robot_description(options_.robot.string());
    if (!robot) return robot.error();
    robot_ = std::move(*robot);
    pose::SlamOptions slam = options_.slam;
    if (progress_)
      slam.progress = [this](double done) {
        progress_(kReadingFraction * 100 + (1 - kReadingFraction) * 100 * done, 100);
      };
    auto made = mapping_ ? pose::make_mapper(robot_, slam)
                         : pose::make_localizer(robot_, options_.map.string(), slam);
    if (!made) return made.error();
    slam_ = std::move(*made);
    return {};
  }

  Status read_and_track() {
    auto reader = LogReader::open(options_.input.string());
    if (!reader) return reader.error();
    if (!options_.robot.empty()) {
      if (Status started = start({}, {}); !started) return started;
    }
    for (;;) {
      auto event = reader->next();
      if (!event) {
        find(event.error().message);
        continue;
      }
      if (!event->has_value()) return {};
      if (Status taken = take(**event); !taken) return taken;
      if (progress_) {
        const double fraction = static_cast<double>(reader->offset()) / static_cast<double>(reader->size());
        progress_(100 * (mapping_ ? kReadingFraction : 1) * fraction, 100);
      }
    }
  }

  Status take(const Message& event) {
    if (event.channel == options_.own(channel::kRobot) && !slam_) {
      RobotMessage message;
      if (Status read = decode(event.channel, event.payload, message); !read) return read;
      return start(message.yaml, options_.input.string() + ", channel ROBOT");
    }
    if (event.channel == options_.own(channel::kImu) && slam_) {
      ImuSample sample;
      if (const Status read = decode(event.channel, event.payload, sample); read.ok())
        slam_->add_inertial(sample);
      else
        find(read.error().message);
      return {};
    }
    if (event.channel != options_.scan_channel && event.channel != options_.odometry_channel) return {};
    if (!slam_) {
      return Error{options_.input.string() + ": has no " + options_.own(channel::kRobot) +
                   " event before its first " + event.channel + "; describe the robot with --robot FILE"};
    }
    if (event.channel == options_.odometry_channel) {
      if (!options_.slam.has_odometry) return {};
      Odometry odometry;
      if (const Status read = decode(event.channel, event.payload, odometry); !read) {
        find(read.error().message);
        return {};
      }
      ++report_.odometry;
      slam_->add(odometry);
      return {};
    }
    Scan scan;
    if (const Status read = decode(event.channel, event.payload, scan); !read) {
      find(read.error().message);
      return {};
    }
    if (report_.scans == 0) {
      first_scan_ = event.arrival;
      report_.first_scan = scan.stamp;
    }
    report_.log_seconds = (event.arrival - first_scan_).seconds();
    ++report_.scans;
    const Clock::time_point before = Clock::now();
    auto estimate = slam_->add(scan);
    steps_.push_back(since(before) * 1e6);
    if (estimate) {
      estimate->step_time = {};  // measured, so different in each run
      outputs_.push_back(
          {event.arrival + options_.pose_delay, std::move(*estimate), slam_->odometry_by_scans()});
    }
    return {};
  }

  void close_loops() {
    const Clock::time_point before = Clock::now();
    const std::vector<PoseEstimate> final = slam_->finish();
    report_.loop_seconds = since(before);
    report_.causal = options_.causal;
    if (options_.causal) return;
    for (std::size_t i = 0; i < outputs_.size(); ++i) {
      outputs_[i].estimate = final[i];
      outputs_[i].estimate.step_time = {};
    }
  }

  const SlamLogOptions& options_;
  const SlamProgress& progress_;
  bool mapping_;
  RobotDescription robot_;
  std::unique_ptr<pose::Slam> slam_;
  std::vector<SlamOutput> outputs_;
  std::vector<double> steps_;
  ArrivalTime first_scan_;
  SlamLogReport report_;
};

}  // namespace

Result<SlamLogReport> map_log(const SlamLogOptions& options, const SlamProgress& progress) {
  return LogSlam(options, progress, true).run();
}

Result<SlamLogReport> localize_log(const SlamLogOptions& options, const SlamProgress& progress) {
  return LogSlam(options, progress, false).run();
}

Status check_raw_channel(const std::string& channel) {
  if (channel.rfind("MR_", 0) != 0) return {};
  return Error{
      "channel " + channel +
      " contains virtual returns or commands; SLAM gets the raw scan and odometry only (SCAN, ODOMETRY)"};
}

}  // namespace parhelion::tools
