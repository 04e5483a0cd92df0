// Effects of IMU, POSE, JOINT_STATE and JOINT_CMD: the robot's tilt, its position, its camera head, its
// joints.
#include <gtest/gtest.h>

#include <fstream>

#include "server/runtime/replay.hpp"
#include "tests/server/tick/tick_fixture.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::runtime {
namespace {

using test::agent;
using test::message;
using test::TickTest;

constexpr std::int64_t kMs = 1000;

tick::Configuration with_robot(const RobotDescription& robot, Scenario scenario = {}) {
  scenario.name = "synthetic";
  if (scenario.agents.empty()) scenario.agents = {agent("box_1", AgentKind::box, 3, 2)};
  return *tick::configure(scenario, robot, test::room());
}

RobotDescription robot_with_imu() {
  RobotDescription robot = test::robot();
  robot.imu = ImuDescription{};
  return robot;
}

/// IMU at 50 Hz from one instant to another, the robot pitched by `pitch` on its circle.
std::vector<Message> imu_messages(double from, double to, double pitch) {
  std::vector<Message> log;
  for (double t = from; t < to; t += 0.02) {
    ImuSample sample;
    sample.stamp = SensorTime::from_utime(test::kStartUs + static_cast<std::int64_t>(t * 1e6));
    sample.orientation = Eigen::AngleAxisd(test::pose_at(t).yaw() + 0.3, Eigen::Vector3d::UnitZ()) *
                         Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY());
    log.push_back(message(channel::kImu, sample.stamp.utime() + 1 * kMs, sample));
  }
  return log;
}

std::size_t beams_on_agents(const std::vector<ScanInfo>& infos, std::size_t from, std::size_t to) {
  std::size_t count = 0;
  for (std::size_t i = from; i < std::min(to, infos.size()); ++i)
    count += static_cast<std::size_t>(std::count_if(infos[i].beam_agent.begin(), infos[i].beam_agent.end(),
                                                    [](std::int16_t beam) { return beam >= 0; }));
  return count;
}

std::vector<WorldMessage::Entry>::const_iterator real_robot(const WorldMessage& world) {
  return std::find_if(world.bodies.begin(), world.bodies.end(),
                      [](const auto& body) { return body.owner == BodyOwner::real_robot; });
}

TEST_F(TickTest, OnARampBeamsPassOverLowObjects) {
  start(with_robot(robot_with_imu()));
  // Nose up for a second; then the sensor is silent, and the attitude unknown.
  feed(test::drive(2.5, imu_messages(0, 1, -0.3)));
  const auto infos = decoded<ScanInfo>(channel::kMrScanInfo);
  ASSERT_EQ(infos.size(), 25U);
  EXPECT_EQ(beams_on_agents(infos, 2, 10), 0U);
  EXPECT_GT(beams_on_agents(infos, 15, 25), 20U);
  bool known = false, forgotten = false;
  for (const WorldMessage& world : decoded<WorldMessage>(channel::kMrWorld)) {
    const double t = static_cast<double>(world.stamp.utime() - test::kStartUs) * 1e-6;
    if (t > 0.1 && t < 1) {
      const auto robot = real_robot(world);
      ASSERT_NE(robot, world.bodies.end());
      EXPECT_TRUE(robot->attitude_known) << t;
      EXPECT_NEAR(std::asin(-robot->T_map_body.rotation()(2, 0)), -0.3, 1e-6);
      known = true;
    }
    if (t < 1.3) continue;
    const auto robot = real_robot(world);
    ASSERT_NE(robot, world.bodies.end());
    EXPECT_FALSE(robot->attitude_known) << t;
    forgotten = true;
  }
  EXPECT_TRUE(known && forgotten);
}

TEST_F(TickTest, ALevelImuGivesTheSameAsNoImu) {
  start(with_robot(robot_with_imu()));
  feed(test::drive(1, imu_messages(0, 1, 0)));
  const auto with = decoded<ScanInfo>(channel::kMrScanInfo);
  out_.clear();
  start(with_robot(test::robot()));
  feed(test::drive(1));
  const auto without = decoded<ScanInfo>(channel::kMrScanInfo);
  EXPECT_GT(beams_on_agents(with, 0, 10), 20U);
  EXPECT_EQ(beams_on_agents(with, 0, 10), beams_on_agents(without, 0, 10));
}

