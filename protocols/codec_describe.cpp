// One line of text for any message, by its fingerprint.
#include <algorithm>
#include <array>
#include <cstdarg>
#include <cstdio>

#include "parhelion/agent_behaviour_t.hpp"
#include "parhelion/agent_freeze_t.hpp"
#include "parhelion/agent_move_t.hpp"
#include "parhelion/agent_remove_t.hpp"
#include "parhelion/agent_spawn_t.hpp"
#include "parhelion/camera_rate_t.hpp"
#include "parhelion/door_cmd_t.hpp"
#include "parhelion/emergency_stop_t.hpp"
#include "parhelion/event_t.hpp"
#include "parhelion/fault_cmd_t.hpp"
#include "parhelion/hazard_reading_t.hpp"
#include "parhelion/image_t.hpp"
#include "parhelion/imu_t.hpp"
#include "parhelion/joints_t.hpp"
#include "parhelion/lidar_t.hpp"
#include "parhelion/loop_t.hpp"
#include "parhelion/mbot_imu_t.hpp"
#include "parhelion/mbot_motor_command_t.hpp"
#include "parhelion/model_t.hpp"
#include "parhelion/object_report_t.hpp"
#include "parhelion/operator_t.hpp"
#include "parhelion/planar_lidar_t.hpp"
#include "parhelion/pose2D_t.hpp"
#include "parhelion/pose_cov_t.hpp"
#include "parhelion/pose_t.hpp"
#include "parhelion/robot_t.hpp"
#include "parhelion/scan_info_t.hpp"
#include "parhelion/script_start_t.hpp"
#include "parhelion/session_t.hpp"
#include "parhelion/status_t.hpp"
#include "parhelion/training_start_t.hpp"
#include "parhelion/twist2D_t.hpp"
#include "parhelion/world_t.hpp"
#include "protocols/codec_wire.hpp"

namespace parhelion {
namespace {

__attribute__((format(printf, 1, 2))) std::string format(const char* pattern, ...) {
  char text[512];
  va_list arguments;
  va_start(arguments, pattern);
  const int length = std::vsnprintf(text, sizeof text, pattern, arguments);
  va_end(arguments);
  return std::string(text, static_cast<std::size_t>(std::min<int>(std::max(length, 0), sizeof text - 1)));
}

/// In quotes, truncated at 120 characters; terminal control characters are written as \xNN.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text.substr(0, 120)) {
    const auto byte = static_cast<unsigned char>(c);
    out += byte < 0x20 || byte == 0x7f || c == '"' || c == '\\' ? format("\\x%02x", byte) : std::string(1, c);
  }
  return out + (text.size() > 120 ? format("\"... (%zu characters)", text.size()) : "\"");
}

template <class A, class B>
std::string place(const Transform<A, B>& T) {
  return format("x %.3f y %.3f z %.3f m yaw %.4f rad", T.translation().x(), T.translation().y(),
                T.translation().z(), T.yaw());
}

std::string summarize(const Scan& scan) {
  float nearest = INFINITY, farthest = -INFINITY;
  for (const float range : scan.ranges) {
    if (!std::isfinite(range)) continue;
    nearest = std::min(nearest, range);
    farthest = std::max(farthest, range);
  }
  return format("%zu beams from %.4f rad %s %.6f rad, finite ranges %.3f..%.3f m, %zu intensities",
                scan.ranges.size(), static_cast<double>(scan.angle_min),
                scan.angles.empty() ? "step" : "mean step", static_cast<double>(scan.angle_increment),
                static_cast<double>(nearest), static_cast<double>(farthest), scan.intensities.size());
}

std::string summarize(const Image& image) {
  const char* format_name = image.format == PixelFormat::mjpeg  ? "mjpeg"
                            : image.format == PixelFormat::rgb  ? "rgb"
                            : image.format == PixelFormat::bgr  ? "bgr"
                            : image.format == PixelFormat::gray ? "gray"
                                                                : "depth";
  std::string text = format("%dx%d %s %zu bytes", image.width, image.height, format_name, image.bytes.size());
  for (const ImageMetadata& entry : image.metadata) {
    text += " " + quoted(entry.key) + "=" + quoted(std::string(entry.value.begin(), entry.value.end()));
  }
  return text;
}

std::string summarize(const Odometry& odometry) { return place(odometry.T_odom_base); }

