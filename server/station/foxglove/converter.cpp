#include "server/station/foxglove/converter.hpp"

#include <algorithm>
#include <utility>

#include "fusion/pose/tracks/joint_track.hpp"
#include "protocols/channels.hpp"

namespace parhelion::station::foxglove {
namespace {

// Repeated, since a reader that starts in the middle of a file needs the mounting poses of the sensors.
constexpr Duration kMountInterval = seconds(1);

/// "robot_1" of "MR_AGENT_robot_1_SCAN" and "_SCAN"; empty: another channel.
std::string agent_of(std::string_view channel, std::string_view after) {
  constexpr std::string_view before = "MR_AGENT_";
  if (!channel.starts_with(before) || !channel.ends_with(after)) return {};
  channel.remove_prefix(before.size());
  return channel.size() <= after.size() ? std::string()
                                        : std::string(channel.substr(0, channel.size() - after.size()));
}

}  // namespace

Converter::Converter(std::function<void(const Converted&)> send, std::function<bool(const Channel&)> wanted)
    : send_(std::move(send)), wanted_(std::move(wanted)) {
  handlers_[channel::kMrSession] = &Converter::session;
}

void Converter::listen(const char* canonical, Handler handler) {
  handlers_[configuration_->channels.bus(canonical)] = handler;
}

const Channel& Converter::channel(std::string_view topic, const char* schema, bool keeps) {
  const auto known = by_topic_.find(topic);
  if (known != by_topic_.end()) return *known->second;
  channels_.push_back({static_cast<std::uint16_t>(channels_.size() + 1), std::string(topic), schema, keeps});
  by_topic_[std::string(topic)] = &channels_.back();
  return channels_.back();
}

void Converter::send(const Channel& channel, const Message& message, std::int64_t stamp) {
  send_({channel, message.arrival, stamp, json_.text()});
}

void Converter::omit(const std::string& what) {
  if (std::find(omissions_.begin(), omissions_.end(), what) == omissions_.end()) omissions_.push_back(what);
}

Status Converter::take(const Message& message) {
  const auto handler = handlers_.find(message.channel);
  if (handler != handlers_.end()) return (this->*handler->second)(message);
  if (!configuration_) return {};
  if (const std::string agent = agent_of(message.channel, "_SCAN"); !agent.empty())
    return agent_scan(message, agent);
  if (const std::string agent = agent_of(message.channel, "_CAMERA"); !agent.empty())
    return image("/agents/" + agent + "/camera", agent + "/camera_optical", message);
  return {};
}

Status Converter::session(const Message& message) {
  SessionHeader header;
  if (const Status read = decode(message.channel, message.payload, header); !read) return read;
  auto configuration = tick::configuration_from(header, message.channel);
  if (!configuration) return configuration.error();
  begin(*configuration, message.arrival);
  return {};
}

void Converter::begin(const tick::Configuration& configuration, ArrivalTime arrival) {
  configuration_ = configuration;
  shapes_.emplace(configuration.scenario, configuration.robot, configuration.model,
                  configuration.robot_models);
  for (const RobotDescription& other : configuration.other_robots) shapes_->add(other);
  shapes_->add(configuration.objects);
  handlers_.clear();
  handlers_[channel::kMrSession] = &Converter::session;
  const std::pair<const char*, Handler> all[] = {{channel::kScan, &Converter::scan},
                                                 {channel::kMrScan, &Converter::injected_scan},
                                                 {channel::kMrScanInfo, &Converter::scan_info},
                                                 {channel::kPoseCov, &Converter::estimate},
                                                 {channel::kMrWorld, &Converter::world},
                                                 {channel::kCamera, &Converter::camera},
                                                 {channel::kMrCamera, &Converter::injected_camera},
                                                 {channel::kDepth, &Converter::depth},
                                                 {channel::kMrDepth, &Converter::injected_depth},
                                                 {channel::kTeleop, &Converter::asked},
                                                 {channel::kMrCmd, &Converter::given},
                                                 {channel::kJointState, &Converter::joint_state},
                                                 {channel::kMrEvents, &Converter::event},
                                                 {channel::kMrSpawn, &Converter::agent_spawn},
                                                 {channel::kMrModel, &Converter::model},
                                                 {channel::kMrStatus, &Converter::server_status}};
  for (const auto& [canonical, handler] : all) listen(canonical, handler);
  if (configuration.scenario.pose) listen(channel::kPose, &Converter::plain_pose);
  mounts_sent_.reset();
  world_sent_.reset();
  mesh_scene_ = {};
  building(configuration.model, Message{channel::kMrSession, arrival, {}});
}

void Converter::building(const SemanticModel& model, const Message& message) {
  const bool too_large = write_building(model, message.arrival.ns, BuildingPart::standing, json_);
  send(channel("/building", "foxglove.SceneUpdate", true), message, message.arrival.ns);
  write_building(model, message.arrival.ns, BuildingPart::overhead, json_);
  send(channel("/building/overhead", "foxglove.SceneUpdate", true), message, message.arrival.ns);
  if (too_large)
    omit("a mesh of the building has more than " + std::to_string(kMaxMeshTriangles) +
         " triangles and is left out of /building");
}

void Converter::moved(const Message& message, std::int64_t stamp, const Eigen::Isometry3d& T_map_base) {
  write_transforms(stamp, {{"map", "base_link", T_map_base}}, json_);
  send(channel("/tf", "foxglove.FrameTransforms"), message, stamp);
  write_pose(stamp, T_map_base, json_);
  send(channel("/pose", "foxglove.PoseInFrame"), message, stamp);
  mounts(message, stamp);
}

/// Mounting poses of the sensors at the current position of the robot's head.
void Converter::mounts(const Message& message, std::int64_t stamp) {
  if (mounts_sent_ && !mounts_changed_ && message.arrival - *mounts_sent_ < kMountInterval &&
      message.arrival >= *mounts_sent_)
    return;
  mounts_sent_ = message.arrival;
  mounts_changed_ = false;
  const RobotDescription& robot = configuration_->robot;
  const auto turned = [this](const std::vector<HeadJoint>& head, const Eigen::Isometry3d& T_base_sensor) {
    const auto turn = pose::head_turn(head, [this](const std::string& joint) -> std::optional<double> {
      const auto known = joints_.find(joint);
      return known == joints_.end() ? 0 : known->second;
    });
    return turn ? turn->isometry() * T_base_sensor : T_base_sensor;
  };
  std::vector<NamedTransform> all;
  if (robot.laser) all.push_back({"base_link", "laser", robot.laser->T_base_laser.isometry()});
  if (robot.camera)
    all.push_back(
        {"base_link", "camera_optical", turned(robot.camera->head, robot.camera->T_base_optical.isometry())});
  if (robot.depth)
    all.push_back(
        {"base_link", "depth_optical", turned(robot.depth->head, robot.depth->T_base_optical.isometry())});
  write_transforms(stamp, all, json_);
  send(channel("/tf/sensors", "foxglove.FrameTransforms", true), message, stamp);
  if (robot.camera) {
    write_calibration(stamp, robot.camera->intrinsics, "camera_optical", json_);
    for (const char* topic : {"/camera/calibration", "/mr_camera/calibration"})
      send(channel(topic, "foxglove.CameraCalibration", true), message, stamp);
  }
  if (robot.depth) {
    write_calibration(stamp, robot.depth->intrinsics, "depth_optical", json_);
    for (const char* topic : {"/depth/calibration", "/mr_depth/calibration"})
      send(channel(topic, "foxglove.CameraCalibration", true), message, stamp);
  }
}

}  // namespace parhelion::station::foxglove