TEST_F(TickTest, WithoutADescribedMountingAttitudeIsUnknown) {
  start(with_robot(test::robot()));
  feed(test::drive(1, imu_messages(0, 1, -0.3)));
  EXPECT_GT(beams_on_agents(decoded<ScanInfo>(channel::kMrScanInfo), 2, 10), 20U);
  std::size_t drawn_level = 0;
  for (const WorldMessage& world : decoded<WorldMessage>(channel::kMrWorld)) {
    const auto robot = real_robot(world);
    if (robot == world.bodies.end()) continue;
    EXPECT_FALSE(robot->attitude_known);
    ++drawn_level;
  }
  EXPECT_GT(drawn_level, 10U);
}

/// POSE instead of POSE_COV.
std::vector<Message> with_plain_poses(std::vector<Message> log) {
  for (Message& each : log) {
    if (each.channel != channel::kPoseCov) continue;
    PoseEstimate estimate;
    EXPECT_TRUE(decode(each.channel, each.payload, estimate).ok());
    PoseStamped pose;
    pose.stamp = estimate.stamp;
    pose.T_map_base = estimate.T_map_base;
    each.channel = channel::kPose;
    encode(pose, each.payload);
  }
  return log;
}

Scenario plain_pose_scenario(const std::string& map_id) {
  Scenario scenario;
  scenario.pose = PoseInput{0.01, 0.001, map_id};
  return scenario;
}

TEST_F(TickTest, AConfiguredCovarianceEqualsAPublishedOne) {
  start(with_robot(test::robot()));
  feed(test::drive(3));
  const auto reference = out_[channel::kMrScan];
  out_.clear();
  start(with_robot(test::robot(), plain_pose_scenario("")));
  feed(with_plain_poses(test::drive(3)));
  EXPECT_EQ(out_[channel::kMrScan], reference);
  EXPECT_GT(state_->tally.beams_replaced, 0U);
}

TEST_F(TickTest, PosesWithoutCovarianceOrOfAnotherMapAreIgnored) {
  start(with_robot(test::robot()));
  feed(with_plain_poses(test::drive(1)));
  for (const ScanInfo& info : decoded<ScanInfo>(channel::kMrScanInfo)) EXPECT_FALSE(info.live);
  out_.clear();
  start(with_robot(test::robot(), plain_pose_scenario("elsewhere")));
  feed(with_plain_poses(test::drive(1)));
  const auto infos = decoded<ScanInfo>(channel::kMrScanInfo);
  EXPECT_FALSE(infos.back().live);
  EXPECT_NE(infos.back().reason.find("map"), std::string::npos) << infos.back().reason;
}

TEST_F(TickTest, APoseJumpIsARelocalization) {
  start(with_robot(test::robot(), plain_pose_scenario("")));
  auto log = with_plain_poses(test::drive(2));
  for (Message& each : log) {
    if (each.channel != channel::kPose || each.arrival.utime() < test::kStartUs + 1000 * kMs) continue;
    PoseStamped pose;
    ASSERT_TRUE(decode(each.channel, each.payload, pose).ok());
    pose.T_map_base = {pose.T_map_base.quaternion(),
                       pose.T_map_base.translation() + Eigen::Vector3d(0.5, 0, 0)};
    encode(pose, each.payload);
  }
  feed(log);
  EXPECT_EQ(state_->tally.events[static_cast<std::size_t>(EventKind::relocalized)], 1U);
}

RobotDescription robot_with_head() {
  RobotDescription robot = test::robot_with_camera();
  robot.camera->head = {{"pan", {0, 0, 0}, Eigen::Vector3d::UnitZ()}};
  return robot;
}

TEST_F(TickTest, ACameraOnAHeadFollowsTheEncoders) {
  start(with_robot(robot_with_head()));
  const std::int64_t seen = test::kStartUs + 950 * kMs;
  const Joints joints{SensorTime::from_utime(seen - 10 * kMs), {"pan"}, {0.7}, {}, {}};
  feed(test::drive(0.95, {message(channel::kJointState, seen - 5 * kMs, joints)}));
  feed(test::image_at(seen));
  ASSERT_EQ(outputs_.frames().size(), 1U);
  const tick::Outputs::Frame& frame = outputs_.frames().front();
  EXPECT_EQ(frame.reason, "");
  // For the camera, a turn of the head about the base's own axis is a turn of the robot.
  const auto robot = *state_->robots.front().pose.track.at(SensorTime::from_utime(seen));
  const auto expected = robot.T_map_base * Transform<Base, Base>::planar(0, 0, 0.7) *
                        configuration_.robot.camera->T_base_optical;
  EXPECT_TRUE(frame.job.T_map_optical.isometry().isApprox(expected.isometry(), 1e-9));
}

