// Scripted runs of simulated robots on stairs and with the arm. The physics moves them, so when a thing
// happens is read off their motion, by rules that are written down here once more.
#include <map>
#include <memory>

#include "robots_world.hpp"
#include "scripted_runs.hpp"

namespace parhelion {
namespace {

using namespace test;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kTread = 0.29;

/// Moving from 0.05 m/s or 0.1 rad/s on, standing after a quarter of a second below 0.02 m/s and 0.04 rad/s.
class MovementWitness {
 public:
  void see(const RobotMotion& motion, double t, std::vector<Expected>& expected) {
    const double speed = motion.velocity.norm(), rate = motion.rotation_rate.norm();
    if (!moves_ && (speed > 0.05 || rate > 0.10)) {
      moves_ = true;
      slow_ = 0;
      expected.push_back({EventKind::movement_started, t, "", "r"});
    } else if (moves_) {
      slow_ = speed < 0.02 && rate < 0.04 ? slow_ + 1 : 0;
      if (slow_ <= 60) return;
      moves_ = false;
      expected.push_back({EventKind::movement_stopped, t, "", "r"});
    }
  }

 private:
  bool moves_ = false;
  int slow_ = 0;  // steps
};

/// base_link comes over the steps of a flight from x = 1 m on, not far below their tops; its nose goes up and
/// down again.
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

Run with_robot(RobotModel model, SemanticModel site, double duration) {
  Run run{.name = "robot", .duration = duration};
  run.model = std::move(site);
  run.options.robot_models.push_back(std::make_shared<const RobotModel>(std::move(model)));
  return run;
}

void joint(Simulation& simulation, const std::vector<std::string>& names, double position) {
  Joints command;
  command.names = names;
  command.positions.assign(names.size(), position);
  const Status status = simulation.joint_command("r", command);
  ASSERT_TRUE(status.ok()) << status.error().message;
}

/// The tracked robot climbs a flight as an operator takes it up, and stands on top.
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

std::size_t index_of(const Joints& joints, const std::string& name) {
  return static_cast<std::size_t>(std::find(joints.names.begin(), joints.names.end(), name) -
                                  joints.names.begin());
}

/// The shoulder is sent up with a motor that is too weak for the stretched arm: half a second after it stands
/// still under all its torque it is overloaded.
Run overloads_its_shoulder(double effort) {
  RobotModel model = *shipped("crawler");
  for (RobotJoint& each : model.joints) {
    if (each.name != "shoulder_joint") continue;
    each.effort = effort;
    each.break_effort = 0;
  }
  Run run = with_robot(model, floor_of(20), 5);
  run.name = "overload";
  run.before_step = [](Simulation& simulation, double t) {
    if (t != kStep) return;
    spawn(simulation, articulated("r", "crawler", 0, 0));
    joint(simulation, {"elbow_joint"}, 0);
    joint(simulation, {"shoulder_joint"}, 60 * kDegree);
  };
  const auto moves = std::make_shared<MovementWitness>();
  const auto stalled = std::make_shared<double>(0);
  const auto overloaded = std::make_shared<bool>(false);
  const auto shoulder = std::find_if(model.joints.begin(), model.joints.end(),
                                     [](const RobotJoint& each) { return each.name == "shoulder_joint"; });
  const double slow = 0.05 * shoulder->velocity;
  run.witness = [=](const Simulation& simulation, double t, std::vector<Expected>& expected) {
    const RobotMotion& now = motion(simulation, "r");
    moves->see(now, t, expected);
    const std::size_t at = index_of(now.joints, "shoulder_joint");
    const double share = std::abs(now.joints.efforts[at]) / effort;
    *stalled = share >= 0.99 && std::abs(now.joints.velocities[at]) < slow ? *stalled + kStep : 0;
    if (share < 0.9) *overloaded = false;
    if (*overloaded || *stalled <= 0.5) return;
    *overloaded = true;
    expected.push_back({EventKind::joint_overload, t, "shoulder_joint", "r"});
  };
  return run;
}

TEST(ScriptedRobots, OnStairs) {
  expect_good({climbs(4, 0.17, 0.3), climbs(6, 0.15, 0.25), climbs(3, 0.17, 0.4)},
              "of the tracked robot on stairs");
}

TEST(ScriptedRobots, WithTheArm) {
  expect_good({overloads_its_shoulder(6), overloads_its_shoulder(12)}, "of the arm");
}

}  // namespace
}  // namespace parhelion