std::string summarize(const PoseEstimate& estimate) {
  const auto sigma = [&](int i) { return std::sqrt(estimate.covariance(i, i)); };
  return format("%s sigma %.3f %.3f m %.4f rad %s %s step %.2f ms map ", place(estimate.T_map_base).c_str(),
                sigma(0), sigma(1), sigma(5), to_string(estimate.state), estimate.causal ? "causal" : "final",
                estimate.step_time.seconds() * 1e3) +
         quoted(estimate.map_id);
}

std::string summarize(const PoseStamped& pose) {
  return place(pose.T_map_base) +
         format(" velocity %.3f %.3f %.3f m/s", pose.velocity.x(), pose.velocity.y(), pose.velocity.z());
}

std::string summarize(const TwistCommand& command) {
  return format("vx %.3f vy %.3f m/s wz %.4f rad/s", command.twist.vx, command.twist.vy, command.twist.wz);
}

std::string summarize(const ImuSample& sample) {
  const Eigen::Vector3d &w = sample.rotation_rate, &a = sample.acceleration;
  std::string text = "no orientation";
  if (sample.orientation) {
    const Eigen::Matrix3d R = sample.orientation->toRotationMatrix();
    text = format("roll %.4f pitch %.4f rad", std::atan2(R(2, 1), R(2, 2)),
                  std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2))));
  }
  return text + format(" rate %.4f %.4f %.4f rad/s acceleration %.3f %.3f %.3f m/s^2", w.x(), w.y(), w.z(),
                       a.x(), a.y(), a.z());
}

std::string summarize(const Joints& joints) {
  std::string text = format("%zu joints", joints.names.size());
  for (std::size_t i = 0; i < joints.names.size(); ++i) {
    text += "; " + quoted(joints.names[i]);
    if (!joints.positions.empty()) text += format(" position %.4f", joints.positions[i]);
    if (!joints.velocities.empty()) text += format(" velocity %.4f", joints.velocities[i]);
    if (!joints.efforts.empty()) text += format(" effort %.4f", joints.efforts[i]);
  }
  return text;
}

std::string summarize(const Behaviour& behaviour) {
  const std::string text = format("%s %.2f m/s %zu waypoints", to_string(behaviour.kind), behaviour.speed,
                                  behaviour.waypoints.size());
  if (behaviour.kind < BehaviourKind::follow || behaviour.kind == BehaviourKind::go) return text;
  return text + " of " + quoted(behaviour.target) + format(" at %.2f m", behaviour.distance);
}

std::string head(std::uint64_t request, const char* action) {
  return format("request %llu %s ", static_cast<unsigned long long>(request), action);
}

std::string summarize(const AgentSpawn& command) {
  const AgentDefinition& agent = command.agent;
  return head(command.request, "spawn") + quoted(agent.name) +
         format(" %s %s size %.2f %.2f %.2f m ", to_string(agent.kind), place(agent.T_map_base).c_str(),
                agent.size.x(), agent.size.y(), agent.size.z()) +
         summarize(agent.behaviour) + " laser " + quoted(agent.laser) + " model " + quoted(agent.model) +
         format(" camera %.3g Hz", agent.camera_rate);
}

std::string summarize(const AgentMove& command) {
  return head(command.request, "move") + quoted(command.agent) + " to " + place(command.T_map_base);
}

std::string summarize(const AgentBehaviour& command) {
  return head(command.request, "behave") + quoted(command.agent) + " " + summarize(command.behaviour);
}

std::string summarize(const AgentRemove& command) {
  return head(command.request, "remove") + (command.all ? "all" : quoted(command.agent));
}

std::string summarize(const AgentFreeze& command) {
  return head(command.request, command.frozen ? "freeze" : "unfreeze") +
         (command.all ? "all" : quoted(command.agent));
}

std::string summarize(const DoorCommand& command) {
  return head(command.request, "door") + quoted(command.door) +
         (command.opening ? format(" open %.4f rad", *command.opening) : " determined by the sensors");
}

std::string summarize(const FaultCommand& command) {
  std::string text = head(command.request, command.begins ? "begin" : "end") + to_string(command.kind);
  if (!command.begins) return text;
  text += command.kind == Fault::Kind::dead_wheel ? (command.right ? " right" : " left")
                                                  : format(" %.4g", command.amount);
  return text + (command.duration ? format(" for %.3f s", *command.duration) : " until it is ended");
}

std::string summarize(const CameraRate& command) {
  return head(command.request, "camera") + quoted(command.agent) + format(" %.3g Hz", command.rate);
}

std::string summarize(const ObjectReport& command) {
  return head(command.request, "report") + quoted(command.object) +
         (command.position ? format(" at %.3f %.3f m", command.position->x(), command.position->y())
                           : " without a position");
}

