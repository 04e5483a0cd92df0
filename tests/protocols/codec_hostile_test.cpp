// Invalid bytes: each message is rejected with a reason or decoded; none causes a crash or an allocation of
// the size that it claims.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "protocols/channel_map.hpp"
#include "protocols/codec_wire.hpp"
#include "protocols/yaml/utf8.hpp"
#include "tests/allocations.hpp"
#include "tests/protocols/codec_samples.hpp"

namespace parhelion {
namespace {

using test::Sample;

class EveryMessageType : public ::testing::TestWithParam<Sample> {};

INSTANTIATE_TEST_SUITE_P(Codec, EveryMessageType, ::testing::ValuesIn(test::samples()),
                         [](const auto& instance) { return instance.param.type; });

TEST_P(EveryMessageType, DecodesToTheEncodedMessage) {
  const Status status = GetParam().decode(GetParam().bytes);
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_EQ(type_name(GetParam().bytes), GetParam().type);
  EXPECT_EQ(describe("CHANNEL", GetParam().bytes).find(GetParam().type + " 1136391912.123456 "), 0U)
      << describe("CHANNEL", GetParam().bytes);
}

TEST_P(EveryMessageType, IsRefusedWhenTruncatedOrWithSurplusBytes) {
  auto bytes = GetParam().bytes;
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    const Status status = GetParam().decode(Bytes(bytes).first(n));
    ASSERT_FALSE(status) << n << " of " << bytes.size() << " bytes";
    const std::string& type = n < 8 ? GetParam().written_as : GetParam().type;
    EXPECT_EQ(status.error().message.find("channel CHANNEL: " + type + ": "), 0U) << status.error().message;
  }
  bytes.push_back(0);
  EXPECT_FALSE(GetParam().decode(bytes));
}

TEST_P(EveryMessageType, AStampOutside1970To2200IsRefused) {
  for (const std::int64_t utime :
       {std::int64_t{-1}, std::int64_t{7'258'118'400'000'000}, INT64_MIN, INT64_MAX}) {
    auto bytes = GetParam().bytes;
    wire::big_endian(utime, bytes.data() + 8);
    const Status status = GetParam().decode(bytes);
    ASSERT_FALSE(status) << utime;
    EXPECT_NE(status.error().message.find("utime: " + std::to_string(utime)), std::string::npos);
  }
}

TEST_P(EveryMessageType, BitFlipsAreRefusedOrGiveAnEncodableMessage) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 3000; ++trial) {
    auto bytes = GetParam().bytes;
    for (unsigned flips = 1 + random() % 3; flips > 0; --flips) {
      const std::size_t bit = 64 + random() % (bytes.size() * 8 - 64);
      bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    }
    if (!GetParam().decode(bytes)) continue;
    const auto again = GetParam().encode_again();
    if (GetParam().written_as == GetParam().type) {
      EXPECT_EQ(again.size(), bytes.size());
    }
    const Status status = GetParam().decode(again);
    EXPECT_TRUE(status) << status.error().message;
  }
}

TEST_P(EveryMessageType, AFalseCountAllocatesNoMoreThanTheMessage) {
  for (std::size_t at = 8; at + 4 <= GetParam().bytes.size(); ++at) {
    for (const std::int32_t count : {INT32_MAX, INT32_MIN, -1, 0x00FF'FFFF, 90'000}) {
      auto bytes = GetParam().bytes;
      wire::big_endian(count, bytes.data() + at);
      const test::AllocationWatch watch;
      (void)GetParam().decode(bytes);
      EXPECT_LT(watch.largest(), 64U * 1024) << "count " << count << " at byte " << at;
    }
  }
}

TEST_P(EveryMessageType, NonFiniteNumbersAreRefusedOrKept) {
  for (std::size_t at = 8; at + 8 <= GetParam().bytes.size(); ++at) {
    for (const double value :
         {std::nan(""), static_cast<double>(INFINITY), -static_cast<double>(INFINITY), 1e300}) {
      auto bytes = GetParam().bytes;
      wire::big_endian(value, bytes.data() + at);
      (void)GetParam().decode(bytes);
      bytes = GetParam().bytes;
      wire::big_endian(static_cast<float>(value), bytes.data() + at);
      (void)GetParam().decode(bytes);
    }
  }
}

template <class T>
std::string refusal(const T& message) {
  std::vector<std::uint8_t> bytes;
  encode(message, bytes);
  T decoded;
  const Status status = decode("C", bytes, decoded);
  return status ? "taken" : status.error().message;
}

/// Whoever refuses a name repeats it in an event, and events are kept.
TEST(MalformedMessages, NamesOfAMegabyteAreRefusedWithoutBeingRepeated) {
  const std::string longest(200, 'n'), too_long(1'000'000, 'n');
  const auto expect_bounded = [&](auto message, auto text_of) {
    text_of(message) = longest;
    EXPECT_EQ(refusal(message), "taken");
    text_of(message) = too_long;
    EXPECT_NE(refusal(message).find("too long, expected at most 200 bytes"), std::string::npos);
    EXPECT_LT(refusal(message).size(), 200U);
  };
  expect_bounded(
      test::sample_spawn(), [](auto& spawn) -> auto& { return spawn.agent.behaviour.target; });
  expect_bounded(
      test::sample_spawn(), [](auto& spawn) -> auto& { return spawn.agent.laser; });
  expect_bounded(
      test::sample_spawn(), [](auto& spawn) -> auto& { return spawn.agent.model; });
  expect_bounded(
      ScriptStart{.script = ""}, [](auto& start) -> auto& { return start.script; });
  expect_bounded(
      OperatorStatus{test::kSampleStamp, "anna", "rover", {}, ""},
      [](auto& status) -> auto& { return status.text; });
  expect_bounded(
      test::sample_estimate(), [](auto& estimate) -> auto& { return estimate.map_id; });
}

/// A robot must not stay claimed because of a text.
TEST(MalformedMessages, AReleaseIsReadWhateverItsText) {
  const std::string accents = [] {
    std::string text;
    for (int i = 0; i < 500; ++i) text += "\u00e9";
    return text;
  }();
  for (const auto state : {OperatorStatus::State::ended, OperatorStatus::State::lost}) {
    for (const std::string& text : {"n" + accents, accents, std::string(1'000'000, 'n')}) {
      std::vector<std::uint8_t> bytes;
      encode(OperatorStatus{test::kSampleStamp, "anna", "rover", state, text}, bytes);
      OperatorStatus read;
      ASSERT_TRUE(decode("C", bytes, read).ok());
      EXPECT_EQ(read.state, state);
      EXPECT_GE(read.text.size(), wire::kMaxName - 1);
      EXPECT_LE(read.text.size(), wire::kMaxName);
      EXPECT_TRUE(text.starts_with(read.text));
      EXPECT_EQ(yaml::find_invalid_utf8(read.text), std::nullopt);
    }
  }
}

TEST(MalformedMessages, ImpossibleScans) {
  Scan scan = test::sample_scan();
  scan.angle_increment = 0;
  EXPECT_EQ(refusal(scan),
            "channel C: planar_lidar_t: radstep: 0, expected the angle between two beams, not 0");
  scan.angle_increment = NAN;
  EXPECT_NE(refusal(scan).find("radstep: nan"), std::string::npos);
  scan.angle_increment = -0.5F;
  EXPECT_EQ(refusal(scan), "taken");
  scan.angle_min = -INFINITY;
  EXPECT_NE(refusal(scan).find("rad0: -inf"), std::string::npos);
  scan = test::sample_scan();
  scan.intensities.pop_back();
  EXPECT_NE(refusal(scan).find("nintensities: 6, expected 7..7"), std::string::npos);
  scan.intensities.clear();
  EXPECT_EQ(refusal(scan), "taken");
  scan.ranges.clear();
  EXPECT_NE(refusal(scan).find("nranges: 0"), std::string::npos);
  scan.ranges.assign(100'001, 1);
  scan.angle_increment = 1e-5F;
  EXPECT_NE(refusal(scan).find("nranges: 100001, expected 0..100000"), std::string::npos);
}

TEST(MalformedMessages, ImpossibleScansWithAnglesOfTheirOwn) {
  Scan scan = test::sample_uneven_scan();
  EXPECT_EQ(refusal(scan), "taken");
  scan.times.back() += 2'000'000;
  EXPECT_NE(refusal(scan).find("times: 2.0024, expected at most 1 s from utime"), std::string::npos)
      << refusal(scan);
  scan.times.assign(scan.times.size(), 0);  // a driver that does not measure them
  EXPECT_EQ(refusal(scan), "taken");
  scan.angles[2] = NAN;
  EXPECT_NE(refusal(scan).find("thetas: nan"), std::string::npos) << refusal(scan);
  scan = test::sample_uneven_scan();
  scan.intensities.pop_back();  // arrays of different lengths
  EXPECT_NE(refusal(scan).find("lidar_t"), std::string::npos) << refusal(scan);
  scan.times.pop_back();
  EXPECT_NE(refusal(scan).find("lidar_t"), std::string::npos) << refusal(scan);
}

TEST(MalformedMessages, ImagesWithAWrongSize) {
  Image image = test::sample_depth();
  image.bytes.pop_back();
  EXPECT_NE(refusal(image).find("size: 17, expected 18..18"), std::string::npos) << refusal(image);
  image = test::sample_depth();
  image.row_stride = 3;
  EXPECT_NE(refusal(image).find("row_stride: 3"), std::string::npos);
  image = test::sample_depth();
  image.metadata.clear();
  EXPECT_NE(refusal(image).find("\"encoding\""), std::string::npos);
  image = test::sample_depth();
  image.format = static_cast<PixelFormat>(12);
  EXPECT_NE(refusal(image).find("pixelformat: 12"), std::string::npos);
  image = test::sample_depth();
  image.width = 0;
  EXPECT_NE(refusal(image).find("width: 0"), std::string::npos);
}

TEST(MalformedMessages, InvalidPoses) {
  const Eigen::Isometry3d nowhere = [] {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation().x() = NAN;
    return T;
  }();
  PoseEstimate estimate = test::sample_estimate();
  estimate.T_map_base = Transform<Map, Base>(nowhere);
  EXPECT_NE(refusal(estimate).find("pos: nan"), std::string::npos);
  estimate = test::sample_estimate();
  estimate.covariance(1, 2) = 1;
  EXPECT_NE(refusal(estimate).find("symmetric"), std::string::npos);
  estimate = test::sample_estimate();
  estimate.covariance(3, 3) = -1;
  EXPECT_NE(refusal(estimate).find("covariance: -1"), std::string::npos);
  EXPECT_NE(refusal(Odometry{test::kSampleStamp, Transform<Odom, Base>(nowhere)}).find("x: nan"),
            std::string::npos);
  EXPECT_NE(refusal(TwistCommand{test::kSampleStamp, {0, INFINITY, 0}}).find("vy: inf"), std::string::npos);

  PoseStamped pose;
  pose.stamp = test::kSampleStamp;
  auto bytes = test::sample("pose_t", pose).bytes;
  wire::big_endian(0.0, bytes.data() + 8 + 8 + 48);  // w: the quaternion is all zeros now, not an identity
  const Status status = decode("POSE", bytes, pose);
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message.find("orientation: 0, expected a quaternion"), std::string::npos);
}

TEST(MalformedMessages, InvalidOrientations) {
  ImuSample sample{test::kSampleStamp, Eigen::Quaterniond(0, 0, 0, 0), {0, 0, 0}, {0, 0, 0}};
  EXPECT_NE(refusal(sample).find("orientation: 0, expected a quaternion"), std::string::npos);
  sample.orientation = Eigen::Quaterniond(NAN, 0, 0, 0);
  EXPECT_NE(refusal(sample).find("orientation: nan"), std::string::npos);
  sample.orientation.reset();
  EXPECT_EQ(refusal(sample), "taken");
  sample.rotation_rate.y() = INFINITY;
  EXPECT_NE(refusal(sample).find("rotation_rate: inf"), std::string::npos);
  sample.rotation_rate.y() = 0;
  sample.acceleration.z() = NAN;
  EXPECT_NE(refusal(sample).find("accel: nan"), std::string::npos);

  auto bytes = test::sample("imu_t", ImuSample{test::kSampleStamp, {}, {0, 0, 0}, {0, 0, 0}}).bytes;
  wire::big_endian(std::int32_t{3}, bytes.data() + 16);
  ImuSample decoded;
  const Status status = decode("IMU", bytes, decoded);
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().message.find("norientation: 3, expected 4..4"), std::string::npos)
      << status.error().message;
}

