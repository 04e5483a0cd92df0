#include "tools/validate_log.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>

#include "protocols/bus/log_file.hpp"
#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/model.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"
#include "server/tick/configuration.hpp"
#include "server/tick/robot_descriptions.hpp"
#include "tools/channel_statistics.hpp"

namespace parhelion::tools {
namespace {

constexpr std::size_t kErrorsShown = 20;
constexpr Duration kLeap = seconds(60.0);  // between two events: a pause, or a clock that was set

template <class T>
Status decodes(std::string_view channel, Bytes bytes) {
  T message;
  return decode(channel, bytes, message);
}

/// The YAML in a message must be valid too, because replay would stop there.
Status robot_message(std::string_view channel, Bytes bytes) {
  RobotMessage message;
  if (const Status status = decode(channel, bytes, message); !status) return status;
  const auto robot = parse_robot_description(message.yaml, std::string(channel));
  return robot ? Status{} : robot.error();
}

Status session_message(std::string_view channel, Bytes bytes) {
  SessionHeader header;
  if (const Status status = decode(channel, bytes, header); !status) return status;
  const std::string origin(channel);
  if (const auto scenario = parse_scenario(header.scenario_yaml, origin + " (scenario)"); !scenario) {
    return scenario.error();
  }
  if (!header.model_yaml.empty()) {
    if (const auto model = parse_model(header.model_yaml, origin + " (model)"); !model) return model.error();
  }
  if (!header.robot_yaml.empty()) {
    const auto robot = tick::parse_robot_descriptions(header.robot_yaml, origin + " (robot)");
    if (!robot) return robot.error();
  }
  return {};
}

using Check = Status (*)(std::string_view channel, Bytes bytes);
const std::map<std::string, Check, std::less<>> kChecks{{"planar_lidar_t", decodes<Scan>},
                                                        {"lidar_t", decodes<Scan>},
                                                        {"image_t", decodes<Image>},
                                                        {"pose2D_t", decodes<Odometry>},
                                                        {"pose_cov_t", decodes<PoseEstimate>},
                                                        {"pose_t", decodes<PoseStamped>},
                                                        {"twist2D_t", decodes<TwistCommand>},
                                                        {"mbot_motor_command_t", decodes<TwistCommand>},
                                                        {"imu_t", decodes<ImuSample>},
                                                        {"mbot_imu_t", decodes<ImuSample>},
                                                        {"joints_t", decodes<Joints>},
                                                        {"agent_spawn_t", decodes<AgentSpawn>},
                                                        {"agent_move_t", decodes<AgentMove>},
                                                        {"agent_behaviour_t", decodes<AgentBehaviour>},
                                                        {"agent_remove_t", decodes<AgentRemove>},
                                                        {"agent_freeze_t", decodes<AgentFreeze>},
                                                        {"door_cmd_t", decodes<DoorCommand>},
                                                        {"fault_cmd_t", decodes<FaultCommand>},
                                                        {"camera_rate_t", decodes<CameraRate>},
                                                        {"object_report_t", decodes<ObjectReport>},
                                                        {"script_start_t", decodes<ScriptStart>},
                                                        {"training_start_t", decodes<TrainingStart>},
                                                        {"emergency_stop_t", decodes<EmergencyStopCommand>},
                                                        {"operator_t", decodes<OperatorStatus>},
                                                        {"event_t", decodes<Event>},
                                                        {"session_t", session_message},
                                                        {"scan_info_t", decodes<ScanInfo>},
                                                        {"loop_t", decodes<LoopDecision>},
                                                        {"status_t", decodes<ServerStatus>},
                                                        {"robot_t", robot_message},
                                                        {"world_t", decodes<WorldMessage>},
                                                        {"hazard_reading_t", decodes<HazardReading>}};

/// Types by canonical channel name; other channels may have any type.
const std::map<std::string, std::string, std::less<>> kTypesByChannel{
    {channel::kRobot, "robot_t"},
    {channel::kScan, "planar_lidar_t"},
    {channel::kLines, "planar_lidar_t"},
    {channel::kOdometry, "pose2D_t"},
    {channel::kPoseCov, "pose_cov_t"},
    {channel::kPose, "pose_t"},
    {channel::kReferencePose, "pose_t"},
    {channel::kCamera, "image_t"},
    {channel::kDepth, "image_t"},
    {channel::kTeleop, "twist2D_t"},
    {channel::kJointState, "joints_t"},
    {channel::kJointCmd, "joints_t"},
    {channel::kBumper, "joints_t"},
    {channel::kOperators, "operator_t"},
    {channel::kLoop, "loop_t"},
    {channel::kMrSpawn, "agent_spawn_t"},
    {channel::kMrMove, "agent_move_t"},
    {channel::kMrBehaviour, "agent_behaviour_t"},
    {channel::kMrRemove, "agent_remove_t"},
    {channel::kMrFreeze, "agent_freeze_t"},
    {channel::kMrDoor, "door_cmd_t"},
    {channel::kMrFault, "fault_cmd_t"},
    {channel::kMrCameraRate, "camera_rate_t"},
    {channel::kMrObjectReport, "object_report_t"},
    {channel::kMrScript, "script_start_t"},
    {channel::kMrStart, "training_start_t"},
    {channel::kMrEmergencyStop, "emergency_stop_t"},
    {channel::kMrScan, "planar_lidar_t"},
    {channel::kMrScanInfo, "scan_info_t"},
    {channel::kMrCamera, "image_t"},
    {channel::kMrDepth, "image_t"},
    {channel::kMrSession, "session_t"},
    {channel::kMrWorld, "world_t"},
    {channel::kMrEvents, "event_t"},
    {channel::kMrStatus, "status_t"},
    {channel::kMrCmd, "twist2D_t"},
    {channel::kMrJointCmd, "joints_t"},
    {channel::kHazard, "hazard_reading_t"}};

/// A channel takes other types, too.
bool takes(const std::string& expected, const std::string& type) {
  return type == expected || (expected == "planar_lidar_t" && type == "lidar_t") ||
         (expected == "twist2D_t" && type == "mbot_motor_command_t");
}

/// Of a sensor: each message is a new measurement.
bool is_measured(std::string_view canonical) {
  for (const char* each : {channel::kScan, channel::kLines, channel::kOdometry, channel::kPoseCov,
                           channel::kCamera, channel::kDepth, channel::kImu}) {
    if (canonical == each) return true;
  }
  return false;
}

struct ChannelCount {
  std::uint64_t messages = 0, refused = 0, unknown = 0;
  std::uint64_t not_later = 0;  ///< stamps that are not later than the one before
  std::optional<std::int64_t> utime;
  std::string type, first_refusal, first_not_later;
};

class LogCheck {
 public:
  explicit LogCheck(const std::string& path) : path_(path) {}

