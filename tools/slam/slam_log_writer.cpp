#include "tools/slam/slam_log_writer.hpp"

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"

namespace parhelion::tools {
namespace {

class SlamLogWriter {
 public:
  SlamLogWriter(const SlamLogOptions& options, const SlamTrajectory& trajectory)
      : options_(options), trajectory_(trajectory) {}

  Result<std::uint64_t> write() {
    const std::string part = options_.output.string() + ".part";
    Status written = write_to(part);
    std::error_code failed;
    if (written) {
      std::filesystem::rename(part, options_.output, failed);
      if (failed) written = Error{options_.output.string() + ": " + failed.message()};
    }
    if (!written) std::filesystem::remove(part, failed);
    if (!written) return written.error();
    return replaced_;
  }

 private:
  ServerStatus status() const {
    ServerStatus status;
    status.stamp = trajectory_.outputs.front().estimate.stamp;
    status.values.emplace_back("seed", static_cast<double>(options_.slam.seed));
    status.values.emplace_back("pose_delay_ms", options_.pose_delay.seconds() * 1e3);
    status.notes.emplace_back("slam", trajectory_.mapping ? "mapping" : "localization");
    status.notes.emplace_back("trajectory", trajectory_.causal
                                                ? "causal: as in a live run"
                                                : "final: computed with later scans, not for injection");
    status.notes.emplace_back("map_id", trajectory_.map_id);
    return status;
  }

  /// Writes the estimate's events 1 us apart, so that arrivals are distinct.
  Status write_output(LogWriter& writer, const SlamOutput& output) const {
    std::vector<std::uint8_t> bytes;
    if (output.odometry) {
      encode(*output.odometry, bytes);
      if (Status written = writer.write(options_.odometry_channel, output.arrival, bytes); !written)
        return written;
    }
    const ArrivalTime arrival = output.odometry ? output.arrival + microseconds(1) : output.arrival;
    encode(output.estimate, bytes);
    if (Status written = writer.write(options_.own(channel::kPoseCov), arrival, bytes); !written)
      return written;
    if (output.estimate.state != SlamState::tracking) return {};  // POSE cannot represent this state
    encode(PoseStamped{output.estimate.stamp, output.estimate.T_map_base}, bytes);
    return writer.write(options_.own(channel::kPose), arrival + microseconds(1), bytes);
  }

  Status write_to(const std::string& path) {
    auto reader = LogReader::open(options_.input.string());
    if (!reader) return reader.error();
    auto writer = LogWriter::create(path, true);
    if (!writer) return writer.error();
    std::size_t next_output = 0;
    bool first = true;
    for (;;) {
      auto event = reader->next();
      if (!event) continue;  // counted in the first pass
      if (!event->has_value()) break;
      Message& message = **event;
      if (first && !options_.robot.empty()) {
        if (Status written = write_robot(*writer, message.arrival); !written) return written;
      }
      if (first) {
        std::vector<std::uint8_t> bytes;
        encode(status(), bytes);
        if (Status written = writer->write(kSlamStatusChannel, message.arrival, bytes); !written)
          return written;
        first = false;
      }
      for (; next_output < trajectory_.outputs.size() &&
             trajectory_.outputs[next_output].arrival < message.arrival;
           ++next_output) {
        if (Status written = write_output(*writer, trajectory_.outputs[next_output]); !written)
          return written;
      }
      if (is_replaced(message.channel)) continue;
      if (Status written = writer->write(message.channel, message.arrival, message.payload); !written)
        return written;
    }
    for (; next_output < trajectory_.outputs.size(); ++next_output) {
      if (Status written = write_output(*writer, trajectory_.outputs[next_output]); !written) return written;
    }
    return writer->sync();
  }

  bool is_replaced(const std::string& channel_name) {
    if (channel_name == options_.own(channel::kRobot)) return !options_.robot.empty();
    const bool is_made = !options_.slam.has_odometry && channel_name == options_.odometry_channel;
    if (!is_made && channel_name != options_.own(channel::kPoseCov) &&
        channel_name != options_.own(channel::kPose) && channel_name != kSlamStatusChannel)
      return false;
    ++replaced_;
    return true;
  }

  Status write_robot(LogWriter& writer, ArrivalTime arrival) const {
    std::vector<std::uint8_t> bytes;
    encode(RobotMessage{trajectory_.outputs.front().estimate.stamp, to_yaml(trajectory_.robot)}, bytes);
    return writer.write(options_.own(channel::kRobot), arrival, bytes);
  }

  const SlamLogOptions& options_;
  const SlamTrajectory& trajectory_;
  std::uint64_t replaced_ = 0;
};

}  // namespace

Result<std::uint64_t> write_slam_log(const SlamLogOptions& options, const SlamTrajectory& trajectory) {
  return SlamLogWriter(options, trajectory).write();
}

}  // namespace parhelion::tools