TEST(MalformedMessages, RefusesInvalidJoints) {
  Joints joints = test::sample_joints();
  joints.names[1] = "pan";
  EXPECT_NE(refusal(joints).find("names: a duplicate joint name"), std::string::npos);
  joints.names[1] = "";
  EXPECT_NE(refusal(joints).find("names: a name that is empty"), std::string::npos);
  joints.names[1] = std::string(65, 'j');
  EXPECT_NE(refusal(joints).find("too long"), std::string::npos);
  joints = test::sample_joints();
  joints.velocities.pop_back();
  EXPECT_NE(refusal(joints).find("nvelocities: 1, expected 2..2"), std::string::npos) << refusal(joints);
  joints.velocities.clear();
  EXPECT_EQ(refusal(joints), "taken");
  joints.positions[0] = NAN;
  EXPECT_NE(refusal(joints).find("positions: nan"), std::string::npos);
  joints.positions[0] = 1e300;
  EXPECT_NE(refusal(joints).find("positions: 1e+300"), std::string::npos);
  EXPECT_NE(refusal(Joints{test::kSampleStamp, {}, {}, {}, {}}).find("njoints: 0, expected 1..256"),
            std::string::npos);
  joints = {test::kSampleStamp, {}, {}, {}, {}};
  for (int i = 0; i < 257; ++i) joints.names.push_back("j" + std::to_string(i));
  EXPECT_NE(refusal(joints).find("njoints: 257, expected 0..256"), std::string::npos);
}