  Validation run() {
    auto reader = LogReader::open(path_);
    if (!reader) return {"", {}, {reader.error().message}};
    bool ended = false;
    while (!ended) {
      auto event = reader->next();
      if (!event) {
        damage(event.error().message);
      } else if (!*event) {
        ended = true;
      } else {
        add(**event);
      }
    }
    return validation(reader->skipped_bytes());
  }

 private:
  void damage(const std::string& words) {
    ++damaged_;
    if (damaged_ <= kErrorsShown) errors_.push_back(words);
  }

  void add(const Message& message) {
    if (events_ > 0 && message.arrival < last_) ++backward_;
    if (events_ > 0 && message.arrival - last_ > kLeap && leap_.empty()) {
      leap_ = "event " + std::to_string(events_) + " comes " +
              std::to_string(std::lround((message.arrival - last_).seconds())) + " s after the one before";
    }
    if (events_ == 0) first_ = message.arrival;
    last_ = message.arrival;
    ++events_;
    ChannelCount& count = channels_[message.channel];
    ++count.messages;
    const std::string type = type_name(message.payload);
    const auto parts = parse_robot_channel(message.channel);
    const std::string canonical(parts ? parse_sensor_channel(parts->canonical).canonical
                                      : std::string_view(message.channel));
    const auto expected = kTypesByChannel.find(canonical);
    if (count.type.empty()) count.type = type;
    if (expected != kTypesByChannel.end() && !takes(expected->second, type)) {
      refuse(count, "is of type " + type + ", expected " + expected->second);
      return;
    }
    const auto check = kChecks.find(type);
    if (check == kChecks.end()) {
      ++count.unknown;
      return;
    }
    if (const Status status = check->second(message.channel, message.payload); !status) {
      refuse(count, status.error().message);
      return;
    }
    if (type == "robot_t" && note_on_robot_.empty()) look_at_robot(message);
    if (is_measured(canonical)) look_at_stamp(message, count);
  }

