// ROS recordings whose drivers do what others do not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/temporary_folder.hpp"
#include "tests/tools/imported_log.hpp"
#include "tests/tools/written_bag.hpp"

namespace parhelion::tools {
namespace {

using test::ImportedLog;
using test::RosBytes;
using test::TemporaryFolder;
using test::WrittenBag;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

/// The fields before the ranges.
RosBytes scan_before_ranges(std::uint32_t seconds, float range_min, float range_max) {
  RosBytes bytes;
  bytes.header(seconds, 1000, "laser");
  for (const float value : {-1.0F, 1.0F, 0.5F, 0.0F, 0.1F, range_min, range_max}) bytes.add(value);
  return bytes;
}

RosBytes laser_scan(std::uint32_t seconds, float range_min = 0.1F, float range_max = 30) {
  RosBytes bytes = scan_before_ranges(seconds, range_min, range_max);
  bytes.array<float>({1, 2, 3, 4, 5}).array<float>({});
  return bytes;
}

RosBytes wheel_odometry(std::uint32_t seconds, double w) {
  RosBytes bytes;
  bytes.header(seconds, 0, "odom").text("base_link").doubles({0.1 * seconds, 0, 0, 0, 0, 0, w});
  for (int i = 0; i < 36 + 6 + 36; ++i) bytes.add(0.0);
  return bytes;
}

RosBytes odometry_as_tf(std::uint32_t seconds) {
  RosBytes bytes;
  bytes.add(std::uint32_t{1}).header(seconds, 0, "odom").text("base_link").doubles({0, 0, 0, 0, 0, 0, 1});
  return bytes;
}

ImportReport imported_odd(const WrittenBag& bag, const TemporaryFolder& folder) {
  bag.write(folder / "in.bag");
  auto options = test::import_options(folder / "in.bag", folder / "out.lcm");
  options.overwrite = true;
  auto report = import_recording(options, {});
  EXPECT_TRUE(report.ok()) << (report.ok() ? "" : report.error().message);
  return report.ok() ? *report : ImportReport{};
}

TEST(ImportOddBags, LimitsThatAreNotFiniteAreThoseThatTheScansShow) {
  for (const float limit :
       {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN(), -1.0F, 0.0F}) {
    const TemporaryFolder folder;
    WrittenBag bag;
    bag.add("/scan", "sensor_msgs/LaserScan", 100, laser_scan(100, limit, limit));
    EXPECT_THAT(imported_odd(bag, folder).notes, Contains(HasSubstr("longest observed, 5"))) << limit;
    const RobotDescription robot = ImportedLog(folder / "out.lcm").robot();  // which can be read again
    EXPECT_EQ(robot.laser->convention.range_max, 5) << limit;
  }
}

/// Of a beam with several echoes the first; of both ROS.
TEST(ImportOddBags, AScanOfSeveralEchoesHasTheFirstOfEachBeam) {
  const TemporaryFolder folder;
  WrittenBag bag;
  RosBytes message = scan_before_ranges(100, 0.1F, 30);
  message.add(std::uint32_t{3}).array<float>({1, 1.5F}).array<float>({}).array<float>({3});
  message.add(std::uint32_t{3}).array<float>({10, 15}).array<float>({}).array<float>({30});
  bag.add("/echoes", "sensor_msgs/MultiEchoLaserScan", 100, message);
  bag.write(folder / "echoes.bag");
  bag.write_database(folder / "echoes.db3");
  for (const char* name : {"echoes.bag", "echoes.db3"}) {
    auto options = test::import_options(folder / name, folder / "out.lcm");
    options.overwrite = true;
    const auto report = import_recording(options, {});
    ASSERT_TRUE(report.ok()) << report.error().message;
    EXPECT_EQ(report->refused, 0U);
    const auto scans = ImportedLog(folder / "out.lcm").all<Scan>(channel::kScan);
    ASSERT_EQ(scans.size(), 1U);
    EXPECT_THAT(scans[0].ranges, ::testing::ElementsAre(1, std::numeric_limits<float>::infinity(), 3));
    EXPECT_THAT(scans[0].intensities, ::testing::ElementsAre(10, 0, 30));
  }
}

TEST(ImportOddBags, ADamagedScanOfSeveralEchoesIsRefused) {
  const TemporaryFolder folder;
  WrittenBag bag;
  RosBytes huge = scan_before_ranges(100, 0.1F, 30), empty = scan_before_ranges(101, 0.1F, 30);
  huge.add(std::uint32_t{4'000'000'000}).array<float>({1});
  empty.add(std::uint32_t{2});
  bag.add("/echoes", "sensor_msgs/MultiEchoLaserScan", 100, huge);
  bag.add("/echoes", "sensor_msgs/MultiEchoLaserScan", 101, empty);
  bag.add("/odom", "nav_msgs/Odometry", 101, wheel_odometry(101, 1));
  EXPECT_EQ(imported_odd(bag, folder).refused, 2U);
}

TEST(ImportOddBags, OdometryThatCannotBeReadIsTakenFromTf) {
  const TemporaryFolder folder;
  WrittenBag bag;
  for (std::uint32_t t = 100; t < 130; ++t) {
    bag.add("/odom", "nav_msgs/Odometry", t, wheel_odometry(t, 0));
    bag.add("/tf", "tf2_msgs/TFMessage", t, odometry_as_tf(t));
    bag.add("/scan", "sensor_msgs/LaserScan", t, laser_scan(t));
  }
  const ImportReport report = imported_odd(bag, folder);
  EXPECT_THAT(report.notes, Contains(HasSubstr("ODOMETRY is tf:odom->base_link")));
  EXPECT_THAT(report.notes, Contains(HasSubstr("/odom: no message of it can be read")));
  EXPECT_EQ(report.refused, 0U);
  EXPECT_EQ(ImportedLog(folder / "out.lcm").all<Odometry>(channel::kOdometry).size(), 30U);
}

TEST(ImportOddBags, OfMessagesThatAreRefusedForOneReasonTheFirstAreListed) {
  const TemporaryFolder folder;
  WrittenBag bag;
  for (std::uint32_t t = 100; t < 130; ++t) {
    bag.add("/odom", "nav_msgs/Odometry", t, wheel_odometry(t, 0));
    bag.add("/scan", "sensor_msgs/LaserScan", t, laser_scan(t));
  }
  const ImportReport report = imported_odd(bag, folder);
  EXPECT_EQ(report.refused, 30U);
  EXPECT_EQ(report.refusals.size(), 5U);
  const std::vector<std::string> lines = findings(report);
  EXPECT_THAT(lines, Contains(HasSubstr("and 25 more: /odom: byte")));
  EXPECT_THAT(lines, Not(Contains(HasSubstr("for other reasons"))));
}

/// The laser counts from when it was switched on.
TEST(ImportOddBags, ScansOfAnotherClockAreNoted) {
  const TemporaryFolder folder;
  WrittenBag bag;
  for (std::uint32_t t = 1000; t < 1030; ++t) {
    bag.add("/odom", "nav_msgs/Odometry", t, wheel_odometry(t - 1, 1));  // is a second old when it arrives
    bag.add("/scan", "sensor_msgs/LaserScan", t, laser_scan(t - 991));
  }
  const ImportReport report = imported_odd(bag, folder);
  EXPECT_THAT(report.notes, Contains(HasSubstr("SCAN: stamps are 990.0 s behind those of ODOMETRY")));
  EXPECT_THAT(report.notes, Not(Contains(HasSubstr("stamp_beam"))));
}

}  // namespace
}  // namespace parhelion::tools