TEST(Imu, MBotSamplesAreMappedToTheSameUnits) {
  const test::Sample mbot = test::sample_mbot_imu();
  ImuSample sample;
  ASSERT_TRUE(decode("IMU", mbot.bytes, sample).ok());
  EXPECT_NEAR(sample.rotation_rate.x(), std::numbers::pi / 2, 1e-6);
  EXPECT_NEAR(sample.rotation_rate.z(), -std::numbers::pi / 4, 1e-6);
  EXPECT_NEAR(sample.acceleration.z(), 9.75, 1e-6);
  ASSERT_TRUE(sample.orientation);
  const Eigen::Matrix3d R = sample.orientation->toRotationMatrix();
  EXPECT_NEAR(std::atan2(R(2, 1), R(2, 2)), 0.02, 1e-6);
  EXPECT_NEAR(std::asin(-R(2, 0)), -0.01, 1e-6);
  EXPECT_NEAR(std::atan2(R(1, 0), R(0, 0)), 1.5, 1e-6);
}

TEST(MalformedMessages, CommandsWithoutAnAgent) {
  AgentSpawn spawn = test::sample_spawn();
  AgentMove move{.agent = "guide-1"};
  AgentRemove remove;
  AgentFreeze freeze;
  EmergencyStopCommand stop;
  EXPECT_EQ(refusal(move), "taken");
  for (const char* name : {"", "a b", "a/b", "a.b", "\xc3\xa4", "01234567890123456789012345678901x"}) {
    spawn.agent.name = move.agent = remove.agent = freeze.agent = stop.robot = name;
    EXPECT_NE(refusal(spawn).find("name: "), std::string::npos) << name;
    EXPECT_NE(refusal(move).find("name: "), std::string::npos) << name;
    EXPECT_NE(refusal(remove).find("name: "), std::string::npos) << name;
    EXPECT_NE(refusal(freeze).find("name: "), std::string::npos) << name;
    EXPECT_EQ(refusal(stop) == "taken", stop.robot.empty()) << "every robot stops where none is named";
  }
  spawn.agent.name = stop.robot = std::string(kMaxRobotName, 'x');
  EXPECT_EQ(refusal(spawn), "taken") << "as long as in a scenario";
  EXPECT_EQ(refusal(stop), "taken");
  spawn = test::sample_spawn();
  spawn.agent.size.z() = 0;
  EXPECT_NE(refusal(spawn).find("size: 0"), std::string::npos);
}

