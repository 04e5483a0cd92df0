// The codec against its slow twin, what lcm-gen wrote: the same bytes for random messages, and back to the
// same values.
#include <gtest/gtest.h>
// After gtest.h, which it does not include itself.
#include <rapidcheck/gtest.h>

#include <cstring>

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
#include "parhelion/loop_t.hpp"
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
#include "parhelion/twist2D_t.hpp"
#include "parhelion/world_t.hpp"
#include "protocols/codec.hpp"

namespace parhelion {
namespace {

std::int64_t any_utime() { return *rc::gen::inRange<std::int64_t>(0, 7'258'118'400'000'000); }
SensorTime any_stamp() { return SensorTime::from_utime(any_utime()); }
double any_within(double limit) {
  return static_cast<double>(*rc::gen::inRange<std::int64_t>(-1'000'000'000, 1'000'000'001)) * 1e-9 * limit;
}
Eigen::Vector3d any_vector(double limit) { return {any_within(limit), any_within(limit), any_within(limit)}; }

template <class A, class B>
Transform<A, B> any_transform() {
  Eigen::Quaterniond q(any_within(1), any_within(1), any_within(1), any_within(1));
  if (q.norm() < 1e-3) q = Eigen::Quaterniond::Identity();
  return {q, any_vector(1e6)};
}

std::string any_text() { return *rc::gen::container<std::string>(rc::gen::nonZero<char>()); }

std::string any_name() {
  std::string name = *rc::gen::container<std::string>(
      rc::gen::oneOf(rc::gen::inRange('a', '{'), rc::gen::inRange('A', '['), rc::gen::inRange('0', ':'),
                     rc::gen::element('_', '-')));
  return name.substr(0, 39) + "x";
}

template <class Enumeration>
Enumeration any_enumerator(Enumeration last) {
  return static_cast<Enumeration>(*rc::gen::inRange(0, static_cast<int>(last) + 1));
}

/// Encodes with the codec; liblcm's decoder must take it, and liblcm's encoder must write the same bytes from
/// that.
template <class Generated, class T>
Generated through_liblcm(const T& message, T& decoded) {
  std::vector<std::uint8_t> bytes;
  encode(message, bytes);
  Generated twin;
  RC_ASSERT(twin.decode(bytes.data(), 0, static_cast<int>(bytes.size())) == static_cast<int>(bytes.size()));
  std::vector<std::uint8_t> twin_bytes(static_cast<std::size_t>(twin.getEncodedSize()));
  RC_ASSERT(twin.encode(twin_bytes.data(), 0, static_cast<int>(twin_bytes.size())) ==
            static_cast<int>(twin_bytes.size()));
  RC_ASSERT(twin_bytes == bytes);
  const Status status = decode("CHANNEL", bytes, decoded);
  if (!status) RC_FAIL(status.error().message);
  return twin;
}

template <class A, class B>
bool near(const Transform<A, B>& a, const Transform<A, B>& b) {
  return a.translation() == b.translation() && (a.rotation() - b.rotation()).norm() < 1e-12;
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0);
}

RC_GTEST_PROP(CodecTwin, Scan, ()) {
  Scan scan, back;
  scan.stamp = any_stamp();
  const auto bits = *rc::gen::nonEmpty<std::vector<std::uint32_t>>();
  for (const std::uint32_t b : bits) scan.ranges.push_back(std::bit_cast<float>(b));
  if (*rc::gen::arbitrary<bool>()) scan.intensities.assign(scan.ranges.rbegin(), scan.ranges.rend());
  scan.angle_first = static_cast<float>(any_within(3.2));
  scan.angle_step = static_cast<float>(any_within(0.1)) + 0.11F;
  const auto twin = through_liblcm<planar_lidar_t>(scan, back);
  RC_ASSERT(back.stamp == scan.stamp && twin.utime == scan.stamp.utime());
  RC_ASSERT(same_bits(back.ranges, scan.ranges) && same_bits(twin.ranges, scan.ranges));
  RC_ASSERT(same_bits(back.intensities, scan.intensities) && same_bits(twin.intensities, scan.intensities));
  RC_ASSERT(back.angle_first == scan.angle_first && twin.rad0 == scan.angle_first);
  RC_ASSERT(back.angle_step == scan.angle_step && twin.radstep == scan.angle_step);
}

RC_GTEST_PROP(CodecTwin, Imu, ()) {
  ImuSample sample, back;
  sample.stamp = any_stamp();
  if (*rc::gen::arbitrary<bool>()) sample.orientation = any_transform<Map, Base>().quaternion();
  sample.rotation_rate = any_vector(1e3);
  sample.acceleration = any_vector(1e3);
  const auto twin = through_liblcm<imu_t>(sample, back);
  RC_ASSERT(back.stamp == sample.stamp && twin.utime == sample.stamp.utime());
  RC_ASSERT(back.orientation.has_value() == sample.orientation.has_value());
  RC_ASSERT(!back.orientation || back.orientation->angularDistance(*sample.orientation) < 1e-7);
  RC_ASSERT(back.rotation_rate == sample.rotation_rate && back.acceleration == sample.acceleration);
  RC_ASSERT(twin.rotation_rate[2] == sample.rotation_rate.z() && twin.accel[0] == sample.acceleration.x());
}

RC_GTEST_PROP(CodecTwin, Joints, ()) {
  Joints joints, back;
  joints.stamp = any_stamp();
  const int n = *rc::gen::inRange(1, 12);
  const auto values = [n](std::vector<double>& list) {
    if (*rc::gen::arbitrary<bool>()) return;
    for (int i = 0; i < n; ++i) list.push_back(any_within(1e4));
  };
  for (int i = 0; i < n; ++i) joints.names.push_back(any_name() + std::to_string(i));
  values(joints.positions);
  values(joints.velocities);
  values(joints.efforts);
  const auto twin = through_liblcm<joints_t>(joints, back);
  RC_ASSERT(back.stamp == joints.stamp && twin.utime == joints.stamp.utime());
  RC_ASSERT(back.names == joints.names && twin.names == joints.names);
  RC_ASSERT(back.positions == joints.positions && twin.positions == joints.positions);
  RC_ASSERT(back.velocities == joints.velocities && twin.velocities == joints.velocities);
  RC_ASSERT(back.efforts == joints.efforts && twin.efforts == joints.efforts);
}

RC_GTEST_PROP(CodecTwin, Image, ()) {
  Image image, back;
  image.stamp = any_stamp();
  image.width = *rc::gen::inRange(1, 30);
  image.height = *rc::gen::inRange(1, 30);
  image.format = *rc::gen::element(PixelFormat::gray, PixelFormat::rgb, PixelFormat::bgr);
  image.row_stride = image.width * 3 + *rc::gen::inRange(0, 5);
  image.bytes = *rc::gen::container<std::vector<std::uint8_t>>(
      static_cast<std::size_t>(image.row_stride * image.height), rc::gen::arbitrary<std::uint8_t>());
  for (int i = *rc::gen::inRange(0, 4); i > 0; --i) {
    image.metadata.push_back({any_text(), *rc::gen::arbitrary<std::vector<std::uint8_t>>()});
  }
  const auto twin = through_liblcm<image_t>(image, back);
  RC_ASSERT(back.stamp == image.stamp && back.width == image.width && back.height == image.height);
  RC_ASSERT(twin.width == image.width && twin.height == image.height && twin.row_stride == image.row_stride);
  RC_ASSERT(back.format == image.format && back.row_stride == image.row_stride && back.bytes == image.bytes);
  RC_ASSERT(twin.data == image.bytes && back.metadata.size() == image.metadata.size());
  for (std::size_t i = 0; i < image.metadata.size(); ++i) {
    RC_ASSERT(back.metadata[i].key == image.metadata[i].key &&
              back.metadata[i].value == image.metadata[i].value);
    RC_ASSERT(twin.metadata[i].key == image.metadata[i].key &&
              twin.metadata[i].value == image.metadata[i].value);
  }
}

RC_GTEST_PROP(CodecTwin, Odometry, ()) {
  Odometry odometry, back;
  odometry.stamp = any_stamp();
  odometry.T_odom_base = Transform<Odom, Base>::planar(
      static_cast<float>(any_within(1000)), static_cast<float>(any_within(1000)), any_within(3.14));
  const auto twin = through_liblcm<pose2D_t>(odometry, back);
  RC_ASSERT(back.stamp == odometry.stamp);
  RC_ASSERT(back.T_odom_base.translation() == odometry.T_odom_base.translation());
  RC_ASSERT(std::abs(back.T_odom_base.yaw() - odometry.T_odom_base.yaw()) < 1e-6);
  RC_ASSERT(static_cast<double>(twin.x) == odometry.T_odom_base.translation().x());
  RC_ASSERT(static_cast<double>(twin.y) == odometry.T_odom_base.translation().y());
}

RC_GTEST_PROP(CodecTwin, PoseEstimate, ()) {
  PoseEstimate estimate, back;
  estimate.stamp = any_stamp();
  estimate.T_map_base = any_transform<Map, Base>();
  PoseCovariance root;
  for (int i = 0; i < 36; ++i) root(i) = any_within(10);
  estimate.covariance = root * root.transpose();
  estimate.map_id = any_text();
  estimate.state = any_enumerator(SlamState::lost);
  estimate.step_time = nanoseconds(*rc::gen::inRange<std::int64_t>(0, 10'000'000'000));
  estimate.causal = *rc::gen::arbitrary<bool>();
  const auto twin = through_liblcm<pose_cov_t>(estimate, back);
  RC_ASSERT(back.stamp == estimate.stamp && near(back.T_map_base, estimate.T_map_base));
  RC_ASSERT(back.covariance == estimate.covariance && back.map_id == estimate.map_id);
  RC_ASSERT(back.state == estimate.state && back.step_time == estimate.step_time &&
            back.causal == estimate.causal);
  RC_ASSERT(twin.covariance[1] == estimate.covariance(0, 1) && twin.orientation[0] >= 0);
}

RC_GTEST_PROP(CodecTwin, PoseStamped, ()) {
  PoseStamped pose{any_stamp(), any_transform<Map, Base>(), any_vector(100), any_vector(100),
                   any_vector(100)},
      back;
  const auto twin = through_liblcm<pose_t>(pose, back);
  RC_ASSERT(back.stamp == pose.stamp && near(back.T_map_base, pose.T_map_base));
  RC_ASSERT(back.velocity == pose.velocity && back.rotation_rate == pose.rotation_rate);
  RC_ASSERT(back.acceleration == pose.acceleration);
  RC_ASSERT(twin.pos[2] == pose.T_map_base.translation().z() && twin.vel[1] == pose.velocity.y());
  RC_ASSERT(twin.rotation_rate[0] == pose.rotation_rate.x() && twin.accel[2] == pose.acceleration.z());
}

RC_GTEST_PROP(CodecTwin, TwistCommand, ()) {
  const auto figure = [] { return static_cast<double>(static_cast<float>(any_within(10))); };
  TwistCommand command{any_stamp(), {figure(), figure(), figure()}}, back;
  const auto twin = through_liblcm<twist2D_t>(command, back);
  RC_ASSERT(back.stamp == command.stamp && back.twist.vx == command.twist.vx);
  RC_ASSERT(back.twist.vy == command.twist.vy && back.twist.wz == command.twist.wz);
  RC_ASSERT(static_cast<double>(twin.vx) == command.twist.vx &&
            static_cast<double>(twin.wz) == command.twist.wz);
}

template <class Command>
Command any_command() {
  Command command;
  command.stamp = any_stamp();
  command.request = *rc::gen::arbitrary<std::uint64_t>();
  return command;
}

/// The head that all instructor's commands have.
template <class Command, class Twin>
void expect_same_head(const Command& command, const Command& back, const Twin& twin) {
  RC_ASSERT(back.stamp == command.stamp && back.request == command.request);
  RC_ASSERT(twin.utime == command.stamp.utime());
  RC_ASSERT(static_cast<std::uint64_t>(twin.request) == command.request);
}

Behaviour any_behaviour() {
  Behaviour behaviour;
  behaviour.kind = any_enumerator(kLastBehaviourKind);
  behaviour.speed = std::abs(any_within(5));
  for (int i = *rc::gen::inRange(0, 6); i > 0; --i)
    behaviour.waypoints.emplace_back(any_within(1000), any_within(1000));
  behaviour.target = any_text();
  behaviour.distance = std::abs(any_within(100));
  behaviour.yields = *rc::gen::arbitrary<bool>();
  behaviour.opens_doors = *rc::gen::arbitrary<bool>();
  return behaviour;
}

void expect_same(const Behaviour& behaviour, const Behaviour& back, const behaviour_t& twin) {
  RC_ASSERT(back.kind == behaviour.kind && twin.kind == static_cast<int>(behaviour.kind));
  RC_ASSERT(back.speed == behaviour.speed && twin.speed == behaviour.speed);
  RC_ASSERT(back.waypoints == behaviour.waypoints);
  RC_ASSERT(static_cast<std::size_t>(twin.nwaypoints) == behaviour.waypoints.size());
  RC_ASSERT(back.target == behaviour.target && twin.target == behaviour.target);
  RC_ASSERT(back.distance == behaviour.distance && twin.distance == behaviour.distance);
  RC_ASSERT(back.yields == behaviour.yields && bool(twin.yields) == behaviour.yields);
  RC_ASSERT(back.opens_doors == behaviour.opens_doors && bool(twin.opens_doors) == behaviour.opens_doors);
}

Transform<Map, Base> any_place() {
  return Transform<Map, Base>::planar(any_within(1000), any_within(1000), any_within(3.14), any_within(10));
}

RC_GTEST_PROP(CodecTwin, AgentSpawn, ()) {
  auto command = any_command<AgentSpawn>(), back = AgentSpawn();
  AgentDefinition& agent = command.agent;
  agent.name = any_name();
  agent.kind = any_enumerator(kLastAgentKind);
  agent.T_map_base = any_place();
  agent.size = any_vector(49).array() + 50;
  agent.behaviour = any_behaviour();
  agent.laser = any_text();
  agent.model = any_text();
  agent.camera_rate = std::abs(any_within(60));
  const auto twin = through_liblcm<agent_spawn_t>(command, back);
  expect_same_head(command, back, twin);
  RC_ASSERT(back.agent.name == agent.name && back.agent.kind == agent.kind);
  RC_ASSERT(near(back.agent.T_map_base, agent.T_map_base) && back.agent.size == agent.size);
  RC_ASSERT(back.agent.laser == agent.laser && back.agent.model == agent.model);
  RC_ASSERT(back.agent.camera_rate == agent.camera_rate && twin.camera_rate == agent.camera_rate);
  expect_same(agent.behaviour, back.agent.behaviour, twin.behaviour);
  RC_ASSERT(twin.name == agent.name && twin.laser == agent.laser && twin.model == agent.model);
  RC_ASSERT(twin.z == agent.T_map_base.translation().z() && twin.size[2] == agent.size.z());
}

RC_GTEST_PROP(CodecTwin, AgentMove, ()) {
  auto command = any_command<AgentMove>(), back = AgentMove();
  command.agent = any_name();
  command.T_map_base = any_place();
  const auto twin = through_liblcm<agent_move_t>(command, back);
  expect_same_head(command, back, twin);
  RC_ASSERT(back.agent == command.agent && near(back.T_map_base, command.T_map_base));
  RC_ASSERT(twin.name == command.agent && twin.y == command.T_map_base.translation().y());
}

RC_GTEST_PROP(CodecTwin, AgentBehaviour, ()) {
  auto command = any_command<AgentBehaviour>(), back = AgentBehaviour();
  command.agent = any_name();
  command.behaviour = any_behaviour();
  const auto twin = through_liblcm<agent_behaviour_t>(command, back);
  expect_same_head(command, back, twin);
  RC_ASSERT(back.agent == command.agent && twin.name == command.agent);
  expect_same(command.behaviour, back.behaviour, twin.behaviour);
}

RC_GTEST_PROP(CodecTwin, AgentRemoveAndFreeze, ()) {
  auto remove = any_command<AgentRemove>(), removed = AgentRemove();
  remove.all = *rc::gen::arbitrary<bool>();
  if (!remove.all) remove.agent = any_name();
  const auto remove_twin = through_liblcm<agent_remove_t>(remove, removed);
  expect_same_head(remove, removed, remove_twin);
  RC_ASSERT(removed.all == remove.all && removed.agent == remove.agent);
  RC_ASSERT(bool(remove_twin.all) == remove.all && remove_twin.name == remove.agent);
  auto freeze = any_command<AgentFreeze>(), frozen = AgentFreeze();
  freeze.all = remove.all;
  freeze.agent = remove.agent;
  freeze.frozen = *rc::gen::arbitrary<bool>();
  const auto freeze_twin = through_liblcm<agent_freeze_t>(freeze, frozen);
  expect_same_head(freeze, frozen, freeze_twin);
  RC_ASSERT(frozen.all == freeze.all && frozen.agent == freeze.agent && frozen.frozen == freeze.frozen);
  RC_ASSERT(bool(freeze_twin.all) == freeze.all && bool(freeze_twin.frozen) == freeze.frozen);
}

RC_GTEST_PROP(CodecTwin, DoorCommand, ()) {
  auto command = any_command<DoorCommand>(), back = DoorCommand();
  command.door = any_name();
  if (*rc::gen::arbitrary<bool>()) command.opening = any_within(3.14);
  const auto twin = through_liblcm<door_cmd_t>(command, back);
  expect_same_head(command, back, twin);
  RC_ASSERT(back.door == command.door && back.opening == command.opening && twin.name == command.door);
  RC_ASSERT(bool(twin.known) == command.opening.has_value() && twin.opening == command.opening.value_or(0));
}

RC_GTEST_PROP(CodecTwin, FaultCommand, ()) {
  auto command = any_command<FaultCommand>(), back = FaultCommand();
  command.kind = any_enumerator(kLastLessonKind);
  command.begins = *rc::gen::arbitrary<bool>();
  command.amount = any_within(1);
  command.right = *rc::gen::arbitrary<bool>();
  if (*rc::gen::arbitrary<bool>()) command.duration = std::abs(any_within(60)) + 0.1;
  const auto twin = through_liblcm<fault_cmd_t>(command, back);
  expect_same_head(command, back, twin);
  RC_ASSERT(back.kind == command.kind && back.begins == command.begins && back.amount == command.amount);
  RC_ASSERT(back.right == command.right && back.duration == command.duration);
  RC_ASSERT(twin.kind == static_cast<int>(command.kind) && bool(twin.begins) == command.begins);
  RC_ASSERT(twin.side == (command.right ? 1 : 0) && twin.duration == command.duration.value_or(0));
}

RC_GTEST_PROP(CodecTwin, CameraRateAndScriptStart, ()) {
  auto rate = any_command<CameraRate>(), rate_back = CameraRate();
  rate.agent = any_name();
  rate.rate = std::abs(any_within(60));
  const auto rate_twin = through_liblcm<camera_rate_t>(rate, rate_back);
  expect_same_head(rate, rate_back, rate_twin);
  RC_ASSERT(rate_back.agent == rate.agent && rate_back.rate == rate.rate && rate_twin.rate == rate.rate);
  auto start = any_command<ScriptStart>(), start_back = ScriptStart();
  start.script = any_name();
  const auto start_twin = through_liblcm<script_start_t>(start, start_back);
  expect_same_head(start, start_back, start_twin);
  RC_ASSERT(start_back.script == start.script && start_twin.script == start.script);
}

RC_GTEST_PROP(CodecTwin, ObjectReport, ()) {
  auto command = any_command<ObjectReport>(), back = ObjectReport();
  command.object = any_name();
  if (*rc::gen::arbitrary<bool>()) command.position.emplace(any_within(1000), any_within(1000));
  const auto twin = through_liblcm<object_report_t>(command, back);
  expect_same_head(command, back, twin);
  RC_ASSERT(back.object == command.object && back.position == command.position);
  RC_ASSERT(bool(twin.position_known) == command.position.has_value());
  if (command.position) RC_ASSERT(twin.x == command.position->x() && twin.y == command.position->y());
}

RC_GTEST_PROP(CodecTwin, EmergencyStop, ()) {
  auto command = any_command<EmergencyStopCommand>(), back = EmergencyStopCommand();
  if (*rc::gen::arbitrary<bool>()) command.robot = any_name();
  command.engaged = *rc::gen::arbitrary<bool>();
  const auto twin = through_liblcm<emergency_stop_t>(command, back);
  expect_same_head(command, back, twin);
  RC_ASSERT(back.robot == command.robot && back.engaged == command.engaged);
  RC_ASSERT(twin.robot == command.robot && bool(twin.engaged) == command.engaged);
}

RC_GTEST_PROP(CodecTwin, Event, ()) {
  Event event{{any_utime() * 1000 + *rc::gen::inRange(0, 1000)},
              any_enumerator(kLastEventKind),
              any_text(),
              any_text(),
              any_enumerator(PairKind::virtual_virtual),
              any_vector(1000),
              any_within(1000),
              any_within(1000),
              *rc::gen::arbitrary<bool>(),
              *rc::gen::arbitrary<std::uint64_t>(),
              any_text()};
  Event back;
  const auto twin = through_liblcm<event_t>(event, back);
  RC_ASSERT(back.stamp == event.stamp && back.kind == event.kind && back.subject == event.subject);
  RC_ASSERT(back.object == event.object && back.pair == event.pair && back.position == event.position);
  RC_ASSERT(back.impulse == event.impulse && back.value == event.value && back.unsensed == event.unsensed &&
            back.request == event.request);
  RC_ASSERT(back.text == event.text && twin.text == event.text &&
            twin.utime * 1000 + twin.ns == event.stamp.ns);
  RC_ASSERT(twin.subject == event.subject && twin.object == event.object);
}

RC_GTEST_PROP(CodecTwin, SessionHeader, ()) {
  SessionHeader header{any_stamp(), any_text(), any_text(), any_text(), *rc::gen::arbitrary<std::uint64_t>(),
                       any_text(),  {},         {}};
  for (int i = *rc::gen::inRange(0, 5); i > 0; --i) header.input_channels.push_back(any_text());
  for (int i = *rc::gen::inRange(0, 3); i > 0; --i)
    header.robot_models.push_back({any_text(), any_text(), any_text()});
  SessionHeader back;
  const auto twin = through_liblcm<session_t>(header, back);
  RC_ASSERT(back.stamp == header.stamp && back.scenario_yaml == header.scenario_yaml);
  RC_ASSERT(back.model_yaml == header.model_yaml && back.robot_yaml == header.robot_yaml);
  RC_ASSERT(back.seed == header.seed && back.version == header.version);
  RC_ASSERT(back.input_channels == header.input_channels && twin.input_channels == header.input_channels);
  RC_ASSERT(twin.model_yaml == header.model_yaml && twin.version == header.version);
  RC_ASSERT(back.robot_models.size() == header.robot_models.size());
  for (std::size_t i = 0; i < back.robot_models.size(); ++i) {
    const RobotModelTexts &read = back.robot_models[i], &written = header.robot_models[i];
    RC_ASSERT(read.name == written.name && read.urdf == written.urdf && read.yaml == written.yaml);
    RC_ASSERT(twin.robot_model_names[i] == written.name && twin.robot_model_urdfs[i] == written.urdf &&
              twin.robot_model_yamls[i] == written.yaml);
  }
}

RC_GTEST_PROP(CodecTwin, OperatorWord, ()) {
  const OperatorWord word{any_stamp(), "o" + any_name().substr(0, 30), any_name(),
                          any_enumerator(OperatorWord::State::lost), any_text()};
  OperatorWord back;
  const auto twin = through_liblcm<operator_t>(word, back);
  RC_ASSERT(back.stamp == word.stamp && back.name == word.name && back.robot == word.robot);
  RC_ASSERT(back.state == word.state && back.text == word.text);
  RC_ASSERT(twin.name == word.name && twin.robot == word.robot && twin.text == word.text &&
            twin.state == static_cast<int>(word.state));
}

RC_GTEST_PROP(CodecTwin, HazardReading, ()) {
  HazardReading reading, back;
  reading.stamp = any_stamp();
  for (int i = *rc::gen::inRange(0, 16); i > 0; --i)
    reading.values.push_back({*rc::gen::arbitrary<bool>() ? HazardKind::gas : HazardKind::radiation,
                              std::abs(any_within(1e6)), any_text()});
  const auto twin = through_liblcm<hazard_reading_t>(reading, back);
  RC_ASSERT(back.stamp == reading.stamp && back.values.size() == reading.values.size());
  for (std::size_t i = 0; i < back.values.size(); ++i) {
    const HazardReading::Value &read = back.values[i], &written = reading.values[i];
    RC_ASSERT(read.kind == written.kind && read.value == written.value && read.unit == written.unit);
    RC_ASSERT(twin.kinds[i] == static_cast<int>(written.kind) && twin.values[i] == written.value &&
              twin.units[i] == written.unit);
  }
}

RC_GTEST_PROP(CodecTwin, ScanInfo, ()) {
  ScanInfo info{any_stamp(), *rc::gen::arbitrary<bool>(), any_text(), std::abs(any_within(10)), {}, {}}, back;
  for (int i = *rc::gen::inRange(0, 5); i > 0; --i) info.agents.push_back(any_name());
  for (int i = *rc::gen::inRange(0, 400); i > 0; --i) {
    info.beam_agent.push_back(
        static_cast<std::int16_t>(*rc::gen::inRange(-1, static_cast<int>(info.agents.size()))));
  }
  const auto twin = through_liblcm<scan_info_t>(info, back);
  RC_ASSERT(back.stamp == info.stamp && back.live == info.live && back.reason == info.reason);
  RC_ASSERT(back.predicted_error == info.predicted_error && back.agents == info.agents);
  RC_ASSERT(back.beam_agent == info.beam_agent && twin.beam_agent == info.beam_agent &&
            twin.agents == info.agents);
}

RC_GTEST_PROP(CodecTwin, LoopDecision, ()) {
  LoopDecision decision{any_stamp(), any_enumerator(LoopDecision::Kind::foreign_message),
                        *rc::gen::inRange<std::int64_t>(0, INT64_MAX)};
  LoopDecision back;
  const auto twin = through_liblcm<loop_t>(decision, back);
  RC_ASSERT(back.stamp == decision.stamp && back.kind == decision.kind && back.count == decision.count);
  RC_ASSERT(twin.count == decision.count);
}

RC_GTEST_PROP(CodecTwin, ServerStatus, ()) {
  ServerStatus status{any_stamp(), {}, {}}, back;
  for (int i = *rc::gen::inRange(0, 6); i > 0; --i) status.values.emplace_back(any_text(), any_within(1e9));
  for (int i = *rc::gen::inRange(0, 6); i > 0; --i) status.notes.emplace_back(any_text(), any_text());
  const auto twin = through_liblcm<status_t>(status, back);
  RC_ASSERT(back.stamp == status.stamp && back.values == status.values && back.notes == status.notes);
  RC_ASSERT(twin.nvalues == static_cast<int>(status.values.size()));
}

RC_GTEST_PROP(CodecTwin, ModelVersion, ()) {
  ModelVersion model{any_stamp(), static_cast<std::uint64_t>(*rc::gen::inRange<std::int64_t>(1, INT64_MAX)),
                     any_text()};
  ModelVersion back;
  const auto twin = through_liblcm<model_t>(model, back);
  RC_ASSERT(back.stamp == model.stamp && back.version == model.version && back.yaml == model.yaml);
  RC_ASSERT(twin.yaml == model.yaml);
}

RC_GTEST_PROP(CodecTwin, RobotMessage, ()) {
  RobotMessage message{any_stamp(), any_text()}, back;
  const auto twin = through_liblcm<robot_t>(message, back);
  RC_ASSERT(back.stamp == message.stamp && back.yaml == message.yaml && twin.yaml == message.yaml);
}

RC_GTEST_PROP(CodecTwin, WorldMessage, ()) {
  WorldMessage world, back;
  world.stamp = {any_utime() * 1000 + *rc::gen::inRange(0, 1000)};
  world.step = *rc::gen::arbitrary<std::uint64_t>();
  world.attitude_known = *rc::gen::arbitrary<bool>();
  for (int i = *rc::gen::inRange(0, 8); i > 0; --i) {
    world.bodies.push_back({any_text(), any_text(), any_enumerator(kLastAgentKind),
                            any_enumerator(BodyOwner::building), *rc::gen::arbitrary<std::uint32_t>(),
                            any_transform<Map, Body>(), any_vector(100), any_vector(100)});
  }
  const auto twin = through_liblcm<world_t>(world, back);
  RC_ASSERT(back.stamp == world.stamp && back.step == world.step &&
            back.bodies.size() == world.bodies.size());
  RC_ASSERT(back.attitude_known == world.attitude_known &&
            (twin.attitude_known != 0) == world.attitude_known);
  for (std::size_t i = 0; i < world.bodies.size(); ++i) {
    const auto &a = world.bodies[i], &b = back.bodies[i];
    RC_ASSERT(a.entity == b.entity && a.part == b.part && a.kind == b.kind && a.owner == b.owner);
    RC_ASSERT(a.epoch == b.epoch && near(a.T_map_body, b.T_map_body));
    RC_ASSERT(a.velocity == b.velocity && a.rotation_rate == b.rotation_rate);
    RC_ASSERT(twin.bodies[i].entity == a.entity && twin.bodies[i].pos[0] == a.T_map_body.translation().x());
  }
}

}  // namespace
}  // namespace parhelion
