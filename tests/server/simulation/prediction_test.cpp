// Warnings come at the time given by geometry, and only then.
#include "server/simulation/bodies/prediction.hpp"

#include "robots_world.hpp"
// After gtest.
#include <rapidcheck/gtest.h>

namespace parhelion::simulation {
namespace {

using namespace test;

/// The slow reference: checks every millisecond.
double first_contact(const MovingFootprint& a, const MovingFootprint& b, double touch, double horizon) {
  Footprint placed_a, placed_b;
  for (double t = 0; t <= horizon; t += 0.001) {
    place(*a.local, advance(a.pose, a.twist, t), placed_a);
    place(*b.local, advance(b.pose, b.twist, t), placed_b);
    if (signed_distance(placed_a, placed_b) > touch) continue;
    return t > 0 ? t : std::numeric_limits<double>::infinity();
  }
  return std::numeric_limits<double>::infinity();
}

RC_GTEST_PROP(TimeToContact, AgreesWithSamplingEveryMillisecond, ()) {
  const auto within = [](double low, double high) {
    return low + (high - low) * *rc::gen::inRange(0, 1001) / 1000.0;
  };
  const Footprint a = make_rectangle(within(0.2, 1), within(0.2, 1)), b = make_disc({0, 0}, within(0.1, 0.5));
  const MovingFootprint ma{&a, {0, 0, within(-3, 3)}, {within(-1, 1), within(-0.2, 0.2), within(-1.5, 1.5)}};
  const MovingFootprint mb{
      &b, {within(-3, 3), within(-3, 3), within(-3, 3)}, {within(-1, 1), 0, within(-1, 1)}};
  const double fast = time_to_contact(ma, mb, 0.01, 2.5), slow = first_contact(ma, mb, 0.01, 2.5);
  // A grazing contact may lie between two samples of either.
  const double grazes = time_to_contact(ma, mb, 0.02, 2.5);
  if (std::isfinite(slow)) {
    RC_ASSERT((fast <= slow + 0.006 || grazes <= slow));
    RC_ASSERT((!std::isfinite(fast) || fast >= slow - 0.002));
  } else if (std::isfinite(fast)) {
    RC_ASSERT(std::isfinite(first_contact(ma, mb, 0.015, 2.6)));
  }
}

TEST(CollisionPrediction, IsReportedOnceTwoSecondsBeforeAWall) {
  Simulation simulation = make(room(6));
  const auto events = follow(simulation, 2.7, [](double t) { return real_at(t, 0, 0, {1, 0, 0}); });
  const auto warned = only(events, EventKind::collision_predicted);
  ASSERT_EQ(warned.size(), 1U);
  EXPECT_EQ(warned[0].object, "wall 1");
  EXPECT_EQ(warned[0].pair, PairKind::real_real);
  // The front is 0.25 m ahead of base_link, the wall at 3 m.
  EXPECT_NEAR(since_start(warned[0]), 0.75, 1.001 * kStep + kMinAdvance);
  EXPECT_NEAR(warned[0].value, 2, 0.02);
  EXPECT_NEAR(warned[0].position.x(), 3, 1e-6);
}

TEST(CollisionPrediction, DrivingAlongOrAwayFromAWallPredictsNoCollision) {
  Simulation simulation = make(room(10));
  const auto events = follow(simulation, 3, [](double t) { return real_at(t - 2, 4.7, 0, {1, 0, 0}); });
  EXPECT_EQ(count(events, EventKind::collision_predicted), 0U);
  Simulation away = make(room(6));
  EXPECT_EQ(count(follow(away, 1,
                         [](double t) {
                           return real_at(2.74 - t, 0, 0, {-1, 0, 0});
                         }),
                  EventKind::collision_predicted),
            0U);
}

TEST(CollisionPrediction, IsRepeatedOnlyAfterTheDangerEnded) {
  Simulation simulation = make(room(6));
  // Towards the wall, with a warning after 0.25 s; back; and towards it again.
  const auto events = follow(simulation, 3.5, [](double t) {
    if (t < 1) return real_at(0.5 + t, 0, 0, {1, 0, 0});
    if (t < 2) return real_at(1.5 - (t - 1), 0, 0, {-1, 0, 0});
    return real_at(0.5 + (t - 2), 0, 0, {1, 0, 0});
  });
  EXPECT_EQ(count(only(events, EventKind::collision_predicted), EventKind::collision_predicted), 2U);
}

TEST(CollisionPrediction, DetectsAnApproachingAgentAtStandstill) {
  Simulation simulation = make({}, with_robots({"rover"}));
  spawn(simulation, articulated("r", "rover", 4, 0, std::numbers::pi));
  drive(simulation, "r", {0.5, 0, 0}, 9, real_at(0, 0));
  const auto events = simulation.take_events();
  const auto hit = only(events, EventKind::contact_started);
  ASSERT_FALSE(hit.empty());
  // Both are warned: the standing and the approaching one.
  for (const std::string who : {"pioneer", "r"}) {
    const auto warned = only(events, EventKind::collision_predicted);
    const auto its =
        std::find_if(warned.begin(), warned.end(), [&](const Event& e) { return e.subject == who; });
    ASSERT_NE(its, warned.end()) << who;
    EXPECT_EQ(its->pair, PairKind::real_virtual);
    EXPECT_NEAR((hit[0].stamp - its->stamp).seconds(), 2, 0.1) << who;
  }
}

TEST(Tipping, TimeIsTippingAngleOverAngularRate) {
  Stance stance;
  stance.support = {{-0.3, -0.2}, {0.3, -0.2}, {0.3, 0.2}, {-0.3, 0.2}};
  stance.center_of_mass = {0, 0, 0.4};
  const double level = std::atan2(0.2, 0.4), roll = 0.3, rate = 0.5;
  // A roll to the right: about +x the left side rises.
  const Eigen::Matrix3d R = Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const Tipping tipping = tipping_of(stance, R.row(2), {rate, 0, 0});
  EXPECT_NEAR(tipping.fraction, (level - roll) / level, 1e-9);
  EXPECT_NEAR(tipping.time, (level - roll) / rate, 1e-9);
  EXPECT_FALSE(std::isfinite(tipping_of(stance, R.row(2), {-rate, 0, 0}).time)) << "it comes back";
  EXPECT_NEAR(tipping_of(stance, {0, 0, 1}, {0, 0, 0}).fraction, 1, 1e-12);
  // Past its edge it tips immediately.
  const Eigen::Matrix3d over = Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitX()).toRotationMatrix();
  EXPECT_EQ(tipping_of(stance, over.row(2), {0, 0, 0}).time, 0);
}

TEST(Tipping, StabilityUsesWheelPositionsAndMass) {
  const Stance stance = stance_of(*shipped("rover"), {});
  const Footprint support = make_polygon(stance.support);
  // Both wheels' inner and outer rims and the caster's lowest point.
  for (const Eigen::Vector2d& p : {Eigen::Vector2d(0, 0.205), {0, -0.205}, {-0.199, 0}})
    EXPECT_LE(signed_distance(make_disc(p, 0), support), 1e-9) << p.transpose();
  EXPECT_GT(signed_distance(make_disc({0.05, 0}, 0), support), 0.04);
  EXPECT_NEAR(stance.center_of_mass.x(), -0.06 * 22 / 24.4, 1e-6);
  EXPECT_NEAR(stance.center_of_mass.z(), (22 * 0.15 + 2.4 * 0.0975) / 24.4, 0.001);
}

TEST(TippingPrediction, WarnsARealRobotOneSecondBeforeItsLimit) {
  RobotDescription description = robot();
  description.attitude = AttitudeLimits{};  // 0.6 rad of pitch
  auto simulation = Simulation::create({}, {}, description, kStart);
  ASSERT_TRUE(simulation.ok());
  const auto events = follow(*simulation, 2.5, [](double t) {
    RealRobotState state = real_at(0, 0);
    state.T_map_base = Transform<Map, Base>(
        Eigen::Quaterniond(Eigen::AngleAxisd(0.3 * t, Eigen::Vector3d::UnitY())), {0, 0, 0});
    state.attitude_known = true;
    return state;
  });
  const auto warned = only(events, EventKind::tipping_predicted);
  ASSERT_EQ(warned.size(), 1U);
  const auto limit = only(events, EventKind::pitch_limit);
  ASSERT_EQ(limit.size(), 1U);
  EXPECT_NEAR((limit[0].stamp - warned[0].stamp).seconds(), 1, 2.001 * kStep);
}

TEST(TippingPrediction, WarnsBeforeARobotTipsOverAnEdge) {
  SemanticModel model = floor_of(20);
  model.entities.push_back(model_box("table", EntityLabel::floor, {0, 0, 0.4}, {2, 2, 0.8}));
  Simulation simulation = make(model, with_robots({"rover"}));
  AgentDefinition rover = articulated("r", "rover", 0, 0);
  rover.T_map_base = Transform<Map, Base>::planar(0, 0, 0, 0.8);
  spawn(simulation, rover);
  drive(simulation, "r", {0.4, 0, 0}, 6);
  const auto events = simulation.take_events();
  const auto warned = only(events, EventKind::tipping_predicted);
  const auto tipped = only(events, EventKind::tipped_over);
  ASSERT_FALSE(warned.empty());
  ASSERT_FALSE(tipped.empty());
  EXPECT_LT(warned[0].stamp, tipped[0].stamp);
}

TEST(TippingPrediction, DrivingOnLevelFloorPredictsNoTipping) {
  Simulation simulation = make(floor_of(20), with_robots({"rover"}));
  spawn(simulation, articulated("r", "rover", 0, 0));
  for (const Twist2& twist : {Twist2{0.8, 0, 0}, Twist2{-0.8, 0, 0}, Twist2{0.5, 0, 2}, Twist2{0, 0, -2}})
    drive(simulation, "r", twist, 1);
  EXPECT_EQ(count(simulation.take_events(), EventKind::tipping_predicted), 0U);
}

}  // namespace
}  // namespace parhelion::simulation
