// Conversion of each message type of a session.
#include <algorithm>

#include "server/station/foxglove/converter.hpp"

namespace parhelion::station::foxglove {
namespace {

constexpr Duration kSceneInterval = milliseconds(95);  // MR_WORLD has 30 Hz and its JSON is long

}  // namespace

Status Converter::scan(const Message& message) {
  const Channel& to = channel("/scan", "foxglove.LaserScan");
  if (!wanted(to) || !configuration_->robot.laser) return {};
  if (const Status read = decode(message.channel, message.payload, scan_); !read) return read;
  write_scan(scan_, configuration_->robot.laser->convention, "laser", json_);
  send(to, message, scan_.stamp.ns);
  return {};
}

Status Converter::injected_scan(const Message& message) {
  const Channel& to = channel("/mr_scan", "foxglove.LaserScan");
  if (!configuration_->robot.laser) return {};
  if (const Status read = decode(message.channel, message.payload, pending_scan_); !read) return read;
  if (wanted(to)) {
    write_scan(pending_scan_, configuration_->robot.laser->convention, "laser", json_);
    send(to, message, pending_scan_.stamp.ns);
  }
  virtual_returns(message);
  return {};
}

Status Converter::scan_info(const Message& message) {
  if (const Status read = decode(message.channel, message.payload, pending_info_); !read) return read;
  write_injection(pending_info_, json_);
  send(channel("/injection", "parhelion.Injection"), message, pending_info_.stamp.ns);
  virtual_returns(message);
  return {};
}

/// MR_SCAN and MR_SCAN_INFO arrive in either order.
void Converter::virtual_returns(const Message& message) {
  const Channel& to = channel("/virtual_returns", "foxglove.LaserScan");
  if (!wanted(to) || pending_scan_.stamp != pending_info_.stamp) return;
  write_virtual_returns(pending_scan_, pending_info_, "laser", json_);
  send(to, message, pending_scan_.stamp.ns);
}

Status Converter::agent_scan(const Message& message, const std::string& agent) {
  const auto mount = shapes_->laser_mount(agent);
  const AgentDefinition* definition = shapes_->definition(agent);
  if (!mount || !definition) return {};
  const Channel& to = channel("/agents/" + agent + "/scan", "foxglove.LaserScan");
  if (!wanted(to)) return {};
  if (const Status read = decode(message.channel, message.payload, scan_); !read) return read;
  auto laser = presets_.find(definition->laser);
  if (laser == presets_.end()) {
    auto preset = load_laser_preset(definition->laser);
    if (!preset) return preset.error();
    laser = presets_.emplace(definition->laser, std::move(*preset)).first;
  }
  const std::string frame = agent + "/laser";
  write_transforms(scan_.stamp.ns, {{agent, frame, mount->isometry()}}, json_);
  send(channel("/tf/agents", "foxglove.FrameTransforms"), message, scan_.stamp.ns);
  write_scan(scan_, laser->second.convention, frame, json_);
  send(to, message, scan_.stamp.ns);
  return {};
}

Status Converter::estimate(const Message& message) {
  PoseEstimate estimate;
  if (const Status read = decode(message.channel, message.payload, estimate); !read) return read;
  if (estimate.state == SlamState::tracking)
    moved(message, estimate.stamp.ns, estimate.T_map_base.isometry());
  return {};
}

Status Converter::plain_pose(const Message& message) {
  PoseStamped pose;
  if (const Status read = decode(message.channel, message.payload, pose); !read) return read;
  moved(message, pose.stamp.ns, pose.T_map_base.isometry());
  return {};
}

Status Converter::world(const Message& message) {
  if (world_sent_ && message.arrival >= *world_sent_ && message.arrival - *world_sent_ < kSceneInterval)
    return {};
  world_sent_ = message.arrival;
  if (const Status read = decode(message.channel, message.payload, world_); !read) return read;
  const std::int64_t stamp = world_.stamp.ns;
  if (const Channel& to = channel("/scene", "foxglove.SceneUpdate"); wanted(to)) {
    world_scene_.write(world_, *shapes_, json_);
    send(to, message, stamp);
  }
  meshes(message, stamp);
  if (const Channel& to = channel("/names", "foxglove.SceneUpdate"); wanted(to)) {
    WorldScene::write_names(world_, json_);
    send(to, message, stamp);
  }
  std::vector<NamedTransform> lasers;
  const std::string* before = nullptr;
  for (const WorldMessage::Entry& body : world_.bodies) {
    const bool same = before && *before == body.entity;
    before = &body.entity;
    if (!same && body.owner == BodyOwner::agent && shapes_->laser_mount(body.entity))
      lasers.push_back({"map", body.entity, body.T_map_body.isometry()});
  }
  if (lasers.empty()) return {};
  write_transforms(stamp, lasers, json_);
  send(channel("/tf/agents", "foxglove.FrameTransforms"), message, stamp);
  return {};
}

void Converter::meshes(const Message& message, std::int64_t stamp) {
  if (mesh_scene_.take(world_, *shapes_)) {
    mesh_scene_.write(world_, *shapes_, json_);
    send(channel("/scene/meshes", "foxglove.SceneUpdate", true), message, stamp);
  }
  if (mesh_scene_.frames().empty()) return;
  write_transforms(stamp, mesh_scene_.frames(), json_);
  send(channel("/tf/meshes", "foxglove.FrameTransforms"), message, stamp);
}

Status Converter::image(const std::string& camera, const std::string& frame, const Message& message) {
  const Channel& compressed = channel(camera + "/image", "foxglove.CompressedImage");
  if (!wanted(compressed)) return {};
  if (const Status read = decode(message.channel, message.payload, image_); !read) return read;
  if (image_.format == PixelFormat::mjpeg) {
    write_jpeg(image_, frame, json_);
    send(compressed, message, image_.stamp.ns);
  } else if (image_.format != PixelFormat::depth_mm) {
    write_pixels(image_, frame, json_);
    send(channel(camera + "/raw", "foxglove.RawImage"), message, image_.stamp.ns);
  }
  return {};
}

Status Converter::depth_image(const char* topic, const Message& message) {
  const Channel& to = channel(topic, "foxglove.RawImage");
  if (!wanted(to)) return {};
  if (const Status read = decode(message.channel, message.payload, image_); !read) return read;
  if (const Status written = write_depth(image_, "depth_optical", json_); !written)
    return Error{message.channel + ": " + written.error().message};
  send(to, message, image_.stamp.ns);
  return {};
}

Status Converter::twist(const char* topic, const Message& message) {
  TwistCommand command;
  if (const Status read = decode(message.channel, message.payload, command); !read) return read;
  write_twist(command, json_);
  send(channel(topic, "parhelion.Twist"), message, command.stamp.ns);
  return {};
}

Status Converter::joint_state(const Message& message) {
  Joints joints;
  if (const Status read = decode(message.channel, message.payload, joints); !read) return read;
  for (std::size_t i = 0; i < joints.positions.size(); ++i) {
    double& known = joints_[joints.names[i]];
    mounts_changed_ |= known != joints.positions[i];
    known = joints.positions[i];
  }
  return {};
}

Status Converter::event(const Message& message) {
  Event event;
  if (const Status read = decode(message.channel, message.payload, event); !read) return read;
  shapes_->take(event);
  if (event.kind == EventKind::score_changed || event.kind == EventKind::grading_ended) {
    write_score(event, json_);
    send(channel("/score", "parhelion.Score"), message, event.stamp.ns);
  }
  if (event.kind == EventKind::contact_continues) return {};
  write_event(event, json_);
  send(channel("/events", "foxglove.Log"), message, event.stamp.ns);
  return {};
}

Status Converter::agent_spawn(const Message& message) {
  AgentSpawn command;
  if (const Status read = decode(message.channel, message.payload, command); !read) return read;
  shapes_->take(command);
  return {};
}

Status Converter::model(const Message& message) {
  ModelVersion version;
  if (const Status read = decode(message.channel, message.payload, version); !read) return read;
  const auto model = parse_model(version.yaml, message.channel);
  if (!model) return model.error();
  shapes_->take(*model);
  building(*model, message);
  return {};
}

Status Converter::server_status(const Message& message) {
  ServerStatus status;
  if (const Status read = decode(message.channel, message.payload, status); !read) return read;
  write_status(status, json_);
  send(channel("/status", "parhelion.Status"), message, status.stamp.ns);
  return {};
}

}  // namespace parhelion::station::foxglove
