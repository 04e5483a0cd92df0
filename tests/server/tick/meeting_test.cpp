// The other arrangement of level 3: the real robot drives autonomously on MR_SCAN, and the trainee drives a
// virtual one. A simulated robot in place of the real one stops for obstacles or drives around them; a
// hundred meetings end at its goal without contact.
#include <cstdio>
#include <random>

#include "tests/long_run.hpp"
#include "tests/server/tick/autonomous_robot.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

using test::TickTest;

constexpr double kOdometryPeriod = 0.05;  // s of odometry; each second one comes with a scan
constexpr double kReached = 0.3;          // m
constexpr double kPatience = 40;          // s
const Eigen::Vector2d kGoal(3.2, 0);
// Sanitizers slow each meeting down ten times.
#if defined(PARHELION_ADDRESS_SANITIZER) || defined(PARHELION_THREAD_SANITIZER)
constexpr unsigned kMeetings = 8;
#else
constexpr unsigned kMeetings = 100;
#endif
constexpr unsigned kLongMeetings = 1000;

enum class MeetingKind { parked, crosses, ahead, head_on };
constexpr const char* kNames[] = {"parked", "crosses", "ahead", "head on"};

/// Initial conditions of a meeting: a virtual robot on the path of a real one that drives along x from (-3.5,
/// 0).
struct Meeting {
  MeetingKind kind = MeetingKind::parked;
  double speed = 0.5;       ///< m/s, desired speed of the robot
  double trainee = 0;       ///< m/s
  Transform<Map, Base> at;  ///< start of the virtual robot
};

Meeting meeting(unsigned n) {
  std::minstd_rand random(n + 1);
  random.discard(10);
  const auto within = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() - 1) / (random.max() - 1);
  };
  Meeting one;
  one.kind = static_cast<MeetingKind>(n % 4);
  one.speed = within(0.4, 0.7);
  const double side = n % 8 < 4 ? 1 : -1;
  switch (one.kind) {
    case MeetingKind::parked:
      one.at = Transform<Map, Base>::planar(within(-1.5, 0.5), within(-0.4, 0.4), within(-3, 3));
      break;
    case MeetingKind::crosses: {
      one.trainee = within(0.5, 0.8);
      const double x = -3.5 + one.speed * (2.5 / one.trainee + within(0.2, 1.0));
      one.at = Transform<Map, Base>::planar(x, 2.5 * side, -side * std::numbers::pi / 2);
      break;
    }
    case MeetingKind::ahead:
      one.trainee = within(0.05, 0.2);
      one.at = Transform<Map, Base>::planar(-2, within(-0.3, 0.3), 0);
      break;
    case MeetingKind::head_on:
      one.trainee = within(0.2, 0.5);
      one.at = Transform<Map, Base>::planar(within(0, 1), within(-0.3, 0.3), std::numbers::pi);
      break;
  }
  return one;
}

class Meetings : public TickTest {
 protected:
  struct Outcome {
    bool touched = false, arrived = false;
    double closest = 10, took = 0;  ///< m, s
  };

  /// `sees`: it uses MR_SCAN; else its own SCAN, without virtual agents.
  Outcome hold(const Meeting& one, bool sees) {
    AgentDefinition robot = test::agent("robot_1", AgentKind::robot, 0, 0, BehaviourKind::teleop);
    robot.T_map_base = one.at;
    start(test::configuration({robot}));
    out_.clear();
    test::AutonomousRobot driver(configuration_.robot,
                                 *simulation::Simulation::prepare_building(configuration_.model), kGoal,
                                 one.speed);
    Outcome outcome;
    Pose2 pose{-3.5, 0, 0};
    Twist2 twist, wanted;
    for (int i = 0; i * kOdometryPeriod < kPatience && !outcome.arrived; ++i) {
      const std::int64_t utime = test::kStartUs + static_cast<std::int64_t>(i * kOdometryPeriod * 1e6);
      const auto T_map_base = Transform<Map, Base>::planar(pose.x, pose.y, pose.yaw);
      feed(test::message(channel::kOdometry, utime + 2000,
                         Odometry{SensorTime::from_utime(utime), T_map_base.as<Odom, Base>()}));
      if (i % 2 == 0) {
        const Scan real = scan_from(T_map_base, utime);
        feed(test::message(channel::kScan, utime + 5000, real));
        wanted = driver.drive(pose, twist, sees ? newest_scan() : real);
        give_pose(T_map_base, utime);
        drive_virtual(one, pose, utime);
      }
      const double max_change = test::AutonomousRobot::kAcceleration * kOdometryPeriod;
      twist.vx += std::clamp(wanted.vx - twist.vx, -max_change, max_change);
      twist.wz += std::clamp(wanted.wz - twist.wz, -3 * kOdometryPeriod, 3 * kOdometryPeriod);
      pose = simulation::advance(pose, twist, kOdometryPeriod);
      outcome.arrived = (kGoal - pose.position()).norm() < kReached;
      outcome.closest = std::min(outcome.closest, state_->simulation.clearance(T_map_base, {}, 10).distance);
      outcome.took = i * kOdometryPeriod;
    }
    for (const Event& event : decoded<Event>(channel::kMrEvents)) {
      const bool both = event.subject == "synthetic" && event.object == "robot_1";
      outcome.touched = outcome.touched || (event.kind == EventKind::contact_started && both);
    }
    return outcome;
  }

