// A message of every wire type with all fields set, for tests that iterate over all of them.
#pragma once

#include <bit>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "protocols/codec.hpp"

namespace parhelion::test {

struct Sample {
  std::string type;
  std::string written_as;  ///< the type written by encode
  std::vector<std::uint8_t> bytes;
  std::function<Status(Bytes)> decode;
  std::function<std::vector<std::uint8_t>()> encode_again;  ///< encodes what was decoded last
};

template <class T>
Sample sample(const std::string& type, const T& message) {
  Sample made;
  made.type = made.written_as = type;
  encode(message, made.bytes);
  const auto decoded = std::make_shared<T>();
  made.decode = [decoded](Bytes bytes) { return decode("CHANNEL", bytes, *decoded); };
  made.encode_again = [decoded] {
    std::vector<std::uint8_t> bytes;
    encode(*decoded, bytes);
    return bytes;
  };
  return made;
}

inline constexpr SensorTime kSampleStamp = SensorTime::from_utime(1'136'391'912'123'456);

inline Scan sample_scan() {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  Scan scan;
  scan.stamp = kSampleStamp;
  scan.ranges = {1.5F, 0.0F, 81.83F, infinity, -infinity, std::numeric_limits<float>::quiet_NaN(), -1.0F};
  scan.intensities = {1, 2, 3, 4, 5, 6, 7};
  scan.angle_min = -1.5F;
  scan.angle_increment = 0.5F;
  return scan;
}

/// Clockwise and past half a turn, as an MBot's.
inline Scan sample_uneven_scan() {
  Scan scan = sample_scan();
  scan.angles = {3.0F, 2.5F, -3.1F, -2.6F, 1.0F, 0.5F, 6.25F};
  for (std::size_t i = 0; i < scan.angles.size(); ++i)
    scan.times.push_back(kSampleStamp.utime() + static_cast<std::int64_t>(i) * 400);
  return scan;
}

inline Image sample_depth() {
  const std::string raw = "raw";
  return {kSampleStamp,
          2,
          3,
          6,
          PixelFormat::depth_mm,
          std::vector<std::uint8_t>(18, 7),
          {{"encoding", {raw.begin(), raw.end()}}, {"empty", {}}}};
}

constexpr std::uint64_t kSampleRequest = 0xFFFF'FFFF'FFFF'FFFFU;

inline Behaviour sample_behaviour() {
  return {BehaviourKind::patrol, 0.7, {{1, 2}, {3, 4}}, "guide-2", 2.5, true, false};
}

inline AgentSpawn sample_spawn() {
  AgentSpawn command{.stamp = kSampleStamp, .request = kSampleRequest};
  command.agent.name = "guide-1";
  command.agent.kind = AgentKind::person;
  command.agent.T_map_base = Transform<Map, Base>::planar(1, -2, 0.5, 3);
  command.agent.behaviour = sample_behaviour();
  command.agent.laser = "lms-200";
  command.agent.camera_rate = 5;
  return command;
}

inline FaultCommand sample_fault() {
  return {.stamp = kSampleStamp,
          .request = kSampleRequest,
          .kind = Fault::Kind::dead_wheel,
          .right = true,
          .duration = 12.5};
}

inline Event sample_event() {
  Event event;
  event.stamp = {kSampleStamp.ns + 789};
  event.kind = EventKind::contact_started;
  event.subject = "robot";
  event.object = "guide-1";
  event.pair = PairKind::real_virtual;
  event.position = {1, 2, 3};
  event.impulse = 4.5;
  event.value = -0.25;
  event.request = 17;
  event.text = "bumper, \"left\"";
  return event;
}

inline WorldMessage sample_world() {
  WorldMessage world;
  world.stamp = {kSampleStamp.ns + 1};
  world.step = 240;
  world.robot = "rover";
  world.bodies.resize(2);
  world.bodies[0].entity = "guide-1";
  world.bodies[0].part = "torso";
  world.bodies[0].epoch = 4'000'000'000U;
  world.bodies[0].T_map_body = Transform<Map, Body>::planar(1, 2, 3, 4);
  world.bodies[1].owner = BodyOwner::real_robot;
  world.bodies[1].velocity = {0.1, 0.2, 0.3};
  world.bodies[1].attitude_known = false;
  WorldMessage::Person person;
  person.entity = "real person 7";
  person.radius = 0.25;
  person.covariance << 0.01, 0.002, 0.002, 0.02;
  person.seen = {kSampleStamp.ns};
  world.persons = {person};
  return world;
}

inline PoseEstimate sample_estimate() {
  PoseEstimate estimate;
  estimate.stamp = kSampleStamp;
  estimate.T_map_base = Transform<Map, Base>::planar(1, 2, 3);
  estimate.covariance.diagonal() << 1, 2, 3, 4, 5, 6;
  estimate.covariance(0, 5) = estimate.covariance(5, 0) = 0.25;
  estimate.map_id = "sena";
  estimate.state = SlamState::tracking;
  estimate.step_time = microseconds(3500);
  return estimate;
}

/// As sent by an MBot; after decoding it is encoded as imu_t.
inline Sample sample_mbot_imu() {
  constexpr std::uint64_t fingerprint = 0x5d3f1ec742142382U;
  Sample made = sample("imu_t", ImuSample{kSampleStamp, {}, {0, 0, 0}, {0, 0, 0}});
  made.type = "mbot_imu_t";
  made.bytes.clear();
  const auto add = [&made](std::uint64_t bits, int bytes) {
    for (int i = bytes - 1; i >= 0; --i) made.bytes.push_back(static_cast<std::uint8_t>(bits >> (8 * i)));
  };
  add(fingerprint, 8);
  add(static_cast<std::uint64_t>(kSampleStamp.utime()), 8);
  for (const float value :
       {90.0F, 0.0F, -45.0F, 0.25F, 0.5F, 9.75F, 1.0F, 2.0F, 3.0F, 0.02F, -0.01F, 1.5F, 30.0F})
    add(std::bit_cast<std::uint32_t>(value), 4);
  return made;
}

inline Joints sample_joints() { return {kSampleStamp, {"pan", "tilt"}, {0.5, -0.25}, {0.1, 0}, {1.5, -2}}; }

/// Fewer bytes than a fingerprint count as the usual type of the channel.
inline Sample sample_lidar() {
  Sample made = sample("lidar_t", sample_uneven_scan());
  made.written_as = "planar_lidar_t";
  return made;
}
inline Sample sample_motor_command() {
  Sample made =
      sample("mbot_motor_command_t", TwistCommand{kSampleStamp, {0.5, 0, 1}, CommandType::mbot_motor});
  made.written_as = "twist2D_t";
  return made;
}

inline std::vector<Sample> samples() {
  return {
      sample("planar_lidar_t", sample_scan()),
      sample_lidar(),
      sample("image_t", sample_depth()),
      sample("pose2D_t", Odometry{kSampleStamp, Transform<Odom, Base>::planar(1, 2, 3)}),
      sample("pose_cov_t", sample_estimate()),
      sample(
          "pose_t",
          PoseStamped{kSampleStamp, Transform<Map, Base>::planar(1, 2, 3), {1, 2, 3}, {4, 5, 6}, {7, 8, 9}}),
      sample("twist2D_t", TwistCommand{kSampleStamp, {0.5, -0.25, 1}}),
      sample_motor_command(),
      sample("imu_t",
             ImuSample{kSampleStamp, Eigen::Quaterniond(0.8, 0.6, 0, 0), {0.1, 0.2, 0.3}, {0, 0, 9.81}}),
      sample_mbot_imu(),
      sample("joints_t", sample_joints()),
      sample("agent_spawn_t", sample_spawn()),
      sample("agent_move_t", AgentMove{kSampleStamp, 2, "guide-1", Transform<Map, Base>::planar(1, 2, 3, 4)}),
      sample("agent_behaviour_t", AgentBehaviour{kSampleStamp, 3, "guide-1", sample_behaviour()}),
      sample("agent_remove_t", AgentRemove{kSampleStamp, 4, false, "guide-1"}),
      sample("agent_freeze_t", AgentFreeze{kSampleStamp, 5, true, "", true}),
      sample("door_cmd_t", DoorCommand{kSampleStamp, 6, "door 3", -1.25}),
      sample("fault_cmd_t", sample_fault()),
      sample("camera_rate_t", CameraRate{kSampleStamp, 8, "rover_2", 5}),
      sample("object_report_t", ObjectReport{kSampleStamp, 9, "gauge 1", Eigen::Vector2d(4.25, 1.5)}),
      sample("script_start_t", ScriptStart{kSampleStamp, 10, "door slams"}),
      sample("training_start_t", TrainingStart{kSampleStamp, 12}),
      sample("emergency_stop_t", EmergencyStopCommand{kSampleStamp, 11, "rover", true}),
      sample("operator_t",
             OperatorStatus{kSampleStamp, "trainee-1", "rover", OperatorStatus::State::lost, "js0"}),
      sample("event_t", sample_event()),
      sample("session_t", SessionHeader{kSampleStamp,
                                        "name: s\n",
                                        "",
                                        "robot",
                                        7,
                                        "0.1.0",
                                        {"SCAN", "ODOMETRY"},
                                        {{"rover", "<robot/>", "drive:\n"}, {"arm", "<robot></robot>", ""}}}),
      sample("scan_info_t", ScanInfo{kSampleStamp, true, "", 0.02, {"guide-1", "box"}, {-1, 0, 1, -1}}),
      sample("loop_t", LoopDecision{kSampleStamp, LoopDecision::Kind::steps_skipped, 3}),
      sample("status_t",
             ServerStatus{kSampleStamp, {{"scan_p50_us", 123.5}, {"load", 0.5}}, {{"camera", "stand-in"}}}),
      sample("model_t", ModelVersion{kSampleStamp, 2, "map_id: map\n"}),
      sample("hazard_reading_t",
             HazardReading{kSampleStamp,
                           {{HazardKind::radiation, 12.5, "uSv/h"}, {HazardKind::gas, 400, "ppm"}}}),
      sample("robot_t", RobotMessage{kSampleStamp, "name: robot\n"}),
      sample("world_t", sample_world()),
  };
}

}  // namespace parhelion::test
