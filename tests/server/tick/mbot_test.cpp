// A robot that speaks MBot's own types: scans whose beams have angles and times of their own (lidar_t), and
// motor commands (mbot_motor_command_t).
#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "fusion/scan/lidar_model.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

using test::agent;
using test::TickTest;

constexpr double kSweep = 0.14;  // s, a turn of a small spinning laser

/// A turn of about 300 beams: angles that jitter by more than their step, a few left out, clockwise.
void draw_beams(std::mt19937& random, Scan& scan) {
  std::uniform_real_distribution<double> jitter(-0.03, 0.03);
  for (int i = 0; i < 320; ++i) {
    if (random() % 16 == 0) continue;
    const double turned = i / 320.0;
    scan.angles.push_back(static_cast<float>(2 - 2 * std::numbers::pi * turned + jitter(random)));
    scan.times.push_back(scan.stamp.utime() + static_cast<std::int64_t>(turned * kSweep * 1e6));
    scan.intensities.push_back(static_cast<float>(random() % 64));
  }
  scan.angle_min = scan.angles.front();
  scan.angle_increment = static_cast<float>(-2 * std::numbers::pi / 320);
}

/// What such a laser sees in the room from the synthetic drive.
Scan uneven_scan_at(double t, std::mt19937& random) {
  const LaserDescription laser = *test::robot().laser;
  Scan scan;
  scan.stamp = SensorTime::from_utime(test::kStartUs + static_cast<std::int64_t>(t * 1e6));
  draw_beams(random, scan);
  scan.ranges.resize(scan.angles.size());
  std::vector<float> time;
  const scan::Sweep sweep = scan::beam_times(laser, scan, time);
  std::vector<scan::RangeHit> hits(time.size());
  const auto T_map_laser = [&](Duration after) {
    return test::pose_at(t + after.seconds()) * laser.T_base_laser;
  };
  scan::cast_building_exact({T_map_laser(sweep.start), T_map_laser(sweep.end)}, scan::beam_set(scan, time),
                            test::room(), 30, hits);
  for (std::size_t i = 0; i < hits.size(); ++i) scan.ranges[i] = hits[i].range;
  return scan;
}

/// The synthetic drive, with such scans in place of its own; they arrive after their last beam.
std::vector<Message> mbot_drive(double duration) {
  std::mt19937 random(7);
  std::vector<Message> log = test::drive(duration);
  std::erase_if(log, [](const Message& each) { return each.channel == channel::kScan; });
  for (double t = 0.05; t + kSweep < duration; t += 0.15) {
    const std::int64_t arrival = test::kStartUs + static_cast<std::int64_t>((t + kSweep) * 1e6) + 30'000;
    log.push_back(test::message(channel::kScan, arrival, uneven_scan_at(t, random)));
  }
  std::stable_sort(log.begin(), log.end(),
                   [](const Message& a, const Message& b) { return a.arrival < b.arrival; });
  return log;
}

/// m, of a return from the axis of the barrel at (3, 2), by the beam's own angle and instant.
double off_axis(const Scan& scan, std::size_t beam) {
  const double t = static_cast<double>(scan.times[beam] - test::kStartUs) * 1e-6;
  const Eigen::Vector3d p_laser(scan.ranges[beam] * std::cos(scan.angle(beam)),
                                scan.ranges[beam] * std::sin(scan.angle(beam)), 0);
  const Eigen::Vector3d p_map = test::pose_at(t) * (test::robot().laser->T_base_laser * p_laser);
  return (p_map.head<2>() - Eigen::Vector2d(3, 2)).norm();
}