std::string summarize(const ScriptStart& command) {
  return head(command.request, "script") + quoted(command.script);
}

std::string summarize(const TrainingStart& command) { return head(command.request, "start"); }

std::string summarize(const EmergencyStopCommand& command) {
  return head(command.request, command.engaged ? "emergency stop of" : "release of emergency stop of") +
         (command.robot.empty() ? "all" : quoted(command.robot));
}

std::string summarize(const OperatorStatus& status) {
  constexpr std::array<const char*, 3> states = {"drives", "has ended with", "was lost with"};
  return quoted(status.name) + " " + states.at(static_cast<std::size_t>(status.state)) + " " +
         quoted(status.robot) + " " + quoted(status.text);
}

std::string summarize(const Event& event) {
  return format("%s ", to_string(event.kind)) + quoted(event.subject) + " " + quoted(event.object) +
         format(" at %.3f %.3f %.3f m impulse %.3f N s value %.4g%s request %llu ", event.position.x(),
                event.position.y(), event.position.z(), event.impulse, event.value,
                event.undetectable ? " undetectable" : "", static_cast<unsigned long long>(event.request)) +
         quoted(event.text);
}

std::string summarize(const SessionHeader& header) {
  std::string text = format("seed %llu version ", static_cast<unsigned long long>(header.seed)) +
                     quoted(header.version) +
                     format(" scenario %zu model %zu robot %zu characters inputs",
                            header.scenario_yaml.size(), header.model_yaml.size(), header.robot_yaml.size());
  for (const std::string& name : header.input_channels) text += " " + quoted(name);
  for (const RobotModelTexts& model : header.robot_models) text += " robot model " + quoted(model.name);
  return text;
}

std::string summarize(const ScanInfo& info) {
  std::size_t replaced = 0;
  for (const std::int16_t agent : info.beam_agent) replaced += agent >= 0;
  return format(
             "%s, %zu of %zu beams hit %zu %s, predicted error %.3f m, pose %s, residual %.3f m, "
             "explained %.2f ",
             info.live ? "live" : "degraded", replaced, info.beam_agent.size(), info.agents.size(),
             info.agents.size() == 1 ? "agent" : "agents", info.predicted_error, quoted(info.pose).c_str(),
             info.residual, info.explained) +
         quoted(info.reason);
}

std::string summarize(const LoopDecision& decision) {
  constexpr std::array<const char*, 9> kinds = {"guard_fired",    "steps_skipped",   "frame_dropped",
                                                "scans_left_out", "ended",           "foreign_message",
                                                "stale_command",  "refused_message", "late_command"};
  return format("%s %lld", kinds.at(static_cast<std::size_t>(decision.kind)),
                static_cast<long long>(decision.count));
}

std::string summarize(const ServerStatus& status) {
  std::string text;
  for (const auto& [name, value] : status.values) text += quoted(name) + format("=%g ", value);
  for (const auto& [name, note] : status.notes) text += quoted(name) + "=" + quoted(note) + " ";
  return text;
}

std::string summarize(const ModelVersion& model) {
  return "version " + std::to_string(model.version) + ", " + std::to_string(model.yaml.size()) +
         " bytes of YAML";
}
std::string summarize(const HazardReading& reading) {
  std::string text = reading.values.empty() ? "nothing" : "";
  for (const HazardReading::Value& value : reading.values) {
    text += (text.empty() ? "" : ", ") + format("%s %.4g ", to_string(value.kind), value.value) +
            quoted(value.unit);
  }
  return text;
}
std::string summarize(const RobotMessage& message) { return quoted(message.yaml); }

std::string summarize(const WorldMessage& world) {
  std::string text = format("step %llu, robot ", static_cast<unsigned long long>(world.step)) +
                     quoted(world.robot) + format(", %zu bodies", world.bodies.size());
  for (const WorldMessage::Entry& body : world.bodies) {
    text += "; " + quoted(body.entity) + "/" + quoted(body.part) + " " + place(body.T_map_body);
    if (!body.attitude_known) text += ", attitude not known";
  }
  for (const WorldMessage::Person& person : world.persons)
    text += "; " + quoted(person.entity) +
            format(" sigma %.3f m", std::sqrt(std::max(0.0, person.covariance.trace() / 2)));
  return text;
}

