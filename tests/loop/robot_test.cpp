// The example's robot by itself: what it does with what comes on the bus.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>

#include "protocols/bus/bus.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/process.hpp"

namespace parhelion::test {
namespace {

const std::string kFolder = std::string(PARHELION_SOURCE_DIR) + "/examples/robot/";
const std::string kProgram = std::string(PARHELION_BINARY_DIR) + "/examples/robot/example_robot";

class ExampleRobot : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string url = bus_url();
    setenv("LCM_DEFAULT_URL", url.c_str(), 1);
    auto bus = open_network_bus(url);
    ASSERT_TRUE(bus.ok()) << bus.error().message;
    bus_ = std::move(*bus);
    ASSERT_TRUE(bus_->subscribe("SCAN|ODOMETRY|JOINT_STATE|ROBOT|CAMERA|DEPTH", 200).ok());
    switch_on({});
  }
  void switch_on(const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"--building",           kFolder + "building.txt", "--description",
                                       kFolder + "robot.yaml", "--image-rate",           "2"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    robot_.emplace(arguments, folder_ / "robot.txt", kProgram);
  }
  template <class Type>
  void publish(const char* channel, const Type& value) {
    std::vector<std::uint8_t> bytes;
    encode(value, bytes);
    ASSERT_TRUE(bus_->publish(channel, bytes).ok());
  }
  /// Handles what comes until `done`, which is asked at each odometry, or for 30 s. Each scan is answered,
  /// and at each odometry `command_` is sent.
  bool until(const std::function<bool()>& done) {
    const WallTime deadline = runtime::steady_now() + seconds(30.0);
    Message message;
    while (runtime::steady_now() < deadline) {
      const auto received = bus_->receive(message, milliseconds(100));
      if (!received.ok() || !*received) continue;
      ++count_[message.channel];
      if (message.channel == channel::kScan) answer(message);
      if (message.channel == channel::kJointState) {
        EXPECT_TRUE(decode(message.channel, message.payload, joints_).ok());
      }
      if (message.channel != channel::kOdometry) continue;
      Odometry odometry;
      EXPECT_TRUE(decode(message.channel, message.payload, odometry).ok());
      const double x = odometry.T_odom_base.translation().x();
      still_ = std::abs(x - x_) < 1e-4 ? still_ + 1 : 0;
      x_ = x;
      if (command_) publish(channel::kMrCmd, TwistCommand{stamp(), {*command_, 0, 0}});
      if (done()) return true;
    }
    return false;
  }
  SensorTime stamp() { return repeated_ ? *repeated_ : SensorTime{runtime::wall_now().ns}; }
  /// MR_SCAN: as it is, and with a virtual wall across the robot's way.
  void answer(const Message& message) {
    if (!answers_) return;
    Scan scan;
    ASSERT_TRUE(decode(message.channel, message.payload, scan).ok());
    constexpr double kLaser = 0.1;  // m before base_link
    for (std::size_t i = 0; wall_ && i < scan.ranges.size(); ++i) {
      const double angle = scan.angle_min + static_cast<double>(i) * scan.angle_increment;
      if (std::abs(angle) < 1)
        scan.ranges[i] =
            std::min(scan.ranges[i], static_cast<float>((*wall_ - x_ - kLaser) / std::cos(angle)));
    }
    publish(channel::kMrScan, scan);
    if (localizes_) localize(scan.stamp);
  }
  /// The map's origin is where the robot was switched on.
  void localize(SensorTime stamp) {
    PoseEstimate estimate;
    estimate.stamp = stamp;
    estimate.T_map_base = Transform<Map, Base>::planar(x_, 0, 0);
    estimate.covariance = PoseCovariance::Identity() * 1e-4;
    estimate.state = SlamState::tracking;
    publish(channel::kPoseCov, estimate);
  }
  bool stands() const { return still_ >= 10; }

  TemporaryFolder folder_;
  std::unique_ptr<Bus> bus_;
  std::optional<Process> robot_;
  std::map<std::string, int> count_;
  double x_ = 0;   ///< m, by odometry
  int still_ = 0;  ///< readings of odometry without motion
  Joints joints_;
  bool answers_ = true, localizes_ = false;
  std::optional<double> command_;       ///< m/s
  std::optional<SensorTime> repeated_;  ///< of each command
  std::optional<double> wall_;          ///< m, x of a virtual wall in odom
};