TEST_F(TickTest, ScansWithAnglesAndTimesOfTheirOwnComeOutAsTheyCame) {
  start(test::configuration({agent("barrel_1", AgentKind::barrel, 3.0, 2.0)}));
  const auto log = mbot_drive(6);
  feed(log);
  const std::vector<Scan> real = scans_in(log);
  const auto out = decoded<Scan>(channel::kMrScan);
  const auto info = decoded<ScanInfo>(channel::kMrScanInfo);
  ASSERT_EQ(out.size(), real.size());
  ASSERT_EQ(info.size(), real.size());
  std::size_t replaced = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    EXPECT_EQ(type_name(out_[channel::kMrScan][i]), "lidar_t");
    EXPECT_EQ(out[i].angles, real[i].angles);
    EXPECT_EQ(out[i].times, real[i].times);
    for (std::size_t beam = 0; beam < real[i].ranges.size(); ++beam) {
      if (info[i].beam_agent[beam] < 0) {
        ASSERT_EQ(std::memcmp(&out[i].ranges[beam], &real[i].ranges[beam], sizeof(float)), 0);
        ASSERT_EQ(out[i].intensities[beam], real[i].intensities[beam]);
        continue;
      }
      ++replaced;
      // Its radius is 0.2 m; range noise is 5 mm, a range's step 10 mm. At a wrong angle it would be 0.1 m
      // off.
      ASSERT_LT(std::abs(off_axis(out[i], beam)), 0.2 + 0.025) << "scan " << i << " beam " << beam;
    }
  }
  EXPECT_GT(replaced, 100U);
}

TEST_F(TickTest, AScanOfWhichAnArrayIsTooShortIsReportedAndNotForwarded) {
  start(test::configuration({}));
  std::mt19937 random(7);
  Message cut = test::message(channel::kScan, test::kStartUs + 100, uneven_scan_at(0, random));
  cut.payload.resize(cut.payload.size() - sizeof(float));
  feed(cut);
  EXPECT_TRUE(out_[channel::kMrScan].empty());
  const auto info = decoded<ScanInfo>(channel::kMrScanInfo);
  ASSERT_EQ(info.size(), 1U);
  EXPECT_NE(info[0].reason.find("lidar_t"), std::string::npos) << info[0].reason;
}

TEST_F(TickTest, ARobotOfMotorCommandsGetsThemAndNoSidewaysMotion) {
  Configuration configuration = test::configuration({});
  configuration.robot.command_type = CommandType::mbot_motor;
  start(std::move(configuration));
  feed(test::drive(1));
  const std::int64_t now = test::kStartUs + 1'000'000;
  feed(test::message(channel::kTeleop, now, TwistCommand{SensorTime::from_utime(now), {0.2, 0.1, 0.3}}));
  advance_to(ArrivalTime::from_utime(now + 1'500'000));  // silence: a stop
  const auto& payloads = out_[channel::kMrCmd];
  ASSERT_GE(payloads.size(), 2U);
  for (const auto& payload : payloads) EXPECT_EQ(type_name(payload), "mbot_motor_command_t");
  const auto commands = decoded<TwistCommand>(channel::kMrCmd);
  EXPECT_FLOAT_EQ(static_cast<float>(commands.front().twist.vx), 0.2F);
  EXPECT_FLOAT_EQ(static_cast<float>(commands.front().twist.wz), 0.3F);
  EXPECT_EQ(commands.back().twist.vx, 0);
  EXPECT_EQ(commands.back().twist.wz, 0);
}

TEST_F(TickTest, AMotorCommandOnTeleopDrivesAnyRobot) {
  start(test::configuration({}));
  feed(test::drive(1));
  const std::int64_t now = test::kStartUs + 1'000'000;
  const TwistCommand asked{SensorTime::from_utime(now), {0.2, 0, -0.3}, CommandType::mbot_motor};
  feed(test::message(channel::kTeleop, now, asked));
  const auto commands = decoded<TwistCommand>(channel::kMrCmd);
  ASSERT_FALSE(commands.empty());
  EXPECT_EQ(commands.back().type, CommandType::twist);
  EXPECT_FLOAT_EQ(static_cast<float>(commands.back().twist.vx), 0.2F);
  EXPECT_FLOAT_EQ(static_cast<float>(commands.back().twist.wz), -0.3F);
}

}  // namespace
}  // namespace parhelion::tick
