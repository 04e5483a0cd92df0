#include "tools/slam_log.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <deque>
#include <nlohmann/json.hpp>

#include "fusion/semantic/plan_picture.hpp"
#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"

namespace parhelion {
namespace {

using Clock = std::chrono::steady_clock;

double since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// Of mapping's progress; the rest closes loops.
constexpr double reading_share = 0.5;

std::string summary_line(const SlamLogReport& report) {
  char text[512];
  std::snprintf(text, sizeof text,
                "%llu scans over %.1f s in %.1f s: %llu tracking, %llu initializing, %llu lost; step p50 "
                "%.2f p90 %.2f p99 %.2f "
                "max %.2f ms; loops %.1f s; %s trajectory; map %.12s",
                static_cast<unsigned long long>(report.scans), report.log_seconds, report.seconds,
                static_cast<unsigned long long>(report.tracking),
                static_cast<unsigned long long>(report.initializing),
                static_cast<unsigned long long>(report.lost), report.step.p50 / 1e3, report.step.p90 / 1e3,
                report.step.p99 / 1e3, report.step.max / 1e3, report.loop_seconds,
                report.causal ? "causal" : "final", report.map_id.c_str());
  return text;
}

/// A word of SLAM and when it reaches the server.
struct Word {
  ArrivalTime arrival;
  PoseEstimate estimate;
};

class LogSlam {
 public:
  LogSlam(const SlamLogOptions& options, const SlamProgress& progress, bool mapping)
      : options_(options), progress_(progress), mapping_(mapping) {}

  Result<SlamLogReport> run() {
    const Clock::time_point start = Clock::now();
    if (const Status checked = check(); !checked) return checked.error();
    if (const Status read = read_and_track(); !read) return read.error();
    if (words_.empty()) return nothing_said();
    if (mapping_) close_loops();
    report_.map = slam_->grid_map();
    report_.map_id = report_.map.id;
    if (mapping_ && !options_.save_map.empty()) {
      if (const Status saved = save_map_files(*slam_, options_.save_map); !saved) return saved.error();
    }
    count_words();
    if (!options_.output.empty()) {
      if (const Status written = write(); !written) return written.error();
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
    if (!options_.output.empty() && !options_.overwrite && std::filesystem::exists(options_.output)) {
      return Error{options_.output.string() + ": exists; choose another name or use --force"};
    }
    return {};
  }

  Error nothing_said() const {
    if (report_.scans == 0) {
      return {options_.input.string() + ": holds no event on " + options_.scan_channel +
              " that can be read; is it the right channel?"};
    }
    return {options_.input.string() + ": SLAM said nothing on " + std::to_string(report_.scans) +
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
    SlamOptions slam = options_.slam;
    if (progress_)
      slam.progress = [this](double done) {
        progress_(reading_share * 100 + (1 - reading_share) * 100 * done, 100);
      };
    auto made = mapping_ ? make_mapper(robot_, slam) : make_localizer(robot_, options_.map.string(), slam);
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
        const double share = static_cast<double>(reader->offset()) / static_cast<double>(reader->size());
        progress_(100 * (mapping_ ? reading_share : 1) * share, 100);
      }
    }
  }