TEST(MalformedMessages, AnAgentNameInACommandForAllAgents) {
  EXPECT_EQ(refusal(AgentRemove{.all = true}), "taken");
  EXPECT_NE(refusal(AgentRemove{.all = true, .agent = "guide"}).find("name: "), std::string::npos);
  EXPECT_EQ(refusal(AgentFreeze{.all = true}), "taken");
  EXPECT_NE(refusal(AgentFreeze{.all = true, .agent = "guide"}).find("name: "), std::string::npos);
}

TEST(MalformedMessages, CommandValuesOutOfRange) {
  EXPECT_NE(refusal(CameraRate{.agent = "a", .rate = -1}).find("rate: -1"), std::string::npos);
  EXPECT_NE(refusal(FaultCommand{.duration = -3}).find("duration: -3"), std::string::npos);
  EXPECT_NE(refusal(FaultCommand{.amount = NAN}).find("amount: "), std::string::npos);
  EXPECT_NE(refusal(DoorCommand{.door = "d", .opening = NAN}).find("opening: "), std::string::npos);
  EXPECT_NE(refusal(DoorCommand{}).find("name: "), std::string::npos);
  EXPECT_NE(refusal(ScriptStart{}).find("script: "), std::string::npos);
  EXPECT_NE(refusal(ObjectReport{.object = std::string(201, 'x')}).find("name: "), std::string::npos);
}