 private:
  Scan scan_from(const Transform<Map, Base>& T_map_base, std::int64_t utime) const {
    return test::exact_scan(*configuration_.robot.laser, T_map_base, configuration_.model,
                            SensorTime::from_utime(utime));
  }

  Scan newest_scan() {
    Scan scan;
    const Status read = decode(channel::kMrScan, out_[channel::kMrScan].back(), scan);
    EXPECT_TRUE(read.ok());
    return scan;
  }

  void give_pose(const Transform<Map, Base>& T_map_base, std::int64_t utime) {
    PoseEstimate estimate;
    estimate.stamp = SensorTime::from_utime(utime);
    estimate.T_map_base = T_map_base;
    estimate.covariance = PoseCovariance::Identity() * 1e-4;
    estimate.covariance(5, 5) = 1e-6;
    estimate.map_id = "synthetic";
    estimate.state = SlamState::tracking;
    feed(test::message(channel::kPoseCov, utime + 25000, estimate));
  }

  /// The trainee drives on until the other robot is directly in front.
  void drive_virtual(const Meeting& one, const Pose2& autonomous_robot, std::int64_t utime) {
    WorldSnapshot world;
    ASSERT_TRUE(state_->simulation.at(state_->simulation.now(), world));
    Transform<Map, Body> T_map_own;
    for_each_body(world, [&](const BodyDefinition& definition, const BodyState& body) {
      if (definition.entity == "robot_1" && T_map_own.translation().isZero()) T_map_own = body.T_map_body;
    });
    const Eigen::Vector3d other =
        T_map_own.isometry().inverse() *
        Eigen::Vector3d(autonomous_robot.x, autonomous_robot.y, T_map_own.translation().z());
    const bool before = other.x() > 0 && other.x() < 1.3 && std::abs(other.y()) < 0.7;
    feed(test::message("MR_AGENT_robot_1_TELEOP", utime + 27000,
                       TwistCommand{SensorTime::from_utime(utime), {before ? 0 : one.trainee, 0, 0}}));
  }
};

TEST_F(Meetings, AvoidingRobotsReachTheirGoalsWithoutContact) {
  const unsigned meetings = test::long_run() ? kLongMeetings : kMeetings;
  unsigned met = 0;
  double closest[4] = {10, 10, 10, 10}, longest = 0;
  for (unsigned n = 0; n < meetings; ++n) {
    const Meeting one = meeting(n);
    const Outcome outcome = hold(one, true);
    const auto kind = static_cast<std::size_t>(one.kind);
    EXPECT_FALSE(outcome.touched) << n << ", " << kNames[kind];
    EXPECT_GT(outcome.closest, 0.02) << n << ", " << kNames[kind];
    EXPECT_TRUE(outcome.arrived) << n << ", " << kNames[kind];
    met += outcome.closest < 1.0;
    closest[kind] = std::min(closest[kind], outcome.closest);
    longest = std::max(longest, outcome.took);
  }
  std::printf(
      "%u meetings, %u nearer than 1 m, the longest %.0f s; nearest: parked %.2f, crosses %.2f, ahead %.2f, "
      "head on %.2f m\n",
      meetings, met, longest, closest[0], closest[1], closest[2], closest[3]);
  EXPECT_GE(met, meetings * 8 / 10);
}

TEST_F(Meetings, ARobotUsingItsRawScanHitsVirtualRobots) {
  int touched = 0;
  for (unsigned n = 0; n < 8; ++n) touched += hold(meeting(n), false).touched;
  EXPECT_GE(touched, 4);
}

}  // namespace
}  // namespace parhelion::tick
