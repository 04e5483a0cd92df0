// In which order a laser measures the beams of a message: found from scans of turns, and put right by SLAM.
#include "fusion/pose/matching/beam_order.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "fusion/pose/odometry/scan_odometry.hpp"
#include "fusion/pose/slam.hpp"
#include "tests/fusion/pose/swept_drive.hpp"

namespace parhelion::pose {
namespace {

using test::SweptDrive;
using Verdict = BeamOrder::Verdict;

constexpr double kInterval = 0.09 / 361;  // s between two beams: a laser that turns ten times a second

BeamOrder beam_order_of(const SweptDrive& drive) {
  BeamOrder order(*drive.robot.laser);
  ScanOdometry odometry;
  for (const test::DriveInput& input : drive.inputs) {
    if (!input.scan) {
      odometry.add(input.odometry);
    } else if (const auto step = odometry.step_to(*input.scan, *drive.robot.laser)) {
      order.add(*input.scan, step->step);
    }
  }
  return order;
}

Verdict order_in(const SweptDrive& drive) { return beam_order_of(drive).verdict(); }

TEST(BeamOrder, IsFoundWhereADriverReversesTheBeams) {
  for (const std::uint32_t seed : {21U, 22U, 23U}) {
    EXPECT_EQ(order_in(test::swept_drive(seed, kInterval, -kInterval)), Verdict::reversed) << seed;
    EXPECT_EQ(order_in(test::swept_drive(seed, -kInterval, kInterval)), Verdict::reversed) << seed;
    EXPECT_EQ(order_in(test::swept_drive(seed, kInterval, kInterval)), Verdict::as_described) << seed;
    EXPECT_EQ(order_in(test::swept_drive(seed, -kInterval, -kInterval)), Verdict::as_described) << seed;
  }
}

TEST(BeamOrder, IsFoundWithOdometryWhoseClockIsOff) {
  for (const double late : {-0.15, 0.15}) {
    EXPECT_EQ(order_in(test::swept_drive(24, kInterval, -kInterval, late)), Verdict::reversed) << late;
    EXPECT_EQ(order_in(test::swept_drive(24, kInterval, kInterval, late)), Verdict::as_described) << late;
  }
}

TEST(BeamOrder, IsLeftOpenWhereNothingShowsIt) {
  constexpr double brief = 0.02 / 361;
  EXPECT_EQ(order_in(test::swept_drive(25, brief, -brief)), Verdict::unknown) << "a short sweep";
  SweptDrive undescribed = test::swept_drive(25, 0, kInterval);
  undescribed.robot.laser->scan_period = 0;
  EXPECT_EQ(order_in(undescribed), Verdict::unknown) << "how long a turn takes is not described";
}

TEST(BeamOrder, IsFoundWhereAllBeamsAreMeasuredAtOnce) {
  EXPECT_EQ(order_in(test::swept_drive(26, kInterval, 0)), Verdict::at_once);
  EXPECT_EQ(order_in(test::swept_drive(26, -kInterval, 0)), Verdict::at_once);
}

TEST(BeamOrder, OfALaserThatTurnsOnceAScanIsFoundWithoutADescriptionOfItsTimes) {
  for (const double real : {kInterval, -kInterval, 0.0}) {
    SweptDrive drive = test::swept_drive(32, 0, real);
    drive.robot.laser->scan_period = kInterval * 2 * std::numbers::pi / drive.robot.laser->angle_increment;
    EXPECT_EQ(order_in(drive), real == 0 ? Verdict::as_described : Verdict::swept) << real;
    const BeamOrder order = beam_order_of(drive);
    EXPECT_NEAR(order.beam_interval(), real, 1e-9);
    LaserDescription corrected = *drive.robot.laser;
    order.correct(corrected);
    EXPECT_EQ(corrected.beam_interval, order.beam_interval());
  }
}

TEST(BeamOrder, IsNotDoubtedForReversedOdometryOrALaserUpsideDown) {
  SweptDrive odometry_wrong = test::swept_drive(27, kInterval, kInterval);
  for (test::DriveInput& input : odometry_wrong.inputs) {
    const Pose2 pose = planar(input.odometry.T_odom_base);
    input.odometry.T_odom_base = transform<Odom, Base>(Pose2{pose.x, -pose.y, -pose.yaw});
  }
  EXPECT_NE(order_in(odometry_wrong), Verdict::reversed);
  SweptDrive upside_down = test::swept_drive(28, kInterval, kInterval);
  for (test::DriveInput& input : upside_down.inputs) {
    if (!input.scan) continue;
    input.scan->angle_min = -input.scan->angle_min;
    input.scan->angle_increment = -input.scan->angle_increment;
  }
  EXPECT_NE(order_in(upside_down), Verdict::reversed);
}

TEST(BeamOrder, IsNotMistakenInDamagedScans) {
  SweptDrive drive = test::swept_drive(30, kInterval, -kInterval);
  drive.robot.laser->convention.range_max = std::numeric_limits<float>::max();
  std::mt19937 random(30);
  std::uniform_real_distribution<float> exponent(2, 38);
  for (test::DriveInput& input : drive.inputs) {
    if (!input.scan) continue;
    for (float& range : input.scan->ranges) {
      if (random() % 3 != 0) range = std::pow(10.0F, exponent(random));
    }
  }
  EXPECT_NE(order_in(drive), Verdict::as_described);
}

struct CausalMap {
  std::vector<double> turned_wrong;  ///< rad, of each causal pose
  std::vector<OdometryFinding> findings;
};

CausalMap causal_map(const SweptDrive& drive) {
  CausalMap result;
  auto slam = make_mapper(drive.robot, {});
  EXPECT_TRUE(slam.ok());
  if (!slam) return result;
  std::size_t scan = 0;
  std::optional<double> first;
  for (const test::DriveInput& input : drive.inputs) {
    if (!input.scan) {
      (*slam)->add(input.odometry);
      continue;
    }
    const Pose2& truth = drive.truth[scan++];
    const auto estimate = (*slam)->add(*input.scan);
    if (!estimate) continue;
    const double off = wrap_angle(planar(estimate->T_map_base).yaw - truth.yaw);
    if (!first) first = off;
    result.turned_wrong.push_back(std::abs(wrap_angle(off - *first)));
  }
  result.findings = (*slam)->odometry_findings();
  return result;
}

TEST(BeamOrder, IsPutRightWhileAMapIsMade) {
  const CausalMap right = causal_map(test::swept_drive(29, -kInterval, -kInterval));
  const CausalMap wrong = causal_map(test::swept_drive(29, kInterval, -kInterval));
  EXPECT_TRUE(right.findings.empty());
  ASSERT_EQ(wrong.findings.size(), 1U);
  EXPECT_EQ(wrong.findings[0].fault, OdometryFault::beam_order);
  EXPECT_THAT(wrong.findings[0].text, testing::HasSubstr("in the reverse of the described order"));
  const auto worst = [](const CausalMap& m) {
    return *std::max_element(m.turned_wrong.begin() + static_cast<long>(m.turned_wrong.size() / 2),
                             m.turned_wrong.end());
  };
  EXPECT_LT(worst(wrong), worst(right) + 0.02);
}

}  // namespace
}  // namespace parhelion::pose