TEST(MalformedMessages, ABeamOfAnUnlistedAgent) {
  EXPECT_NE(
      refusal(ScanInfo{test::kSampleStamp, true, "", 0, {"a"}, {0, 1}}).find("beam_agent: 1, expected -1..0"),
      std::string::npos);
  EXPECT_NE(refusal(ScanInfo{test::kSampleStamp, true, "", NAN, {}, {}}).find("predicted_error"),
            std::string::npos);
  EXPECT_EQ(refusal(ScanInfo{test::kSampleStamp, false, "no pose", INFINITY, {}, {}}), "taken");
  ScanInfo info{test::kSampleStamp, true, "", 0, {}, {}};
  info.explained = 1.5;
  EXPECT_NE(refusal(info).find("explained"), std::string::npos);
  info.explained = 1;
  info.residual = -1;
  EXPECT_NE(refusal(info).find("residual"), std::string::npos);
  info.residual = 0;
  info.pose_covariance(2, 0) = NAN;
  EXPECT_NE(refusal(info).find("pose_covariance"), std::string::npos);
}

TEST(Describe, ControlCharactersAreWrittenInHex) {
  std::vector<std::uint8_t> bytes;
  encode(RobotMessage{test::kSampleStamp, "\x1b[2J\a"}, bytes);
  EXPECT_NE(describe("ROBOT", bytes).find("\"\\x1b[2J\\x07\""), std::string::npos)
      << describe("ROBOT", bytes);
  EXPECT_EQ(describe("X", {}), "0 bytes: too short for a fingerprint");
  EXPECT_EQ(describe("X", std::vector<std::uint8_t>(9, 0x11)),
            "unknown type, fingerprint 0x1111111111111111, 9 bytes");
}

TEST(Describe, AScanInfoCountsBeamsAndAgents) {
  std::vector<std::uint8_t> bytes;
  ScanInfo info{test::kSampleStamp, true, "", 0, {"barrel_1"}, {-1, 0, 0}};
  encode(info, bytes);
  EXPECT_NE(describe("MR_SCAN_INFO", bytes).find("live, 2 of 3 beams hit 1 agent,"), std::string::npos)
      << describe("MR_SCAN_INFO", bytes);
  info.agents.clear();
  info.beam_agent = {-1, -1, -1};
  encode(info, bytes);
  EXPECT_NE(describe("MR_SCAN_INFO", bytes).find("live, 0 of 3 beams hit 0 agents,"), std::string::npos)
      << describe("MR_SCAN_INFO", bytes);
}

TEST(Describe, EachDecisionOfTheLoopHasAName) {
  for (int kind = 0; kind <= static_cast<int>(LoopDecision::Kind::late_command); ++kind) {
    std::vector<std::uint8_t> bytes;
    encode(LoopDecision{test::kSampleStamp, static_cast<LoopDecision::Kind>(kind), 3}, bytes);
    EXPECT_NE(describe("LOOP", bytes).find(" 3"), std::string::npos) << describe("LOOP", bytes);
  }
}

TEST(Allocation, AScanAndAnImageAllocateNothingAfterTheFirst) {
  Scan scan = test::sample_scan(), decoded;
  Image image = test::sample_depth(), seen;
  std::vector<std::uint8_t> scan_bytes, image_bytes;
  const auto round = [&] {
    encode(scan, scan_bytes);
    encode(image, image_bytes);
    return decode("SCAN", scan_bytes, decoded).ok() && decode("DEPTH", image_bytes, seen).ok();
  };
  ASSERT_TRUE(round());
  const test::AllocationWatch watch;
  bool ok = true;
  for (int i = 0; i < 100; ++i) ok = ok && round();
  EXPECT_EQ(watch.count(), 0U);
  EXPECT_TRUE(ok);
}

}  // namespace
}  // namespace parhelion
