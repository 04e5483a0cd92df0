// Promise 3: MR_CMD = s * TELEOP with one 0 <= s <= 1. These tests try to break it.
#include "server/simulation/virtual_contact.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

namespace parhelion::simulation {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

RobotDescription contact_robot() {
  RobotDescription description;
  description.footprint = {{-0.3, -0.25}, {0.3, -0.25}, {0.3, 0.25}, {-0.3, 0.25}};
  description.limits.speed = description.limits.yaw_rate = 5;  // above what any_input() asks
  return description;
}

/// From -range to range, including zero and both ends.
double any(double range) {
  return range * *rc::gen::element(-1.0, 0.0, 1.0) * *rc::gen::inRange(0, 1001) / 1000.0;
}

VirtualContactInput any_input() {
  VirtualContactInput input;
  if (*rc::gen::inRange(0, 10) > 0) input.teleop = TwistCommand{{5}, {any(3), any(3), any(4)}};
  input.teleop_age = milliseconds(*rc::gen::inRange(0, 1000));
  input.pose_known = *rc::gen::inRange(0, 3) > 0;
  input.clearance.distance = *rc::gen::inRange(-200, 4000) / 1000.0;
  return input;
}

VirtualContactInput pressed(Twist2 twist, bool pose_known, double clearance = 100) {
  VirtualContactInput input;
  input.teleop = TwistCommand{{5}, twist};
  input.pose_known = pose_known;
  input.clearance.distance = clearance;
  return input;
}

RC_GTEST_PROP(VirtualContact, CommandsAreOnlyReducedAndKeepTheirCurvature, ()) {
  const ContactLimits limits;
  VirtualContactState state;
  for (int i = 0; i < 20; ++i) {
    const VirtualContactInput input = any_input();
    const VirtualContactResult out = limit(limits, contact_robot(), input, state);
    RC_ASSERT(out.scale >= 0 && out.scale <= 1);
    const Twist2 asked = input.teleop ? input.teleop->twist : Twist2{};
    const double pairs[3][2] = {
        {asked.vx, out.command.twist.vx}, {asked.vy, out.command.twist.vy}, {asked.wz, out.command.twist.wz}};
    for (const auto& [before, after] : pairs) {
      RC_ASSERT(std::abs(after) <= std::abs(before));
      RC_ASSERT(after == 0 || std::signbit(after) == std::signbit(before));
      RC_ASSERT(std::abs(after - out.scale * before) <= 1e-15 * std::abs(before));
    }
    if (out.reason == SpeedLimitReason::none) {
      RC_ASSERT(asked.vx == out.command.twist.vx && asked.vy == out.command.twist.vy &&
                asked.wz == out.command.twist.wz);
    }
    if (!input.teleop || input.teleop_age.seconds() >= limits.silence) RC_ASSERT(out.scale == 0);
  }
}

RC_GTEST_PROP(VirtualContact, TheRobotCanAlwaysBrakeBeforeTheStopDistance, ()) {
  const ContactLimits limits;
  RobotDescription machine = contact_robot();
  machine.limits.deceleration = *rc::gen::inRange(1, 50) / 10.0;
  machine.limits.reaction_time = *rc::gen::inRange(0, 10) / 10.0;
  VirtualContactState state;
  const double distance = *rc::gen::inRange(0, 3000) / 1000.0;
  const VirtualContactInput input = pressed({any(3), any(3), any(4)}, true, distance);
  const double v = footprint_speed(machine, limit(limits, machine, input, state).command.twist);
  const double braking_distance =
      v * machine.limits.reaction_time + v * v / (2 * machine.limits.deceleration);
  RC_ASSERT(braking_distance <= std::max(0.0, distance - limits.stop_distance) + 1e-9);
}

RC_GTEST_PROP(VirtualContact, CommandsNeverExceedTheRobotsLimits, ()) {
  RobotDescription machine = contact_robot();
  machine.limits.speed = *rc::gen::inRange(0, 20) / 10.0;
  machine.limits.yaw_rate = *rc::gen::inRange(0, 20) / 10.0;
  VirtualContactState state;
  const double range = *rc::gen::element(0.5, 3.0, 1e6, 1e150);
  VirtualContactInput input =
      pressed({any(range), any(range), any(range)}, true, *rc::gen::inRange(0, 4000) / 1000.0);
  if (*rc::gen::arbitrary<bool>()) {  // pose lost and the stick let go: the robot may crawl
    limit({}, machine, pressed({}, false), state);
    input.pose_known = false;
  }
  const VirtualContactResult out = limit({}, machine, input, state);
  const Twist2 &asked = input.teleop->twist, &given = out.command.twist;
  RC_ASSERT(std::hypot(given.vx, given.vy) <= machine.limits.speed);
  RC_ASSERT(std::abs(given.wz) <= machine.limits.yaw_rate);
  RC_ASSERT(std::abs(given.vx - out.scale * asked.vx) <= 1e-15 * std::abs(asked.vx));
  RC_ASSERT(std::abs(given.wz - out.scale * asked.wz) <= 1e-15 * std::abs(asked.wz));
}

TEST(VirtualContact, AMillionMetresASecondBecomesTheRobotsSpeed) {
  VirtualContactState state;
  const VirtualContactResult out = limit({}, contact_robot(), pressed({1e6, 0, 1e5}, true, 100), state);
  EXPECT_EQ(out.reason, SpeedLimitReason::robot_limits);
  EXPECT_NEAR(out.command.twist.vx, 5, 1e-9);
  EXPECT_NEAR(out.command.twist.wz, 0.5, 1e-9) << "on the same arc";
}

RC_GTEST_PROP(VirtualContact, SpeedScaleNeverGrowsNearerToAnObstacle, ()) {
  const double speed = *rc::gen::inRange(0, 3000) / 1000.0;
  const double far = *rc::gen::inRange(0, 3000) / 1000.0, near = far * *rc::gen::inRange(0, 1000) / 1000.0;
  RC_ASSERT(contact_scale({}, {}, near, speed) <= contact_scale({}, {}, far, speed));
}

RC_GTEST_PROP(VirtualContact, CommandsAreUnchangedBeyondTheLookahead, ()) {
  const Twist2 twist{any(3), any(3), any(4)};
  VirtualContactState state;
  const double distance = contact_lookahead({}, contact_robot(), twist);
  RC_ASSERT(limit({}, contact_robot(), pressed(twist, true, distance), state).scale == 1);
}

RC_GTEST_PROP(VirtualContact, WithoutAPoseTheRobotStopsAndCrawlsAfterRelease, ()) {
  const Twist2 twist{any(3), any(3), any(4)};
  RC_PRE(footprint_speed(contact_robot(), twist) > 0);
  VirtualContactState state;
  limit({}, contact_robot(), pressed(twist, true), state);
  RC_ASSERT(limit({}, contact_robot(), pressed(twist, false), state).scale == 0);
  RC_ASSERT(limit({}, contact_robot(), pressed(twist, false), state).reason ==
            SpeedLimitReason::localization_lost);
  RC_ASSERT(limit({}, contact_robot(), pressed({}, false), state).scale <= 1);  // released
  // Virtual contact must not trap it where SLAM cannot recover.
  const VirtualContactResult out = limit({}, contact_robot(), pressed(twist, false, 0), state);
  RC_ASSERT(out.reason == SpeedLimitReason::crawl);
  RC_ASSERT(out.scale > 0);
  RC_ASSERT(footprint_speed(contact_robot(), out.command.twist) <= ContactLimits{}.crawl_speed * (1 + 1e-12));
  // Lost again: stop again.
  limit({}, contact_robot(), pressed(twist, true), state);
  RC_ASSERT(limit({}, contact_robot(), pressed(twist, false), state).scale == 0);
}

TEST(VirtualContact, ATimeoutCountsAsStickRelease) {
  VirtualContactState state;
  limit({}, contact_robot(), pressed({1, 0, 0}, true), state);
  EXPECT_EQ(limit({}, contact_robot(), pressed({1, 0, 0}, false), state).scale, 0);
  VirtualContactInput silent = pressed({1, 0, 0}, false);
  silent.teleop_age = milliseconds(500);
  EXPECT_EQ(limit({}, contact_robot(), silent, state).reason, SpeedLimitReason::silence);
  EXPECT_EQ(limit({}, contact_robot(), pressed({1, 0, 0}, false), state).reason, SpeedLimitReason::crawl);
}

TEST(VirtualContact, HoldingTheStickWithoutAPoseNeverStartsCrawling) {
  VirtualContactState state;
  limit({}, contact_robot(), pressed({1, 0, 0}, true), state);
  for (int i = 0; i < 1000; ++i)
    EXPECT_EQ(limit({}, contact_robot(), pressed({1, 0, 0}, false), state).scale, 0);
}

TEST(VirtualContact, AnEmergencyStopHoldsUntilResetAndStickRelease) {
  VirtualContactState state;
  VirtualContactInput input = pressed({0.5, 0, 0.1}, true);
  input.emergency_stop = true;
  EXPECT_EQ(limit({}, contact_robot(), input, state).reason, SpeedLimitReason::emergency_stop);
  EXPECT_EQ(limit({}, contact_robot(), pressed({0, 0, 0}, true), state).scale, 1) << "let go";
  limit({}, contact_robot(), input, state);
  const auto held = limit({}, contact_robot(), pressed({0.5, 0, 0.1}, true), state);
  EXPECT_EQ(held.reason, SpeedLimitReason::emergency_stop) << "taken back, and the stick still pushed";
  EXPECT_EQ(held.command.twist.vx, 0);
  EXPECT_EQ(held.command.twist.wz, 0);
  limit({}, contact_robot(), pressed({0, 0, 0}, true), state);
  EXPECT_EQ(limit({}, contact_robot(), pressed({0.5, 0, 0.1}, true), state).reason, SpeedLimitReason::none);
}

TEST(VirtualContact, AStopOfTheServerHoldsUntilItsCauseIsOverAndTheStickWasReleased) {
  for (const SpeedLimitReason cause : {SpeedLimitReason::scans_silent, SpeedLimitReason::two_drivers}) {
    VirtualContactState state;
    VirtualContactInput input = pressed({0.5, 0, 0.1}, true);
    input.stop = cause;
    EXPECT_EQ(limit({}, contact_robot(), input, state).reason, cause);
    VirtualContactInput zero = pressed({}, true);
    zero.stop = cause;
    limit({}, contact_robot(), zero, state);
    EXPECT_EQ(limit({}, contact_robot(), pressed({0.5, 0, 0.1}, true), state).reason,
              SpeedLimitReason::not_released)
        << "released while the cause lasted";
    EXPECT_EQ(limit({}, contact_robot(), pressed({0.5, 0, 0.1}, true), state).scale, 0);
    VirtualContactInput own = pressed({}, true);
    own.own_stop = true;
    limit({}, contact_robot(), own, state);
    EXPECT_EQ(limit({}, contact_robot(), pressed({0.5, 0, 0.1}, true), state).scale, 0)
        << "not the trainee's";
    limit({}, contact_robot(), pressed({}, true), state);
    EXPECT_EQ(limit({}, contact_robot(), pressed({0.5, 0, 0.1}, true), state).reason, SpeedLimitReason::none);
  }
}

TEST(VirtualContact, AfterALossThePoseAloneMovesNothing) {
  VirtualContactState state;
  VirtualContactInput lost = pressed({1, 0, 0}, false);
  lost.localization_lost = true;
  EXPECT_EQ(limit({}, contact_robot(), lost, state).reason, SpeedLimitReason::localization_lost);
  EXPECT_EQ(limit({}, contact_robot(), pressed({1, 0, 0}, true), state).reason,
            SpeedLimitReason::not_released);
  limit({}, contact_robot(), pressed({}, true), state);
  EXPECT_GT(limit({}, contact_robot(), pressed({1, 0, 0}, true), state).scale, 0);
  // Who let go during the loss has let go.
  limit({}, contact_robot(), lost, state);
  VirtualContactInput zero = pressed({}, false);
  zero.localization_lost = true;
  limit({}, contact_robot(), zero, state);
  EXPECT_EQ(limit({}, contact_robot(), lost, state).reason, SpeedLimitReason::crawl);
  EXPECT_GT(limit({}, contact_robot(), pressed({1, 0, 0}, true), state).scale, 0);
}

TEST(VirtualContact, ANonFiniteTeleopCommandStopsTheRobot) {
  for (const Twist2& twist :
       {Twist2{kNan, 0, 0}, Twist2{0, kNan, 0}, Twist2{0, 0, kNan}, Twist2{kInfinity, 0, 0},
        Twist2{1, 0, -kInfinity}, Twist2{1e308, 1e308, 1e308}}) {
    for (const bool pose_known : {true, false}) {
      VirtualContactState state{true};
      const VirtualContactResult out = limit({}, contact_robot(), pressed(twist, pose_known), state);
      EXPECT_EQ(out.command.twist.vx, 0);
      EXPECT_EQ(out.command.twist.vy, 0);
      EXPECT_EQ(out.command.twist.wz, 0);
    }
  }
}

TEST(VirtualContact, ANaNClearanceStopsTheRobot) {
  VirtualContactState state;
  EXPECT_EQ(limit({}, contact_robot(), pressed({1, 0, 0}, true, kNan), state).scale, 0);
}

}  // namespace
}  // namespace parhelion::simulation