TEST_F(ExampleRobot, PublishesAllItsSensors) {
  EXPECT_TRUE(until([&] {
    for (const char* each : {"SCAN", "ODOMETRY", "JOINT_STATE", "ROBOT", "CAMERA", "DEPTH"}) {
      if (count_[each] < 2) return false;
    }
    return true;
  })) << bytes_of(folder_ / "robot.txt");
}

TEST_F(ExampleRobot, DrivesByMrCmdAndStopsWhenThatIsSilent) {
  command_ = 0.3;
  ASSERT_TRUE(until([&] { return x_ > 0.3; })) << bytes_of(folder_ / "robot.txt");
  command_.reset();
  EXPECT_TRUE(until([&] { return stands(); }));
}

TEST_F(ExampleRobot, ACommandThatIsRepeatedForEverIsNoCommand) {
  command_ = 0.3;
  ASSERT_TRUE(until([&] { return x_ > 0.1; }));
  repeated_ = stamp();
  EXPECT_TRUE(until([&] { return stands(); }));
}

TEST_F(ExampleRobot, DoesNotObeyACommandThatIsNotANumber) {
  command_ = std::numeric_limits<double>::quiet_NaN();
  ASSERT_TRUE(until([&] { return count_["ODOMETRY"] > 20; }));
  EXPECT_EQ(x_, 0);
}

TEST_F(ExampleRobot, StandsWithoutMrScan) {
  answers_ = false;
  command_ = 0.3;
  ASSERT_TRUE(until([&] { return count_["ODOMETRY"] > 30; }));
  EXPECT_EQ(x_, 0);
}

TEST_F(ExampleRobot, StopsBeforeWhatOnlyMrScanShowsAndMayBackAway) {
  constexpr double kFront = 0.22;  // m, of the footprint
  wall_ = 1.0;
  command_ = 0.5;
  ASSERT_TRUE(until([&] { return x_ > 0.3 && stands(); }));
  EXPECT_LT(x_ + kFront, *wall_);
  const double stopped = x_;
  command_ = -0.3;
  EXPECT_TRUE(until([&] { return x_ < stopped - 0.2; }));
}

TEST_F(ExampleRobot, ThatDrivesItselfStandsWhileMrCmdBringsStops) {
  switch_on({"--to", "3,0"});
  localizes_ = true;
  ASSERT_TRUE(until([&] { return x_ > 0.2; })) << bytes_of(folder_ / "robot.txt");
  command_ = 0;
  ASSERT_TRUE(until([&] { return stands(); }));
  const double stopped = x_;
  command_.reset();
  EXPECT_TRUE(until([&] { return x_ > stopped + 0.2; }));
}

TEST_F(ExampleRobot, ItsArmObeysWithinItsLimitsAndHoldsStillInSilence) {
  Joints command;
  command.names = {"shoulder", "third_arm"};
  command.positions = {-5, 1};
  const auto shoulder = [&] { return joints_.positions.size() < 2 ? 2 : joints_.positions[1]; };
  const auto send = [&] {
    command.stamp = stamp();
    publish(channel::kMrJointCmd, command);
  };
  ASSERT_TRUE(until([&] { return send(), shoulder() < 1.3; }));
  const int before = count_["JOINT_STATE"];
  ASSERT_TRUE(until([&] { return count_["JOINT_STATE"] > before + 20; }));  // silence
  const double held = shoulder();
  ASSERT_TRUE(until([&] { return count_["JOINT_STATE"] > before + 30; }));
  EXPECT_EQ(shoulder(), held);
  ASSERT_TRUE(until([&] { return send(), shoulder() < -1.19; }));
  EXPECT_GT(shoulder(), -1.21);
}

TEST(ExampleRobotFiles, ABuildingThatCannotBeReadIsNamedWithItsLine) {
  const TemporaryFolder folder;
  std::ofstream(folder / "building.txt") << "start 0 0 0\nwall 0 0 1 0 0.1 0 2.5 1 1 1\nbox 1 2\n";
  const auto ran = run({"--building", folder / "building.txt", "--description", kFolder + "robot.yaml"},
                       folder / "robot.txt", kProgram);
  EXPECT_EQ(ran.exit, 1);
  EXPECT_NE(ran.output.find("building.txt:3: expected"), std::string::npos) << ran.output;
}

TEST(ExampleRobotFiles, AnOptionThatIsNotANumberIsAnErrorOfUsage) {
  const TemporaryFolder folder;
  const auto ran = run({"--slip", "much"}, folder / "robot.txt", kProgram);
  EXPECT_EQ(ran.exit, 2);
  EXPECT_NE(ran.output.find("--slip much: expected a number"), std::string::npos) << ran.output;
}

}  // namespace
}  // namespace parhelion::test
