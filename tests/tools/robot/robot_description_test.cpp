// `parhelion robot`: a description from a URDF and a log, and what a log contradicts in one.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>

#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "tests/temporary_folder.hpp"
#include "tools/robot/check_description.hpp"
#include "tools/robot/new_description.hpp"

namespace parhelion::tools {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr const char* kUrdf = R"(<robot name="rover">
<link name="chassis"><inertial><mass value="20"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
<collision><geometry><box size="0.6 0.4 0.2"/></geometry></collision></link>
<joint name="a" type="fixed"><origin xyz="0.2 0 0.15" rpy="0 0 1.5707963"/><parent link="chassis"/><child link="front_laser"/></joint>
<link name="front_laser"/>
<joint name="b" type="fixed"><origin xyz="0.25 0 0.1" rpy="-1.5707963 0 -1.5707963"/><parent link="chassis"/><child link="camera_rgb_optical_frame"/></joint>
<link name="camera_rgb_optical_frame"/>
</robot>)";

/// What the made-up robot's driver writes.
struct Driver {
  std::size_t beams = 360;
  double angle_min = -std::numbers::pi, angle_increment = 2 * std::numbers::pi / 360;
  double period = 0.1;
  float no_return = std::numeric_limits<float>::infinity();
  double turn_sign = 1;         ///< of odometry
  bool mast = false;            ///< hides ten beams
  bool reversed = false;        ///< the beams' order, as of a laser upside down whose driver does not know
  bool stands = false;          ///< odometry's stamp
  double stamp_scale = 1;       ///< of all stamps, from the start on
  double odometry_ahead = 0;    ///< s, of odometry's clock
  double arrival_jump = 0;      ///< s, of the clock of the log after 5 s
  std::int64_t stamp_unit = 1;  ///< of all stamps, per microsecond
};

/// Distance from (x, y) along a bearing to the walls of a room of 9 m x 6 m with a gap without a return.
float room(double x, double y, double bearing, float no_return) {
  const double c = std::cos(bearing), s = std::sin(bearing);
  const double to_x = c > 0 ? (5 - x) / c : c < 0 ? (-4 - x) / c : 1e9;
  const double to_y = s > 0 ? (2 - y) / s : s < 0 ? (-4 - y) / s : 1e9;
  const double range = std::min(to_x, to_y);
  const double hit_y = y + range * s;
  if (to_x < to_y && c > 0 && hit_y > -1 && hit_y < 1) return no_return;
  return static_cast<float>(std::round(range * 1000) / 1000);
}