  Status take(const Message& event) {
    if (event.channel == channel::robot && !slam_) {
      RobotMessage message;
      if (Status read = decode(event.channel, event.payload, message); !read) return read;
      return start(message.yaml, options_.input.string() + ", channel ROBOT");
    }
    if (event.channel != options_.scan_channel && event.channel != options_.odometry_channel) return {};
    if (!slam_) {
      return Error{options_.input.string() + ": has no " + channel::robot + " event before its first " +
                   event.channel + "; describe the robot with --robot FILE"};
    }
    if (event.channel == options_.odometry_channel) {
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
    if (report_.scans == 0) first_scan_ = event.arrival;
    report_.log_seconds = (event.arrival - first_scan_).seconds();
    ++report_.scans;
    const Clock::time_point before = Clock::now();
    auto word = slam_->add(scan);
    steps_.push_back(since(before) * 1e6);
    if (word) {
      word->step_time = {};  // measured, so it would differ from run to run
      words_.push_back({event.arrival + options_.pose_delay, std::move(*word)});
    }
    return {};
  }

  void close_loops() {
    const Clock::time_point before = Clock::now();
    const std::vector<PoseEstimate> final = slam_->finish();
    report_.loop_seconds = since(before);
    report_.causal = options_.causal;
    if (options_.causal) return;
    for (std::size_t i = 0; i < words_.size(); ++i) {
      words_[i].estimate = final[i];
      words_[i].estimate.step_time = {};
    }
  }

  void count_words() {
    report_.answered = words_.size();
    for (const Word& word : words_) {
      switch (word.estimate.state) {
        case SlamState::initializing:
          ++report_.initializing;
          break;
        case SlamState::tracking:
          ++report_.tracking;
          break;
        case SlamState::lost:
          ++report_.lost;
          break;
      }
    }
  }

  ServerStatus status() const {
    ServerStatus status;
    status.stamp = words_.front().estimate.stamp;
    status.values.emplace_back("seed", static_cast<double>(options_.slam.seed));
    status.values.emplace_back("pose_delay_ms", options_.pose_delay.seconds() * 1e3);
    status.notes.emplace_back("slam", mapping_ ? "mapping" : "localization");
    status.notes.emplace_back("trajectory", report_.causal
                                                ? "causal: what a live run says"
                                                : "final: computed with later scans, not for injection");
    status.notes.emplace_back("map_id", report_.map_id);
    return status;
  }

  /// The word's events; 1 us apart, so that arrivals stay apart.
  static Status write_word(LogWriter& writer, const Word& word) {
    std::vector<std::uint8_t> bytes;
    encode(word.estimate, bytes);
    if (Status written = writer.write(channel::pose_cov, word.arrival, bytes); !written) return written;
    if (word.estimate.state != SlamState::tracking) return {};  // POSE has no way to say so
    encode(PoseStamped{word.estimate.stamp, word.estimate.T_map_base}, bytes);
    return writer.write(channel::pose, word.arrival + microseconds(1), bytes);
  }

  Status write() {
    const std::string part = options_.output.string() + ".part";
    Status written = write_to(part);
    std::error_code failed;
    if (written) {
      std::filesystem::rename(part, options_.output, failed);
      if (failed) written = Error{options_.output.string() + ": " + failed.message()};
    }
    if (!written) std::filesystem::remove(part, failed);
    return written;
  }

  Status write_to(const std::string& path) {
    auto reader = LogReader::open(options_.input.string());
    if (!reader) return reader.error();
    auto writer = LogWriter::create(path, true);
    if (!writer) return writer.error();
    std::size_t next_word = 0;
    bool first = true;
    for (;;) {
      auto event = reader->next();
      if (!event) continue;  // counted in the first reading
      if (!event->has_value()) break;
      Message& message = **event;
      if (first && !options_.robot.empty()) {
        if (Status written = write_robot(*writer, message.arrival); !written) return written;
      }
      if (first) {
        std::vector<std::uint8_t> bytes;
        encode(status(), bytes);
        if (Status written = writer->write(slam_status_channel, message.arrival, bytes); !written)
          return written;
        first = false;
      }
      for (; next_word < words_.size() && words_[next_word].arrival < message.arrival; ++next_word) {
        if (Status written = write_word(*writer, words_[next_word]); !written) return written;
      }
      if (replaced(message.channel)) continue;
      if (Status written = writer->write(message.channel, message.arrival, message.payload); !written)
        return written;
    }
    for (; next_word < words_.size(); ++next_word) {
      if (Status written = write_word(*writer, words_[next_word]); !written) return written;
    }
    return writer->sync();
  }

  bool replaced(const std::string& channel_name) {
    if (channel_name == channel::robot) return !options_.robot.empty();
    if (channel_name != channel::pose_cov && channel_name != channel::pose &&
        channel_name != slam_status_channel)
      return false;
    ++report_.replaced;
    return true;
  }

  Status write_robot(LogWriter& writer, ArrivalTime arrival) const {
    std::vector<std::uint8_t> bytes;
    encode(RobotMessage{words_.front().estimate.stamp, to_yaml(robot_)}, bytes);
    return writer.write(channel::robot, arrival, bytes);
  }

  const SlamLogOptions& options_;
  const SlamProgress& progress_;
  bool mapping_;
  RobotDescription robot_;
  std::unique_ptr<Slam> slam_;
  std::vector<Word> words_;
  std::vector<double> steps_;
  ArrivalTime first_scan_;
  SlamLogReport report_;
};

}  // namespace

StepPercentiles percentiles(std::vector<double> microseconds) {
  if (microseconds.empty()) return {};
  std::sort(microseconds.begin(), microseconds.end());
  const auto at = [&](double share) {
    const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(microseconds.size())));
    return microseconds[std::max<std::size_t>(rank, 1) - 1];
  };
  return {at(0.5), at(0.9), at(0.99), microseconds.back()};
}

Result<SlamLogReport> map_log(const SlamLogOptions& options, const SlamProgress& progress) {
  return LogSlam(options, progress, true).run();
}

Result<SlamLogReport> localize_log(const SlamLogOptions& options, const SlamProgress& progress) {
  return LogSlam(options, progress, false).run();
}

Status save_map_files(const Slam& slam, const std::filesystem::path& prefix) {
  if (Status saved = slam.save_simplemap(prefix.string() + ".simplemap"); !saved) return saved;
  const GridMap map = slam.grid_map();
  if (Status saved = save_ros_map(map, prefix.string()); !saved) return saved;
  PlanPicture picture;
  picture.title = "Map " + prefix.filename().string();
  char text[128];
  std::snprintf(text, sizeof text, "%.1f x %.1f m, %g m a cell, id %.12s", map.width * map.resolution,
                map.height * map.resolution, map.resolution, map.id.c_str());
  picture.subtitle = text;
  picture.map = &map;
  PlanPath path{"path driven", {31, 111, 235}, {}};
  for (const Eigen::Vector3d& pose : map.path) path.points.emplace_back(pose.head<2>());
  picture.paths.push_back(std::move(path));
  return draw_plan(picture, prefix.string() + ".png");
}

Status check_raw_channel(const std::string& channel) {
  if (channel.rfind("MR_", 0) != 0) return {};
  return Error{
      "channel " + channel +
      " carries virtual returns or commands; SLAM is fed the raw scan and odometry only (SCAN, ODOMETRY)"};
}

std::string to_json(const SlamLogReport& report) {
  nlohmann::ordered_json json;
  json["scans"] = report.scans;
  json["odometry"] = report.odometry;
  json["answered"] = report.answered;
  json["tracking"] = report.tracking;
  json["lost"] = report.lost;
  json["initializing"] = report.initializing;
  json["refused"] = report.refused;
  json["replaced"] = report.replaced;
  json["causal"] = report.causal;
  json["map_id"] = report.map_id;
  json["step_us"] = {
      {"p50", report.step.p50}, {"p90", report.step.p90}, {"p99", report.step.p99}, {"max", report.step.max}};
  json["loop_seconds"] = report.loop_seconds;
  json["seconds"] = report.seconds;
  json["log_seconds"] = report.log_seconds;
  json["findings"] = report.findings;
  return json.dump(2) + "\n";
}

}  // namespace parhelion
