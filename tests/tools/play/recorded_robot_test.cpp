// A recorded robot behaves like a live one, and stands still after the end of its recording.
#include "tools/demo/recorded_robot.hpp"

#include <gtest/gtest.h>

#include "tests/server/runtime/play/random_session.hpp"

namespace parhelion::tools {
namespace {

const ArrivalTime kNow{1'800'000'000'000'000'000};
constexpr int kScans = 20;

/// Ten scans a second, odometry 3 ms before each, one IMU sample at the start, and between them a command and
/// an invalid picture.
void write_robot(const std::string& path) {
  auto log = LogWriter::create(path, true);
  ASSERT_TRUE(log.ok());
  std::vector<std::uint8_t> bytes;
  const auto put = [&](const char* channel, Duration at, const auto& message) {
    encode(message, bytes);
    ASSERT_TRUE(log->write(channel, test::kSessionStart + at, bytes).ok());
  };
  const SensorTime start{test::kSessionStart.ns - 2'000'000};  // stamps are 2 ms older
  ImuSample sample;
  sample.stamp = start;
  put(channel::kImu, {}, sample);
  for (int i = 0; i < kScans; ++i) {
    const Duration at = milliseconds(100 * i + 10);
    Odometry odometry;
    odometry.stamp = start + at - milliseconds(3);
    put(channel::kOdometry, at - milliseconds(3), odometry);
    Scan scan;
    scan.stamp = start + at;
    scan.ranges.assign(5, static_cast<float>(i + 1));
    scan.angle_increment = 0.1F;
    put(channel::kScan, at, scan);
    TwistCommand command;
    command.stamp = start + at;
    put(channel::kTeleop, at, command);
  }
  const std::uint8_t nothing[3] = {1, 2, 3};
  ASSERT_TRUE(log->write(channel::kCamera, test::kSessionStart + seconds(2.5), nothing).ok());
}

bool speaks(const std::string& name) {
  return name == channel::kScan || name == channel::kOdometry || name == channel::kImu ||
         name == channel::kCamera;
}

class RecordedRobotTest : public ::testing::Test {
 protected:
  void SetUp() override {
    write_robot(log_);
    auto opened = RecordedRobot::open(log_, speaks, channel::kScan, kNow);
    ASSERT_TRUE(opened.ok()) << opened.error().message;
    robot_ = std::make_unique<RecordedRobot>(std::move(*opened));
  }
  Message next() {
    auto message = robot_->next();
    EXPECT_TRUE(message.ok());
    return std::move(message).value();
  }

  const test::PlayFolder folder_;
  const std::string log_ = folder_ / "robot.lcm";
  std::unique_ptr<RecordedRobot> robot_;
};

TEST_F(RecordedRobotTest, RepublishesRecordedMessagesWithCurrentStamps) {
  EXPECT_EQ(next().arrival, kNow);  // IMU
  for (int i = 0; i < kScans; ++i) {
    const Message odometry = next(), scan = next();
    EXPECT_EQ(odometry.channel, channel::kOdometry);
    ASSERT_EQ(scan.channel, channel::kScan);
    EXPECT_EQ(scan.arrival - kNow, milliseconds(100 * i + 10));
    Scan read;
    ASSERT_TRUE(decode(scan.channel, scan.payload, read).ok());
    EXPECT_EQ(read.stamp.ns, scan.arrival.ns - 2'000'000);
    EXPECT_EQ(read.ranges.front(), static_cast<float>(i + 1));
  }
  EXPECT_FALSE(robot_->stands());
}

TEST_F(RecordedRobotTest, RepeatsLastMessagesAtTheirRateAfterTheEnd) {
  for (int i = 0; i < 1 + 2 * kScans; ++i) next();
  ArrivalTime before = kNow + milliseconds(100 * (kScans - 1) + 10);
  ArrivalTime last_scan = before;
  int seen = 0;
  for (int i = 0; i < 300; ++i) {
    const Message message = next();
    EXPECT_GE(message.arrival, before);
    before = message.arrival;
    if (message.channel != channel::kScan) continue;
    EXPECT_EQ(message.arrival - last_scan, milliseconds(100));
    last_scan = message.arrival;
    Scan read;
    ASSERT_TRUE(decode(message.channel, message.payload, read).ok());
    EXPECT_EQ(read.stamp.ns, message.arrival.ns - 2'000'000);
    EXPECT_EQ(read.ranges.front(), static_cast<float>(kScans));
    ++seen;
  }
  EXPECT_TRUE(robot_->stands());
  EXPECT_EQ(seen, 100);  // of scan, odometry and IMU
  EXPECT_EQ(robot_->passed_over(), 1U);
}

TEST_F(RecordedRobotTest, ALogWithoutTheRobotIsRefused) {
  const auto other = RecordedRobot::open(log_, speaks, "LINES", kNow);
  ASSERT_FALSE(other.ok());
  EXPECT_NE(other.error().message.find("LINES"), std::string::npos);
}

}  // namespace
}  // namespace parhelion::tools