/// A log of 40 s: the robot turns on the spot by a whole turn and drives a little. The laser looks to the
/// left (yaw 90 degrees).
std::string write_log(const test::TemporaryFolder& folder, const Driver& driver) {
  const std::string path = folder / "drive.lcm";
  auto log = LogWriter::create(path, true).value();
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < 400; ++i) {
    const double t = i * driver.period, yaw = 0.02 * i, x = 0.002 * i;
    const auto stamp_at = [&driver](double at) {
      return SensorTime::from_utime(driver.stamp_unit *
                                    (1'000'000'000 + static_cast<std::int64_t>(at * 1e6)));
    };
    const SensorTime stamp = stamp_at(driver.stamp_scale * t);
    const ArrivalTime arrival = ArrivalTime::from_utime(
        1'000'000'000 + static_cast<std::int64_t>((t + (t > 5 ? driver.arrival_jump : 0)) * 1e6));
    Scan scan;
    scan.stamp = stamp;
    scan.angle_min = static_cast<float>(driver.angle_min);
    scan.angle_increment = static_cast<float>(driver.angle_increment);
    for (std::size_t k = 0; k < driver.beams; ++k) {
      const double angle = driver.angle_min + static_cast<double>(k) * driver.angle_increment;
      scan.ranges.push_back(
          driver.mast && k < 10 ? 0.05F : room(x, 0, yaw + std::numbers::pi / 2 + angle, driver.no_return));
    }
    if (driver.reversed) std::reverse(scan.ranges.begin(), scan.ranges.end());
    encode(scan, bytes);
    EXPECT_TRUE(log.write(channel::kScan, arrival, bytes).ok());
    Odometry odometry;
    odometry.stamp = driver.stands ? stamp_at(0) : stamp + seconds(driver.odometry_ahead);
    odometry.T_odom_base = Transform<Odom, Base>::planar(x, 0, driver.turn_sign * yaw);
    encode(odometry, bytes);
    EXPECT_TRUE(log.write(channel::kOdometry, arrival, bytes).ok());
  }
  return path;
}

const Dialogue kLikely{[](const std::string&, const std::string&) { return std::nullopt; }, {}};

struct Made {
  test::TemporaryFolder folder;
  LogSurvey log;
  UrdfOutline urdf;

  explicit Made(const Driver& driver = {}) {
    std::ofstream(folder / "rover.urdf") << kUrdf;
    urdf = read_urdf_outline(folder / "rover.urdf").value();
    log = survey_log(write_log(folder, driver)).value();
  }
  RobotDescription description() const {
    const auto made = new_description(urdf, log, kLikely);
    EXPECT_TRUE(made.ok()) << made.error().message;
    const auto robot = parse_robot_description(made->text, "new");
    EXPECT_TRUE(robot.ok()) << robot.error().message;
    return *robot;
  }
};

TEST(RobotNew, TakesPosesAndOutlineFromTheUrdf) {
  const Made made;
  const RobotDescription robot = made.description();
  ASSERT_TRUE(robot.laser);
  EXPECT_TRUE(robot.laser->T_base_laser.translation().isApprox(Eigen::Vector3d(0.2, 0, 0.25), 1e-4));
  EXPECT_NEAR(robot.laser->T_base_laser.rotation()(1, 0), 1, 1e-4);
  EXPECT_NEAR(robot.height, 0.2, 1e-6);
  EXPECT_NEAR(robot.mass, 20, 1e-6);
  EXPECT_EQ(robot.footprint.size(), 4U);
  EXPECT_FALSE(robot.camera) << "the log has no images";
}

TEST(RobotNew, TakesAnglesTimesAndSentinelsFromTheLog) {
  for (const float no_return :
       {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN(), 0.F, 81.91F}) {
    Driver driver;
    driver.no_return = no_return;
    const RobotDescription robot = Made(driver).description();
    ASSERT_TRUE(robot.laser);
    EXPECT_EQ(robot.laser->convention.classify(no_return), BeamKind::no_return) << no_return;
    EXPECT_EQ(robot.laser->convention.classify(3.F), BeamKind::hit) << no_return;
    EXPECT_NEAR(robot.laser->scan_period, 0.1, 1e-3);
    EXPECT_EQ(robot.laser->beams, 360);
    EXPECT_NEAR(robot.laser->angle_min, -std::numbers::pi, 1e-5);
    EXPECT_EQ(robot.laser->beam_interval, 0) << "its turns show scans of one instant";
  }
}

TEST(RobotNew, TakesTheRangesOfTheDescriptionInTheLogUnlessScansContradictThem) {
  Made made;
  const float nearest = made.log.laser->min_range, farthest = made.log.laser->max_range;
  made.log.robot_yaml = "laser: {preset: utm-30lx, pose: {x: 0 m}}\n";
  EXPECT_FLOAT_EQ(made.description().laser->convention.range_min, 0.1F);
  EXPECT_FLOAT_EQ(made.description().laser->convention.range_max, 30);
  for (const char* wrong : {"range_max: 2 m", "range_min: 3 m"}) {
    made.log.robot_yaml = std::string("laser: {pose: {x: 0 m}, ") + wrong + "}\n";
    EXPECT_NEAR(made.description().laser->convention.range_min, nearest, 1e-4) << wrong;
    EXPECT_NEAR(made.description().laser->convention.range_max, farthest, 1e-3) << wrong;
  }
}

TEST(RobotNew, ACamerasOpticalFrameIsTurnedToItsLink) {
  Made made;
  made.log.camera = ImageSurvey{10, 320, 240, 0.1};
  const RobotDescription robot = made.description();
  ASSERT_TRUE(robot.camera);
  EXPECT_TRUE(robot.camera->T_base_optical.rotation().col(2).isApprox(Eigen::Vector3d::UnitX(), 1e-4));
  EXPECT_TRUE(robot.camera->T_base_optical.rotation().col(1).isApprox(-Eigen::Vector3d::UnitZ(), 1e-4));
}

TEST(RobotNew, AnswersReplaceGuessesAndAreChecked) {
  const Made made;
  const auto with = [&](const std::string& asked, const std::string& answer) {
    return new_description(made.urdf, made.log,
                           {[&](const std::string& question, const std::string& value) {
                              return question.starts_with(asked) ? answer : value;
                            },
                            {}});
  };
  EXPECT_THAT(with("Greatest speed", "1.25").value().text, HasSubstr("speed: 1.25 m/s"));
  EXPECT_THAT(with("Greatest speed", "fast").error().message, HasSubstr("found 'fast'"));
  EXPECT_THAT(with("Greatest speed", "-1").error().message, HasSubstr("at least 0"));
  EXPECT_THAT(with("Link of the laser", "front_lasre").error().message, HasSubstr("front_laser"));
}

TEST(RobotCheck, WhatNewMadeAgreesWithItsLog) {
  const Made made;
  const DescriptionCheck check = check_description(made.description(), made.log);
  EXPECT_THAT(check.contradictions, IsEmpty());
  EXPECT_THAT(check.agreements, Contains("scans turn as odometry does"));
}

TEST(RobotCheck, EachContradictionIsFoundAlone) {
  struct Case {
    const char* what;
    std::function<void(RobotDescription&)> change;
    const char* found;
  };
  const Case cases[] = {
      {"beams", [](RobotDescription& r) { r.laser->beams = 720; }, "laser beams: 720, but scans have 360"},
      {"angles", [](RobotDescription& r) { r.laser->angle_min = 0; }, "laser angle_min"},
      {"period", [](RobotDescription& r) { r.laser->scan_period = 0.2; }, "laser scan_period"},
      {"sweep", [](RobotDescription& r) { r.laser->beam_interval = 1e-3; }, "laser beam_interval"},
      {"range_max", [](RobotDescription& r) { r.laser->convention.range_max = 4; }, "laser range_max"},
      {"range_min", [](RobotDescription& r) { r.laser->convention.range_min = 3; }, "laser range_min"},
      {"no_return",
       [](RobotDescription& r) { r.laser->convention.no_return = RangeConvention::Sentinel::nan; },
       "laser no_return"},
      {"footprint",
       [](RobotDescription& r) {
         for (auto& corner : r.footprint) corner *= 30;
       },
       "outline"},
      {"speed", [](RobotDescription& r) { r.limits.speed = 0.001; }, "limits speed"},
      {"yaw rate", [](RobotDescription& r) { r.limits.yaw_rate = 0.05; }, "limits yaw_rate"},
      {"camera", [](RobotDescription& r) { r.camera.emplace(); }, "no messages on CAMERA"},
      {"laser", [](RobotDescription& r) { r.laser.reset(); }, "add 'laser'"},
  };
  const Made made;
  for (const Case& each : cases) {
    RobotDescription robot = made.description();
    each.change(robot);
    const DescriptionCheck check = check_description(robot, made.log);
    EXPECT_THAT(check.contradictions, testing::ElementsAre(HasSubstr(each.found))) << each.what;
  }
}

TEST(RobotCheck, FurtherSensorsAreComparedByTheirChannels) {
  Made made;
  RobotDescription robot = made.description();
  robot.further_lasers = {{"rear", *robot.laser}, {"left", *robot.laser}};
  made.log.further = {"SCAN_rear", "CAMERA_arm"};
  const DescriptionCheck check = check_description(robot, made.log);
  EXPECT_THAT(check.agreements, Contains("lasers has messages on SCAN_rear"));
  EXPECT_THAT(
      check.contradictions,
      testing::UnorderedElementsAre("lasers: is described, but the log has no messages on SCAN_left",
                                    "cameras: the log has messages on CAMERA_arm, but nothing describes the "
                                    "sensor; add 'cameras'"));
}

TEST(RobotCheck, AValueWithoutReturnThatIsTakenForAWallIsFound) {
  Driver driver;
  driver.no_return = 81.91F;
  const Made made(driver);
  RobotDescription robot = made.description();
  robot.laser->convention.no_return = RangeConvention::Sentinel::infinity;
  robot.laser->convention.range_max = 100;
  EXPECT_THAT(check_description(robot, made.log).contradictions, testing::ElementsAre(HasSubstr("81.91")));
}

TEST(RobotCheck, ScansThatTurnAgainstOdometryAreFound) {
  Driver driver;
  driver.turn_sign = -1;
  const Made made(driver);
  EXPECT_THAT(check_description(made.description(), made.log).contradictions,
              testing::ElementsAre(HasSubstr("turn in the opposite direction")));
}

TEST(RobotCheck, TheSenseOfTurningIsThatOfTheLasersMounting) {
  const auto check = [](bool upside_down, bool reversed) {
    Driver driver;
    driver.reversed = reversed;
    const Made made(driver);
    RobotDescription robot = made.description();
    if (upside_down) {
      auto& T_base_laser = robot.laser->T_base_laser;
      T_base_laser = Transform<Base, Laser>(T_base_laser.isometry() *
                                            Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()));
    }
    return check_description(robot, made.log);
  };
  EXPECT_THAT(check(true, true).contradictions, IsEmpty());
  EXPECT_THAT(check(true, true).agreements, Contains("scans turn as odometry does"));
  EXPECT_THAT(check(true, false).contradictions, Contains(HasSubstr("is not upside down as its pose is")));
  EXPECT_THAT(check(false, true).contradictions, Contains(HasSubstr("roll: 180 deg")));
}

TEST(RobotCheck, BeamsThatSeeTheRobotItselfAreFound) {
  Driver driver;
  driver.mast = true;
  const Made made(driver);
  EXPECT_THAT(check_description(made.description(), made.log).contradictions,
              testing::ElementsAre(HasSubstr("10 beams end inside")));
}

TEST(RobotNew, OdometryWhoseStampStandsGivesNoSpeed) {
  Driver driver;
  driver.stands = true;
  const Made made(driver);
  ASSERT_TRUE(made.log.odometry);
  EXPECT_EQ(made.log.odometry->samples.size(), 1U);
  EXPECT_EQ(made.log.odometry->speed, 0);
}

TEST(RobotCheck, StampsInAnotherUnitAreFound) {
  for (const double scale : {0.0, 1e-3, 1e-6}) {
    Driver driver;
    driver.stamp_scale = scale;
    const Made made(driver);
    const DescriptionCheck check = check_description(Made().description(), made.log);
    EXPECT_THAT(check.contradictions, Contains(HasSubstr("SCAN: stamps advance by"))) << scale;
    EXPECT_THAT(check.contradictions, Contains(HasSubstr("ODOMETRY: stamps advance by"))) << scale;
  }
}

TEST(RobotCheck, TwoClocksAreFound) {
  Driver driver;
  driver.odometry_ahead = -5;
  const DescriptionCheck check = check_description(Made().description(), Made(driver).log);
  EXPECT_THAT(check.contradictions, Contains(HasSubstr("5 s apart; all sensors need one clock")));
}

/// Scans of 100 ms, and odometry that takes 5 ms to arrive.
TEST(RobotCheck, StampsOfTheArrivalAreFound) {
  const test::TemporaryFolder folder;
  RobotDescription robot = Made().description();
  robot.laser->beams = 100;
  robot.laser->beam_interval = 1e-3;
  const auto check_with = [&](double scan_delay, double odometry_delay, double clock) {
    const std::string path = folder / "drive.lcm";
    auto log = LogWriter::create(path, true).value();
    std::vector<std::uint8_t> bytes;
    const auto write = [&](const char* channel, auto message, double stamp, double arrival) {
      message.stamp =
          SensorTime::from_utime(1'000'000'000 + static_cast<std::int64_t>(1e6 * (stamp + clock)));
      encode(message, bytes);
      const auto at = ArrivalTime::from_utime(1'000'000'000 + static_cast<std::int64_t>(1e6 * arrival));
      EXPECT_TRUE(log.write(channel, at, bytes).ok());
    };
    Scan scan;
    scan.angle_increment = 0.01F;
    scan.ranges.assign(100, 3.F);
    for (int i = 0; i < 1000; ++i) {
      const double t = 0.02 * i;
      write(channel::kOdometry, Odometry{}, t - odometry_delay, t);
      if (i % 5 == 0) write(channel::kScan, scan, t + 0.003 - scan_delay, t + 0.003);
    }
    std::string found;
    for (const std::string& each : check_description(robot, survey_log(path).value()).contradictions)
      if (each.starts_with("SCAN stamp_beam")) found += each;
    return found;
  };
  for (const double clock : {0.0, 0.07, 3.0}) {
    EXPECT_THAT(check_with(0.001, 0.005, clock), HasSubstr("set stamp_beam: last")) << clock;
    EXPECT_EQ(check_with(0.101, 0.005, clock), "") << "as described";
    EXPECT_EQ(check_with(0.101, 0.045, clock), "") << "slow odometry";
  }
  EXPECT_EQ(check_with(0.101, 0.2, 0), "") << "odometry by another clock";
  EXPECT_EQ(check_with(0.001, 0.005, -3), "") << "not shown: by the clock of the log scans come late";
}

TEST(RobotCheck, AClockOfTheLogThatJumpsIsNoFault) {
  Driver driver;
  driver.arrival_jump = 90;
  EXPECT_THAT(check_description(Made().description(), Made(driver).log).contradictions, IsEmpty());
}

TEST(RobotCheck, ALogWithoutAReadableMessageIsRefusedWithTheReason) {
  const test::TemporaryFolder folder;
  Driver driver;
  driver.stamp_unit = 8'000'000;  // beyond 2200
  const auto survey = survey_log(write_log(folder, driver));
  ASSERT_FALSE(survey.ok());
  EXPECT_THAT(survey.error().message, HasSubstr("expected microseconds since 1970"));
}

TEST(RobotCheck, ALogWithoutSensorsOrThatIsNoneIsRefused) {
  const test::TemporaryFolder folder;
  std::ofstream(folder / "empty.lcm");
  EXPECT_THAT(survey_log(folder / "empty.lcm").error().message, HasSubstr("expected messages on SCAN"));
  EXPECT_FALSE(survey_log(folder / "absent.lcm").ok());
}

}  // namespace
}  // namespace parhelion::tools