TEST_F(TickTest, StaleEncodersSuspendInjectionIntoTheirCamera) {
  start(with_robot(robot_with_head()));
  const std::int64_t seen = test::kStartUs + 950 * kMs;
  const Joints joints{SensorTime::from_utime(seen - 300 * kMs), {"pan"}, {0.7}, {}, {}};
  feed(test::drive(0.95, {message(channel::kJointState, seen - 290 * kMs, joints)}));
  feed(test::image_at(seen));
  ASSERT_EQ(outputs_.frames().size(), 1U);
  EXPECT_NE(outputs_.frames().front().reason.find("camera head: the encoder of joint 'pan'"),
            std::string::npos)
      << outputs_.frames().front().reason;
  EXPECT_TRUE(decoded<ScanInfo>(channel::kMrScanInfo).back().live) << "the laser does not sit on the head";
}

TEST_F(TickTest, ARollingShutterDrawsEachRowAtItsTime) {
  const std::int64_t seen = test::kStartUs + 950 * kMs;
  std::map<double, Transform<Map, Body>> shown;
  for (const double readout : {0.0, 0.1}) {
    RobotDescription robot = robot_with_head();
    robot.camera->head.clear();
    robot.camera->readout = readout;
    robot.camera->T_base_optical = {Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5), {0.2, 0, 3}};  // the box is low
    start(with_robot(robot));
    feed(test::drive(1.1));
    feed(test::image_at(seen));
    ASSERT_EQ(outputs_.frames().size(), 1U);
    ASSERT_EQ(outputs_.frames().front().reason, "");
    const render::RenderJob& job = outputs_.frames().front().job;
    for_each_body(job.world, [&](const BodyDefinition& definition, const BodyState& body) {
      if (definition.entity == "box_1") shown[readout] = body.T_map_body;
    });
    if (readout == 0) continue;
    // Seen from the camera's pose at its row, the box is at its true position.
    const CameraIntrinsics& lens = robot.camera->intrinsics;
    const Eigen::Vector3d centre(0, 0, 0.3);
    const Eigen::Vector3d p = job.T_map_optical.inverse() * (shown[0.0] * centre);
    const double row = lens.fy * p.y() / p.z() + lens.cy;
    ASSERT_GT(row, 0.6 * lens.height);
    const double after = (std::min(row / (lens.height - 1), 1.0) - 0.5) * readout;
    const auto then = *state_->robots.front().pose.track.at(SensorTime::from_utime(seen) + seconds(after));
    const auto T_map_optical = then.T_map_base * robot.camera->T_base_optical;
    const Eigen::Vector3d expected = T_map_optical.inverse() * (shown[0.0] * centre);
    const Eigen::Vector3d found = job.T_map_optical.inverse() * (shown[readout] * centre);
    EXPECT_LT((found - expected).norm(), 0.002);
    EXPECT_GT((expected - p).norm(), 0.005) << "the robot moves: else this shows nothing";
  }
}

TEST_F(TickTest, JointCommandsAreForwardedAndStopOnTimeout) {
  start(with_robot(test::robot()));
  const auto at = [](int t) { return test::kStartUs + t * kMs; };
  const Joints command{SensorTime::from_utime(at(100)), {"arm", "grip"}, {1.5, 0.2}, {}, {3, 4}};
  const Joints measured{SensorTime::from_utime(at(300)), {"grip", "arm"}, {0.1, 1.25}, {}, {}};
  feed(message(channel::kJointState, at(50), measured));
  feed(message(channel::kJointCmd, at(100), command));
  auto joint_commands = decoded<Joints>(channel::kMrJointCmd);
  ASSERT_EQ(joint_commands.size(), 1U);
  EXPECT_EQ(out_[channel::kMrJointCmd].front(), message("", 0, command).payload);
  // The encoders continue, the commands stop.
  for (int t = 300; t <= 900; t += 100) {
    Joints now = measured;
    now.stamp = SensorTime::from_utime(at(t));
    feed(message(channel::kJointState, at(t), now));
  }
  joint_commands = decoded<Joints>(channel::kMrJointCmd);
  ASSERT_GE(joint_commands.size(), 3U) << "a stop is repeated";
  ASSERT_LE(joint_commands.size(), 5U);
  for (std::size_t i = 1; i < joint_commands.size(); ++i) {
    EXPECT_GE(joint_commands[i].stamp.utime(), at(600));
    EXPECT_EQ(joint_commands[i].names, command.names);
    EXPECT_EQ(joint_commands[i].positions, (std::vector<double>{1.25, 0.1}))
        << "held at the encoder positions";
    EXPECT_EQ(joint_commands[i].velocities, (std::vector<double>{0, 0}));
    EXPECT_EQ(joint_commands[i].efforts, (std::vector<double>{0, 0}));
  }
  // An old command is refused, a new one passes immediately.
  feed(message(channel::kJointCmd, at(940), command));
  EXPECT_NE(out_[channel::kMrJointCmd].back(), message("", 0, command).payload);
  Joints newer = command;
  newer.stamp = SensorTime::from_utime(at(950));
  feed(message(channel::kJointCmd, at(950), newer));
  EXPECT_EQ(out_[channel::kMrJointCmd].back(), message("", 0, newer).payload);
}