  /// What the server does not use, or takes for a jump of the sensor's clock.
  void look_at_stamp(const Message& message, ChannelCount& count) {
    const auto utime = utime_of(message.payload);
    if (!utime) return;
    if (count.utime && *utime <= *count.utime && count.not_later++ == 0)
      count.first_not_later = "event " + std::to_string(events_ - 1);
    count.utime = utime;
  }

  /// A log without scans is valid, but a robot that the server cannot use is worth a note.
  void look_at_robot(const Message& message) {
    RobotMessage robot_message;
    if (!decode(message.channel, message.payload, robot_message)) return;
    const auto robot = parse_robot_description(robot_message.yaml, message.channel);
    const Status usable = robot ? tick::check_robot(*robot) : robot.error();
    if (!usable) note_on_robot_ = "replay will need --robot FILE: " + usable.error().message;
  }

  void refuse(ChannelCount& count, const std::string& why) {
    if (count.refused++ == 0) count.first_refusal = "event " + std::to_string(events_ - 1) + ": " + why;
  }

  Validation validation(std::uint64_t skipped) {
    Validation out;
    char text[160];
    std::snprintf(text, sizeof text, "LCM log, %llu events on %zu %s, %.3f s",
                  static_cast<unsigned long long>(events_), channels_.size(),
                  channels_.size() == 1 ? "channel" : "channels", (last_ - first_).seconds());
    out.summary = text;
    for (const auto& [name, count] : channels_) {
      std::snprintf(text, sizeof text, "%-24s %8llu  ", name.c_str(),
                    static_cast<unsigned long long>(count.messages));
      out.notes.push_back(
          text + (count.unknown > 0 ? "not a type of Parhelion, fingerprint " + count.type : count.type));
      if (count.not_later > 0)
        out.notes.push_back("warning: " + name + ": " + std::to_string(count.not_later) +
                            (count.not_later == 1 ? " stamp is" : " stamps are") +
                            " not later than the one before, first in " + count.first_not_later +
                            ": utime is the instant of the measurement");
      if (count.refused == 0) continue;
      errors_.push_back(path_ + ": channel " + name + ": " + std::to_string(count.refused) + " of " +
                        std::to_string(count.messages) +
                        " messages cannot be used; first: " + count.first_refusal);
    }
    if (!note_on_robot_.empty()) out.notes.push_back(note_on_robot_);
    if (!leap_.empty()) out.notes.push_back(leap_);
    if (backward_ > 0)
      out.notes.push_back(std::to_string(backward_) + " events with an earlier stamp than the one before");
    if (damaged_ > kErrorsShown)
      errors_.push_back("... and " + std::to_string(damaged_ - kErrorsShown) + " more damaged places");
    if (damaged_ > 0) {
      errors_.push_back(path_ + ": " + std::to_string(damaged_) +
                        (damaged_ == 1 ? " damaged place, " : " damaged places, ") + std::to_string(skipped) +
                        " bytes lost");
    }
    if (events_ == 0) errors_.push_back(path_ + ": no event in it");
    out.errors = errors_;
    return out;
  }

  std::string path_;
  std::map<std::string, ChannelCount> channels_;
  std::vector<std::string> errors_;
  std::string note_on_robot_, leap_;
  std::uint64_t events_ = 0, damaged_ = 0, backward_ = 0;
  ArrivalTime first_, last_;
};

}  // namespace

bool looks_like_log(const std::string& path) {
  constexpr std::size_t searched = 1U << 16U;
  std::ifstream file(path, std::ios::binary);
  std::string head(searched, '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  return head.find("\xED\xA1\xDA\x01") != std::string::npos;
}

Error holds_no_event(const std::string& path, const std::string& channel,
                     const std::vector<std::string>& findings) {
  if (!looks_like_log(path))
    return {path + ": is not an LCM log; `parhelion import` makes one of recordings of other systems"};
  for (const std::string& finding : findings) {
    if (const auto refusal = finding.find("channel " + channel + ": "); refusal != std::string::npos)
      return {path + ": no event can be read: " + finding.substr(refusal)};
  }
  return {path + ": holds no event on " + channel + " that can be read; is it the right channel?"};
}

Validation validate_log(const std::string& path) { return LogCheck(path).run(); }

}  // namespace parhelion::tools
