// Scripted runs of simulated robots on stairs: the expected times are derived from their motion.
#include "scripted_robots.hpp"

#include "tests/degree.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

using test::kDegree;
constexpr double kTread = 0.29;

/// base_link moves over the steps of a flight that starts at x = 1 m, close above their tops; its nose
/// pitches up and down again.
class StairsWitness {
 public:
  StairsWitness(int steps, double rise) : steps_(steps), rise_(rise) {}
  void see(const RobotMotion& motion, double t, std::vector<Expected>& expected) {
    const Eigen::Vector3d p = motion.T_map_base.translation();
    while (next_ < steps_ && p.x() >= 1 + next_ * kTread && p.z() >= (next_ + 1) * rise_ - 0.15) {
      ++next_;
      expected.push_back({EventKind::step_climbed, t, "step " + std::to_string(next_), "r"});
    }
    const double pitch = std::abs(std::asin(motion.T_map_base.rotation()(2, 0)));
    if (pitch < 0.8 * kWarning) warned_ = false;
    if (warned_ || pitch <= kWarning) return;
    warned_ = true;
    expected.push_back({EventKind::pitch_warning, t, "", "r"});
  }
  static constexpr double kWarning = 25 * kDegree;

 private:
  int steps_, next_ = 0;
  double rise_;
  bool warned_ = false;
};

/// The tracked robot climbs a flight as with an operator, and stops at the top.
Run climbs(int steps, double rise, double speed) {
  RobotModel model = *shipped("crawler");

  model.attitude.pitch_warning = StairsWitness::kWarning;
  model.attitude.pitch_limit = 60 * kDegree;
  Run run = with_robot(model, flight(steps, rise, kTread), (2.5 + steps * 0.5) / speed);
  run.name = "crawler on stairs";
  run.on_stairs = true;
  const auto phase = std::make_shared<std::size_t>(0);
  run.before_step = [=](Simulation& simulation, double t) {
    if (t == kStep) spawn(simulation, articulated("r", "crawler", 0, 0));
    const RobotMotion& now = motion(simulation, "r");
    const double pitch = std::asin(now.T_map_base.rotation()(2, 0));
    if (*phase == 0 && pitch > 6 * kDegree) *phase = 1;
    if (*phase == 1 && pitch > 22 * kDegree) *phase = 2;
    if (std::lround(t / kStep) % 30 == 1)
      joint(simulation, {"left_flipper_joint", "right_flipper_joint"},
            std::array{35, -20, -6}[*phase] * kDegree);
    const bool on_top = now.T_map_base.translation().x() > 1 + steps * kTread + 0.6;
    simulation.teleop("r", {on_top ? 0 : speed, 0, 0});
  };
  const auto moves = std::make_shared<MovementWitness>();
  const auto stairs = std::make_shared<StairsWitness>(steps, rise);
  run.witness = [=](const Simulation& simulation, double t, std::vector<Expected>& expected) {
    moves->see(motion(simulation, "r"), t, expected);
    stairs->see(motion(simulation, "r"), t, expected);
  };
  return run;
}

TEST(ScriptedRobots, OnStairs) {
  expect_good({climbs(4, 0.17, 0.3), climbs(6, 0.15, 0.25), climbs(3, 0.17, 0.4)},
              "of the tracked robot on stairs");
}

}  // namespace
}  // namespace parhelion::simulation
