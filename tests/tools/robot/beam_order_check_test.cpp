// `parhelion robot` with a driver that reverses the beams of its laser.
#include <gmock/gmock.h>

#include "tests/fusion/pose/swept_drive.hpp"
#include "tests/temporary_folder.hpp"
#include "tests/tools/robot_log.hpp"
#include "tools/robot/check_description.hpp"
#include "tools/robot/log_survey.hpp"

namespace parhelion::tools {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

constexpr double kInterval = 0.09 / 361;  // s between two beams

Result<LogSurvey> surveyed(const test::SweptDrive& drive) {
  const test::TemporaryFolder folder;
  test::RobotLog log(folder / "drive.lcm", drive.robot);
  for (const test::DriveInput& input : drive.inputs) {
    if (input.scan)
      log.write("SCAN", *input.scan);
    else
      log.write("ODOMETRY", input.odometry);
  }
  return survey_log(folder / "drive.lcm");
}

TEST(BeamOrderCheck, ContradictsADescriptionWithTheWrongSign) {
  const test::SweptDrive drive = test::swept_drive(41, kInterval, -kInterval);
  const auto log = surveyed(drive);
  ASSERT_TRUE(log.ok()) << log.error().message;
  const auto wrong = Contains(HasSubstr("in the reverse of the described order"));
  EXPECT_THAT(check_description(drive.robot, *log).contradictions, wrong);
  RobotDescription right = drive.robot;
  right.laser->beam_interval = -kInterval;
  EXPECT_THAT(check_description(right, *log).contradictions, Not(wrong));
}

TEST(BeamOrderCheck, GivesANewDescriptionTheRightSign) {
  for (const double interval : {kInterval, -kInterval}) {
    const auto log = surveyed(test::swept_drive(42, kInterval, interval));
    ASSERT_TRUE(log.ok()) << log.error().message;
    EXPECT_EQ(laser_seen(*log->laser).beam_interval < 0, interval < 0);
  }
}

TEST(BeamOrderCheck, GivesANewDescriptionBeamsAtOnceWhereTurnsShowThem) {
  const auto log = surveyed(test::swept_drive(42, kInterval, 0));
  ASSERT_TRUE(log.ok()) << log.error().message;
  EXPECT_EQ(laser_seen(*log->laser).beam_interval, 0);
}

}  // namespace
}  // namespace parhelion::tools
