// Messages from the bus. Periodic messages to pages are in state_feed_subscribers.cpp.
#include "server/station/state_feed.hpp"

#include <algorithm>

#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "server/simulation/robots/base_body.hpp"
#include "server/station/depth_frames.hpp"
#include "server/station/operator_name.hpp"
#include "server/tick/instructor_input.hpp"

namespace parhelion::station {
namespace {

constexpr std::size_t kKeptEvents = 500;
constexpr std::size_t kMaxEvent = 64 * 1024;  // bytes: anybody on the bus can send one, and they are kept
constexpr std::size_t kShownOperators = 64;   // names come from the bus
constexpr Duration kPointsPeriod = milliseconds(200), kPicturePeriod = milliseconds(100);
constexpr std::string_view kAgentPrefix = "MR_AGENT_", kScanSuffix = "_SCAN";

/// The agent of a channel MR_AGENT_<name>_SCAN; empty: another channel.
std::string agent_of(const std::string& channel) {
  if (!channel.starts_with(kAgentPrefix) || !channel.ends_with(kScanSuffix)) return {};
  if (channel.size() <= kAgentPrefix.size() + kScanSuffix.size()) return {};
  return channel.substr(kAgentPrefix.size(), channel.size() - kAgentPrefix.size() - kScanSuffix.size());
}

}  // namespace

StateFeed::StateFeed(std::shared_ptr<const tick::Configuration> configuration, FeedOptions options)
    : configuration_(std::move(configuration)),
      options_(std::move(options)),
      shapes_(configuration_->scenario, configuration_->robot, configuration_->model,
              configuration_->robot_models),
      knowledge_(*configuration_, shapes_),
      audience_(*configuration_, knowledge_),
      placed_(configuration_->scenario) {
  for (std::size_t i = 0; i < configuration_->robot_count(); ++i) robots_.emplace_back(*configuration_, i);
  for (const RobotDescription& other : configuration_->other_robots) shapes_.add(other);
  shapes_.add(configuration_->objects);
  using Clock = SensorWatch::Clock;
  add(channel::kScan, Kind::scan, 4, Clock::robot);
  add(channel::kOdometry, Kind::odometry, 64, Clock::robot);
  add(channel::kPoseCov, Kind::pose_cov, 16,
      configuration_->scenario.pose ? std::nullopt : std::optional(Clock::robot));
  add(channel::kPose, Kind::pose, 16,
      configuration_->scenario.pose ? std::optional(Clock::robot) : std::nullopt);
  add(channel::kImu, Kind::watched, 64, Clock::robot);
  add(channel::kJointState, Kind::joints, 8, Clock::robot);
  add(channel::kCamera, Kind::watched, 4, Clock::robot);
  add(channel::kDepth, Kind::depth, 1, Clock::robot);
  add(channel::kHazard, Kind::hazard, 4, Clock::robot);
  add(channel::kMrScan, Kind::mr_scan, 4, Clock::robot);
  add(channel::kMrCamera, Kind::picture, 4, Clock::robot);
  add(channel::kMrWorld, Kind::world, 2, Clock::server);
  add(channel::kMrScanInfo, Kind::scan_info, 4, std::nullopt);
  const int whole_session = 16'384;  // a player repeats all of them after a rewind
  // As many live: a crowd that is removed, or commands that are refused, displace no reply.
  add(channel::kMrEvents, Kind::event, whole_session, std::nullopt);
  add(channel::kMrStatus, Kind::status, 2, std::nullopt);
  for (const char* command : kInstructorChannels)
    add(command, Kind::command, recorded() ? whole_session : 256, std::nullopt);
  add(channel::kMrModel, Kind::model, 2, std::nullopt);
  add(channel::kOperators, Kind::operators, 64, std::nullopt);
  for (std::size_t i = 0; i < robots_.size(); ++i) add_further_sensors(i);
  channels_[channel::kMrSession] = {Kind::session, channel::kMrSession, 2, 0};  // never renamed
}

void StateFeed::add(const char* canonical, Kind kind, int capacity,
                    std::optional<SensorWatch::Clock> watched) {
  for (std::size_t i = 0; i < robots_.size(); ++i) {
    if (i == 0 || is_robot_channel(canonical))
      channels_[configuration_->channels.bus(canonical, i)] = {kind, canonical, capacity, i};
    if (watched) robots_[i].sensors.watch(canonical, *watched);
  }
}

void StateFeed::add_further_sensors(std::size_t robot) {
  const RobotDescription& description = configuration_->robot_at(robot);
  const auto watch = [&](const char* canonical, const std::string& name, std::size_t index) {
    const bool info = std::string_view(canonical) == channel::kMrScanInfo;
    const std::string own = sensor_channel(canonical, name);
    channels_[configuration_->channels.robots_bus(canonical, robot, index)] = {
        info ? Kind::further_scan_info : Kind::watched, own, 4, robot};
    if (!info) robots_[robot].sensors.watch(own, SensorWatch::Clock::robot);
  };
  for (std::size_t i = 0; i < description.further_lasers.size(); ++i) {
    for (const char* canonical : laser_channels())
      watch(canonical, description.further_lasers[i].name, i + 1);
  }
  for (std::size_t i = 0; i < description.further_cameras.size(); ++i) {
    const NamedCameras& cameras = description.further_cameras[i];
    for (const char* canonical : camera_channels()) {
      const bool of_depth = std::string_view(canonical).ends_with(channel::kDepth);
      if (of_depth ? cameras.depth.has_value() : cameras.camera.has_value())
        watch(canonical, cameras.name, i + 1);
    }
  }
}

std::vector<std::pair<std::string, int>> StateFeed::channels() const {
  std::vector<std::pair<std::string, int>> all;
  for (const auto& [name, channel] : channels_) all.emplace_back(name, channel.capacity);
  all.emplace_back("MR_AGENT_.*_SCAN", 64);
  return all;
}

void StateFeed::take(const Message& message, WallTime now) {
  bus_error_.clear();
  const auto known = channels_.find(message.channel);
  if (known == channels_.end()) return handle_agent_scan(message);
  const Channel& channel = known->second;
  if (const auto stamp = leading_stamp(message.payload)) record(channel, *stamp);
  RobotFeed& robot = robots_[channel.robot];
  const auto read = [&](auto& item) { return decode(message.channel, message.payload, item).ok(); };
  switch (channel.kind) {
    case Kind::session:
      if (SessionHeader header; read(header)) restart({header.stamp.ns});
      return;
    case Kind::world:
      return handle_world(message, now);
    case Kind::event:
      return handle_event(message);
    case Kind::scan:
      return handle_scan(message, channel.robot, ScanFrame::Source::real);
    case Kind::mr_scan:
      return handle_scan(message, channel.robot, ScanFrame::Source::augmented);
    case Kind::scan_info:
      return handle_scan_info(message, channel.robot);
    case Kind::further_scan_info:
      return handle_further_scan_info(message, channel.robot);
    case Kind::odometry:
      if (Odometry odometry; read(odometry)) robot.place.take(odometry);
      return;
    case Kind::pose_cov:
      if (PoseEstimate estimate; read(estimate)) robot.take(std::move(estimate));
      return;
    case Kind::pose:
      if (PoseStamped pose; read(pose)) robot.place.take(pose);
      return;
    case Kind::status:
      read(status_);
      return;
    case Kind::operators:
      return handle_operator(message, now);
    case Kind::joints:
      if (Joints joints; read(joints)) robot.joints = std::move(joints);
      return;
    case Kind::hazard:
      if (HazardReading reading; read(reading)) robot.hazard = std::move(reading);
      return;
    case Kind::model:
      return handle_model(message);
    case Kind::command:
      if (InstructorCommand command; tick::read_command(configuration_->channels, message, command).ok()) {
        placed_.take(command);
        if (const auto* spawn = std::get_if<AgentSpawn>(&command)) shapes_.take(*spawn);
      }
      return;
    case Kind::depth:
      return handle_depth(message, channel.robot, now);
    case Kind::picture:
      return handle_picture(channel.robot, now);
    case Kind::watched:
    case Kind::agent_scan:
    case Kind::none:
      return;
  }
}

/// Messages of the session are in each robot's list.
void StateFeed::record(const Channel& channel, SensorTime stamp) {
  const ArrivalTime arrival{options_.clock().ns};
  if (is_robot_channel(channel.canonical))
    return robots_[channel.robot].sensors.record(channel.canonical, stamp, arrival);
  for (RobotFeed& robot : robots_) robot.sensors.record(channel.canonical, stamp, arrival);
}

void StateFeed::restart(SimulationTime at) {
  start_ = at;
  shapes_ = simulation::EntityShapes(configuration_->scenario, configuration_->robot, configuration_->model,
                                     configuration_->robot_models);
  for (const RobotDescription& other : configuration_->other_robots) shapes_.add(other);
  shapes_.add(configuration_->objects);
  placed_.restart();
  knowledge_.restart();
  audience_.restart();
  for (RobotFeed& robot : robots_) robot.restart();
  agents_.restart();
  world_ = {};
  world_unread_ = false;
  events_.clear();
  new_events_.clear();
  operators_.clear();
  depth_due_ = agents_look_ = {};
  for (Subscriber& subscriber : subscribers().all()) greet(subscriber);
  if (restarted) restarted();
}

/// A session that was joined late starts with the first message received.
void StateFeed::note_start(SimulationTime at) {
  if (!start_) restart(at);
}

void StateFeed::handle_world(const Message& message, WallTime now) {
  if (const auto stamp = leading_stamp(message.payload)) note_start({stamp->ns});
  world_message_ = message;
  world_unread_ = true;
  if (!subscribers().empty()) send_world(now);
}

/// Decodes the newest world on demand. False: there is none.
bool StateFeed::read_world() {
  if (world_unread_ && !decode(world_message_.channel, world_message_.payload, world_).ok()) world_ = {};
  world_unread_ = false;
  return world_.stamp.ns != 0;
}

std::optional<Transform<Map, Base>> StateFeed::place_of(const std::string& entity) {
  if (!read_world()) return std::nullopt;
  const auto body = std::find_if(world_.bodies.begin(), world_.bodies.end(),
                                 [&](const WorldMessage::Entry& each) { return each.entity == entity; });
  if (body == world_.bodies.end()) return std::nullopt;
  return simulation::base_of(body->T_map_body);
}

std::vector<std::string> StateFeed::present_agents() {
  std::vector<std::string> names;
  if (!read_world()) return names;
  for (const WorldMessage::Entry& body : world_.bodies) {
    if (body.owner != BodyOwner::agent) continue;
    if (names.empty() || names.back() != body.entity) names.push_back(body.entity);
  }
  return names;
}

void StateFeed::handle_event(const Message& message) {
  Event event;
  if (message.payload.size() > kMaxEvent || !decode(message.channel, message.payload, event)) return;
  note_start(event.stamp);
  placed_.take(event);
  shapes_.take(event);
  // Only a contact is noted with where it was.
  const bool felt = event.kind == EventKind::contact_started && read_world();
  knowledge_.take(event, felt ? world_ : WorldMessage());
  for (RobotFeed& robot : robots_) robot.score_changed = robot.take(event) || robot.score_changed;
  if (event_received) event_received(event);
  if (event.kind == EventKind::contact_continues) return;  // reported at its start
  events_.push_back(event);
  if (events_.size() > kKeptEvents) events_.pop_front();
  if (!subscribers().empty()) new_events_.push_back(std::move(event));
}

void StateFeed::handle_scan(const Message& message, std::size_t index, ScanFrame::Source source) {
  if (subscribers().empty()) return;
  RobotFeed& robot = robots_[index];
  const bool augmented = source == ScanFrame::Source::augmented;
  if (augmented && robot.augmented_scan) send_augmented_scan(index, nullptr);
  if (!decode(message.channel, message.payload, scan_)) return;
  if (augmented) {
    robot.augmented_scan = scan_;
    return;
  }
  ScanFrame frame;
  frame.source = source;
  frame.t = t(robot.sensors.to_server(scan_.stamp));
  frame.T_map_laser = robot.place.laser_at(scan_.stamp);
  send_scan(index, scan_, frame, send_slot::kRealScan);
}

void StateFeed::handle_scan_info(const Message& message, std::size_t index) {
  RobotFeed& robot = robots_[index];
  ScanInfo& info = robot.info;
  const bool live = info.live;
  const std::string reason = std::move(info.reason);
  if (!decode(message.channel, message.payload, info)) {
    info = {};
    return;
  }
  robot.injection_changed = robot.injection_changed || live != info.live || reason != info.reason;
  if (info.live && read_world()) knowledge_.handle_scan(info, index, world_);
  if (robot.augmented_scan && robot.augmented_scan->stamp == info.stamp) send_augmented_scan(index, &info);
}

void StateFeed::handle_further_scan_info(const Message& message, std::size_t index) {
  ScanInfo info;
  if (!decode(message.channel, message.payload, info)) return;
  if (info.live && read_world()) knowledge_.handle_scan(info, index, world_);
}

/// What a picture shows is looked for ten times a second at most.
void StateFeed::handle_picture(std::size_t index, WallTime now) {
  RobotFeed& robot = robots_[index];
  if (now < robot.picture_due || robot.injection_suspended() || !read_world()) return;
  robot.picture_due = now + kPicturePeriod;
  knowledge_.handle_picture(index, world_);
}

/// Cameras of agents that trainees drive, without their pictures, which the station does not read.
void StateFeed::look_from_agents(WallTime now) {
  if (now < agents_look_ || !read_world()) return;
  agents_look_ = now + kPicturePeriod;
  for (const auto& [name, agent] : placed_.all()) {
    if (agent.camera_rate > 0 && runtime::is_driven_by_trainees(*configuration_, agent))
      knowledge_.handle_picture_of(agent, world_);
  }
}

/// With the entities hit, if MR_SCAN_INFO has arrived.
void StateFeed::send_augmented_scan(std::size_t index, const ScanInfo* info) {
  RobotFeed& robot = robots_[index];
  ScanFrame frame;
  frame.source = ScanFrame::Source::augmented;
  frame.t = t(robot.sensors.to_server(robot.augmented_scan->stamp));
  frame.T_map_laser = robot.place.laser_at(robot.augmented_scan->stamp);
  const auto entities = [info](const View& view) {
    std::vector<std::int16_t> numbers, beams;
    if (info == nullptr) return beams;
    for (const std::string& agent : info->agents) {
      const int entity = view.table.entity(view.name_of(agent));
      numbers.push_back(static_cast<std::int16_t>(entity > 32'767 ? -1 : entity));
    }
    for (const std::int16_t agent : info->beam_agent)
      beams.push_back(agent < 0 ? std::int16_t{-1} : numbers[static_cast<std::size_t>(agent)]);
    return beams;
  };
  send_scan(index, *robot.augmented_scan, frame, send_slot::kAugmentedScan, entities);
  robot.augmented_scan.reset();
}

/// To the pages that follow the robot.
void StateFeed::send_scan(std::size_t robot, const Scan& scan, ScanFrame frame, int slot,
                          const EntitiesIn& entities) {
  std::map<std::string_view, SharedText> made;  // by view
  for (const Subscriber& subscriber : subscribers().all()) {
    if (!subscriber.wants.scan || subscriber.robot != robot) continue;
    SharedText& bytes = made[subscriber.view];
    if (!bytes) {
      if (entities) frame.entities = entities(audience_.view_of(subscriber));
      bytes = shared_text(scan_bytes(scan, frame));
    }
    subscriber.client->send(bytes, true, slot);
  }
}

void StateFeed::handle_agent_scan(const Message& message) {
  const std::string agent = agent_of(message.channel);
  if (agent.empty()) return;
  const AgentDefinition* definition = placed_.find(agent);
  if (definition != nullptr && runtime::is_driven_by_trainees(*configuration_, *definition) && read_world())
    knowledge_.handle_scan_of(*definition, world_);
  std::map<std::string_view, SharedText> made;  // by view
  for (const Subscriber& subscriber : subscribers().all()) {
    const auto& wanted = subscriber.wants.agent_scans;
    const auto at = std::find(wanted.begin(), wanted.end(), agent);
    const View& view = audience_.view_of(subscriber);
    const int entity = view.table.entity(agent);
    if (at == wanted.end() || entity < 0 || !view.may_follow(agent)) continue;
    SharedText& bytes = made[subscriber.view];
    if (!bytes) {
      if (!decode(message.channel, message.payload, scan_)) return;
      ScanFrame frame;
      frame.source = ScanFrame::Source::agent;
      frame.part =
          static_cast<std::uint16_t>(view.table.entities()[static_cast<std::size_t>(entity)].parts.front());
      const SimulationTime taken = robots_.front().sensors.to_server(scan_.stamp);
      frame.t = t(taken);
      if (const auto mount = shapes_.laser_mount(agent))
        frame.T_map_laser = agents_.laser_at(agent, *mount, taken);
      bytes = shared_text(scan_bytes(scan_, frame));
    }
    subscriber.client->send(bytes, true, send_slot::kAgentScan + static_cast<int>(at - wanted.begin()));
  }
}

/// For pages that subscribe to points, a few times a second. The pose of a camera on a turning head is
/// unknown here.
void StateFeed::handle_depth(const Message& message, std::size_t index, WallTime now) {
  const auto& all = subscribers().all();
  const RobotFeed& robot = robots_[index];
  const auto& camera = configuration_->robot_at(index).depth;
  const auto wants = [index](const Subscriber& subscriber) {
    return subscriber.wants.points && subscriber.robot == index;
  };
  const bool wanted = std::any_of(all.begin(), all.end(), wants);
  if (!wanted || !camera || !camera->head.empty() || now < depth_due_) return;
  Image image;
  if (!decode(message.channel, message.payload, image).ok()) return;
  const auto place = robot.place.base_at(image.stamp);
  const auto pixels = place ? render::decode_depth(image) : Result<render::DepthPixels>(Error{"no pose"});
  if (!pixels) return;
  depth_due_ = now + kPointsPeriod;
  const SharedText bytes = shared_text(depth_bytes(*pixels, *camera, *place * camera->T_base_optical,
                                                   t(robot.sensors.to_server(image.stamp))));
  for (const Subscriber& subscriber : all) {
    if (wants(subscriber)) subscriber.client->send(bytes, true, send_slot::kPoints);
  }
}

void StateFeed::handle_operator(const Message& message, WallTime now) {
  OperatorStatus status;
  if (!decode(message.channel, message.payload, status)) return;
  auto known = operators_.find(status.name);
  const bool is_new = known == operators_.end();
  if (is_new && operators_.size() >= kShownOperators && !make_room_for(status.name, now)) return;
  if (is_new) known = operators_.emplace(status.name, ShownOperator{{}, now, {}}).first;
  const OperatorStatus& before = known->second.status;
  if (is_new || before.robot != status.robot || before.state != status.state) operators_changed_ = true;
  known->second.status = std::move(status);
  known->second.last = now;
}

void StateFeed::note_pages() {
  page_operators_.clear();
  for (const Subscriber& each : subscribers().all())
    page_operators_.insert(operator_name(each.client->who()));
}

/// Names come from the bus. A name of an open page always has a place; another one if it is repeated, as
/// consoles do: it displaces a name that was sent only once, else the one that has been silent for longest.
bool StateFeed::make_room_for(const std::string& name, WallTime now) {
  const bool is_page = page_operators_.contains(name);
  if (!is_page && !seen_names_.repeated_since(name, ArrivalTime{now.ns})) return false;
  const auto rank = [](const ShownOperator& each) { return std::pair(each.is_repeated(), each.last); };
  auto leaves = operators_.end();
  for (auto each = operators_.begin(); each != operators_.end(); ++each) {
    const bool leaves_sooner = leaves == operators_.end() || rank(each->second) < rank(leaves->second);
    if (leaves_sooner && !page_operators_.contains(each->first)) leaves = each;
  }
  if (leaves == operators_.end()) return is_page;
  operators_.erase(leaves);
  return true;
}

void StateFeed::handle_model(const Message& message) {
  ModelVersion version;
  if (!decode(message.channel, message.payload, version)) return;
  const auto model = parse_model(version.yaml, message.channel);
  if (!model) return;
  model_version_ = version.version;
  shapes_.take(*model);
  knowledge_.set_building(*model);
  if (model_changed) model_changed(site_json(*model, version.version), version.version);
  audience_.send([&](const View& /*all*/) { return model_json(version.version); });
}

}  // namespace parhelion::station
