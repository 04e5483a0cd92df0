// The tracked robot on stairs, as with an operator: flippers on the first step, then pressed down on its
// tread, then in line with the tracks.
#include "robots_world.hpp"
#include "tests/degree.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

using test::kDegree;
constexpr double kRise = 0.17;
constexpr int kSteps = 7;

SimulationOptions with_friction(double friction) {
  RobotModel model = *shipped("crawler");
  model.drive.friction = friction;
  SimulationOptions options;
  options.robot_models.push_back(std::make_shared<const RobotModel>(model));
  return options;
}

double pitch_up(const Simulation& simulation) {
  return std::asin(motion(simulation, "r").T_map_base.rotation()(2, 0));
}

Eigen::Vector3d place(const Simulation& simulation) {
  return motion(simulation, "r").T_map_base.translation();
}

class Operator {
 public:
  explicit Operator(Simulation& simulation) : simulation_(simulation) {}
  /// Climbs the flight until base_link is at `x`, for at most `duration` s.
  void climb(double x, double duration) {
    for (double t = 0; t < duration && place(simulation_).x() < x; t += 0.125) {
      const double pitch = pitch_up(simulation_);
      if (phase_ == 0 && pitch > 6 * kDegree) phase_ = 1;
      if (phase_ == 1 && pitch > 22 * kDegree) phase_ = 2;
      flippers(std::array{35, -20, -6}[phase_] * kDegree);
      drive(simulation_, "r", {0.3, 0, 0}, 0.125);
    }
  }
  void flippers(double angle) {
    Joints joints;
    joints.names = {"left_flipper_joint", "right_flipper_joint"};
    joints.positions = {angle, angle};
    const Status status = simulation_.joint_command("r", joints);
    ASSERT_TRUE(status.ok()) << status.error().message;
  }

 private:
  Simulation& simulation_;
  std::size_t phase_ = 0;
};

TEST(Stairs, TheTrackedRobotClimbsAFlightAndReportsEachStepOnce) {
  std::vector<std::vector<Event>> all;
  std::vector<RobotMotion> ends;
  for (int repeat = 0; repeat < 2; ++repeat) {
    Simulation simulation = make(flight(kSteps, kRise, 0.29), with_robots({"crawler"}));
    spawn(simulation, articulated("r", "crawler", 0, 0));
    Operator(simulation).climb(3.6, 30);
    run(simulation, 2);
    ends.push_back(motion(simulation, "r"));
    all.push_back(simulation.take_events());
  }
  EXPECT_NEAR(ends[0].T_map_base.translation().z(), kSteps * kRise, 0.005);
  EXPECT_NEAR(ends[0].T_map_base.translation().y(), 0, 0.05);
  EXPECT_GT(ends[0].T_map_base.rotation()(2, 2), 0.999);
  const auto climbed = only(all[0], EventKind::step_climbed);
  ASSERT_EQ(climbed.size(), static_cast<std::size_t>(kSteps));
  for (std::size_t i = 0; i < climbed.size(); ++i) {
    EXPECT_EQ(climbed[i].object, "step " + std::to_string(i + 1));
    EXPECT_NEAR(climbed[i].value, kRise * static_cast<double>(i + 1), 1e-3);
  }
  for (const EventKind never : {EventKind::fell, EventKind::tipped_over, EventKind::tipping_predicted,
                                EventKind::pitch_limit, EventKind::collision_predicted})
    EXPECT_EQ(count(all[0], never), 0U) << to_string(never);
  // The same again, bit for bit.
  EXPECT_EQ(ends[0].T_map_base.isometry().matrix(), ends[1].T_map_base.isometry().matrix());
  ASSERT_EQ(all[0].size(), all[1].size());
  for (std::size_t i = 0; i < all[0].size(); ++i) {
    EXPECT_EQ(all[0][i].stamp, all[1][i].stamp);
    EXPECT_EQ(all[0][i].impulse, all[1][i].impulse);
  }
}

TEST(Stairs, StandsOnAFlightAndDescendsBackwards) {
  Simulation simulation = make(flight(kSteps, kRise, 0.29), with_robots({"crawler"}));
  spawn(simulation, articulated("r", "crawler", 0, 0));
  Operator(simulation).climb(1.9, 30);
  run(simulation, 1);
  const Eigen::Vector3d there = place(simulation);
  EXPECT_GT(there.z(), 0.5);
  run(simulation, 5);
  EXPECT_LT((place(simulation) - there).norm(), 0.01);
  drive(simulation, "r", {-0.25, 0, 0}, 10);
  run(simulation, 1);
  EXPECT_NEAR(place(simulation).z(), 0, 0.005);
  EXPECT_LT(place(simulation).x(), 0.5);
  EXPECT_EQ(count(simulation.take_events(), EventKind::fell), 0U);
}

TEST(Stairs, WithoutFrictionTracksSpinAtTheFirstStep) {
  for (const double friction : {0.3, 0.5}) {
    Simulation simulation = make(flight(kSteps, kRise, 0.29), with_friction(friction));
    spawn(simulation, articulated("r", "crawler", 0, 0));
    Operator(simulation).climb(3.6, 12);
    EXPECT_LT(place(simulation).z(), kRise) << friction;
    EXPECT_GT(motion(simulation, "r").left, place(simulation).x() + 1) << "its tracks turn";
    EXPECT_LE(count(simulation.take_events(), EventKind::step_climbed), 1U) << friction;
  }
}

TEST(Stairs, AFlightSteeperThanItsFrictionIsNotClimbed) {
  // Friction 0.75 is 36.9 degrees; this flight rises by 41.8.
  Simulation simulation = make(flight(kSteps, kRise, 0.19), with_robots({"crawler"}));
  spawn(simulation, articulated("r", "crawler", 0, 0));
  Operator(simulation).climb(3.6, 15);
  EXPECT_LT(place(simulation).z(), 2 * kRise);
}

}  // namespace
}  // namespace parhelion::simulation