TEST_F(TickTest, UnreadableJointCommandsStopWithoutInventingPositions) {
  start(with_robot(test::robot()));
  const Joints command{SensorTime::from_utime(test::kStartUs), {"arm"}, {1.5}, {0.5}, {}};
  Message broken = message(channel::kJointCmd, test::kStartUs + 20 * kMs, command);
  broken.payload.pop_back();
  feed(broken);
  EXPECT_TRUE(out_[channel::kMrJointCmd].empty()) << "nothing moves yet";
  feed(message(channel::kJointCmd, test::kStartUs + 40 * kMs, command));
  broken.arrival = ArrivalTime::from_utime(test::kStartUs + 60 * kMs);
  feed(broken);
  const auto joint_commands = decoded<Joints>(channel::kMrJointCmd);
  ASSERT_EQ(joint_commands.size(), 2U);
  EXPECT_TRUE(joint_commands[1].positions.empty());
  EXPECT_EQ(joint_commands[1].velocities, std::vector<double>{0});
  EXPECT_EQ(state_->tally.refused_inputs, 2U);
}

TEST(RobotInputs, AreLoggedAndReplayedToTheSameBytes) {
  const test::TemporaryFolder folder;
  Scenario scenario = plain_pose_scenario("synthetic");
  scenario.name = "synthetic";
  scenario.model = folder / "model.yaml";
  scenario.agents = {agent("robot_1", AgentKind::robot, 3, 0, BehaviourKind::wander)};
  std::ofstream(folder / "model.yaml") << to_yaml(test::room());
  std::ofstream(folder / "scenario.yaml") << to_yaml(scenario);
  RobotDescription robot = robot_with_head();
  robot.imu = ImuDescription{};
  std::ofstream(folder / "robot.yaml") << to_yaml(robot);
  auto extra = imu_messages(0, 2, -0.05);
  for (int t = 0; t < 2000; t += 50) {
    const std::int64_t us = test::kStartUs + t * kMs;
    extra.push_back(message(channel::kJointState, us + 2 * kMs,
                            Joints{SensorTime::from_utime(us), {"pan"}, {1e-3 * t}, {}, {}}));
    if (t < 1000)
      extra.push_back(message(channel::kJointCmd, us + 3 * kMs,
                              Joints{SensorTime::from_utime(us), {"pan"}, {1.0}, {}, {}}));
  }
  test::write_log(folder / "drive.lcm", with_plain_poses(test::drive(2, extra)));
  ReplayOptions options;
  options.log = folder / "drive.lcm";
  options.scenario = folder / "scenario.yaml";
  options.robot = folder / "robot.yaml";
  options.session = folder / "session.lcm";
  const auto first = replay(options);
  ASSERT_TRUE(first.ok()) << first.error().message;
  EXPECT_GT(first->tally.beams_replaced, 0U);
  EXPECT_TRUE(first->hash.contains(channel::kMrJointCmd));
  ReplayOptions again;
  again.log = folder / "session.lcm";
  again.session = folder / "again.lcm";
  again.threads = 1;
  const auto second = replay(again);
  ASSERT_TRUE(second.ok()) << second.error().message;
  EXPECT_EQ(first->hash, second->hash);
}

}  // namespace
}  // namespace parhelion::runtime