template <class T>
std::string describe_as(const char* type, std::string_view channel, Bytes bytes) {
  T message;
  if (const Status status = decode(channel, bytes, message); !status)
    return "refused: " + status.error().message;
  return format("%s %lld.%06lld ", type, static_cast<long long>(message.stamp.utime() / 1'000'000),
                static_cast<long long>(message.stamp.utime() % 1'000'000)) +
         summarize(message);
}

struct Type {
  std::int64_t fingerprint;
  const char* name;
  std::string (*describe)(const char* type, std::string_view channel, Bytes bytes);
};

const auto& types() {
  static const std::array known = {
      Type{planar_lidar_t::getHash(), "planar_lidar_t", describe_as<Scan>},
      Type{lidar_t::getHash(), "lidar_t", describe_as<Scan>},
      Type{image_t::getHash(), "image_t", describe_as<Image>},
      Type{pose2D_t::getHash(), "pose2D_t", describe_as<Odometry>},
      Type{pose_cov_t::getHash(), "pose_cov_t", describe_as<PoseEstimate>},
      Type{pose_t::getHash(), "pose_t", describe_as<PoseStamped>},
      Type{twist2D_t::getHash(), "twist2D_t", describe_as<TwistCommand>},
      Type{mbot_motor_command_t::getHash(), "mbot_motor_command_t", describe_as<TwistCommand>},
      Type{imu_t::getHash(), "imu_t", describe_as<ImuSample>},
      Type{mbot_imu_t::getHash(), "mbot_imu_t", describe_as<ImuSample>},
      Type{joints_t::getHash(), "joints_t", describe_as<Joints>},
      Type{agent_spawn_t::getHash(), "agent_spawn_t", describe_as<AgentSpawn>},
      Type{agent_move_t::getHash(), "agent_move_t", describe_as<AgentMove>},
      Type{agent_behaviour_t::getHash(), "agent_behaviour_t", describe_as<AgentBehaviour>},
      Type{agent_remove_t::getHash(), "agent_remove_t", describe_as<AgentRemove>},
      Type{agent_freeze_t::getHash(), "agent_freeze_t", describe_as<AgentFreeze>},
      Type{door_cmd_t::getHash(), "door_cmd_t", describe_as<DoorCommand>},
      Type{fault_cmd_t::getHash(), "fault_cmd_t", describe_as<FaultCommand>},
      Type{camera_rate_t::getHash(), "camera_rate_t", describe_as<CameraRate>},
      Type{object_report_t::getHash(), "object_report_t", describe_as<ObjectReport>},
      Type{script_start_t::getHash(), "script_start_t", describe_as<ScriptStart>},
      Type{training_start_t::getHash(), "training_start_t", describe_as<TrainingStart>},
      Type{emergency_stop_t::getHash(), "emergency_stop_t", describe_as<EmergencyStopCommand>},
      Type{operator_t::getHash(), "operator_t", describe_as<OperatorStatus>},
      Type{event_t::getHash(), "event_t", describe_as<Event>},
      Type{session_t::getHash(), "session_t", describe_as<SessionHeader>},
      Type{scan_info_t::getHash(), "scan_info_t", describe_as<ScanInfo>},
      Type{loop_t::getHash(), "loop_t", describe_as<LoopDecision>},
      Type{status_t::getHash(), "status_t", describe_as<ServerStatus>},
      Type{model_t::getHash(), "model_t", describe_as<ModelVersion>},
      Type{hazard_reading_t::getHash(), "hazard_reading_t", describe_as<HazardReading>},
      Type{robot_t::getHash(), "robot_t", describe_as<RobotMessage>},
      Type{world_t::getHash(), "world_t", describe_as<WorldMessage>},
  };
  return known;
}

const Type* find_type(Bytes bytes) {
  if (bytes.size() < 8) return nullptr;
  const auto fingerprint = wire::big_endian<std::int64_t>(bytes.data());
  for (const Type& type : types()) {
    if (type.fingerprint == fingerprint) return &type;
  }
  return nullptr;
}

}  // namespace

std::string type_name(Bytes bytes) {
  if (const Type* type = find_type(bytes)) return type->name;
  if (bytes.size() < 8) return "none";
  return wire::hex(wire::big_endian<std::int64_t>(bytes.data()));
}

std::string describe(std::string_view channel, Bytes bytes) {
  if (const Type* type = find_type(bytes)) return type->describe(type->name, channel, bytes);
  if (bytes.size() < 8) return format("%zu bytes: too short for a fingerprint", bytes.size());
  return format("unknown type, fingerprint %s, %zu bytes", type_name(bytes).c_str(), bytes.size());
}

}  // namespace parhelion
