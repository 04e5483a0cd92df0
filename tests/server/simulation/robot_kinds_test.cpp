// The shipped robots, one of each kind: each drives, turns and stops as expected, on level floors, slopes and
// stairs.
#include "robots_world.hpp"
#include "tests/degree.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

using test::kDegree;

struct Kind {
  const char* model;
  DriveKind drive;
  double turn;  // fraction of the commanded yaw rate that it must reach: skid steering is less exact
};
constexpr Kind kKinds[] = {{"rover", DriveKind::differential, 0.05},
                           {"hauler", DriveKind::skid, 0.25},
                           {"buggy", DriveKind::ackermann, 0.05},
                           {"crawler", DriveKind::tracked, 0.25}};

TEST(RobotKinds, EachKindIsShipped) {
  std::vector<std::string> names;
  for (const Kind& kind : kKinds) {
    names.emplace_back(kind.model);
    EXPECT_EQ(shipped(kind.model)->drive.kind, kind.drive) << kind.model;
    EXPECT_EQ(shipped(kind.model)->name, kind.model);
  }
  for (const std::string& name : names) {
    const auto all = shipped_robot_models();
    EXPECT_NE(std::find(all.begin(), all.end(), name), all.end()) << name;
  }
}

TEST(RobotKinds, DriveStraightAndStop) {
  for (const Kind& kind : kKinds) {
    Simulation simulation = make(floor_of(40), with_robots({kind.model}));
    spawn(simulation, articulated("r", kind.model, 0, 0));
    drive(simulation, "r", {0.5, 0, 0}, 4);
    EXPECT_NEAR(motion(simulation, "r").velocity.x(), 0.5, 0.025) << kind.model;
    EXPECT_GT(motion(simulation, "r").T_map_base.translation().x(), 1.6) << kind.model;
    EXPECT_NEAR(motion(simulation, "r").T_map_base.translation().y(), 0, 0.02) << kind.model;
    run(simulation, 2.5);  // the command holds for half a second
    EXPECT_LT(motion(simulation, "r").velocity.norm(), 1e-3) << kind.model;
    drive(simulation, "r", {-0.4, 0, 0}, 2);
    EXPECT_NEAR(motion(simulation, "r").velocity.x(), -0.4, 0.02) << kind.model;
    EXPECT_GT(motion(simulation, "r").T_map_base.rotation()(2, 2), 0.998) << kind.model;
  }
}

TEST(RobotKinds, TurnAtTheCommandedRate) {
  for (const Kind& kind : kKinds) {
    for (const double rate : {0.4, -0.4}) {
      Simulation simulation = make(floor_of(40), with_robots({kind.model}));
      spawn(simulation, articulated("r", kind.model, 0, 0));
      drive(simulation, "r", {0.5, 0, rate}, 3);
      const double before = motion(simulation, "r").T_map_base.yaw();
      drive(simulation, "r", {0.5, 0, rate}, 2);
      const double turned =
          std::remainder(motion(simulation, "r").T_map_base.yaw() - before, 2 * std::numbers::pi);
      EXPECT_NEAR(turned / (2 * rate), 1, kind.turn) << kind.model << " at " << rate;
      EXPECT_LT(std::abs(motion(simulation, "r").T_map_base.translation().z()), 0.02) << kind.model;
    }
  }
}

TEST(RobotKinds, OnlyTheCarCannotTurnOnTheSpot) {
  for (const Kind& kind : kKinds) {
    Simulation simulation = make(floor_of(40), with_robots({kind.model}));
    spawn(simulation, articulated("r", kind.model, 0, 0));
    drive(simulation, "r", {0, 0, 0.6}, 3);
    const RobotMotion& at = motion(simulation, "r");
    if (kind.drive == DriveKind::ackermann) {
      EXPECT_NEAR(at.T_map_base.yaw(), 0, 0.02);
    } else {
      EXPECT_GT(at.T_map_base.yaw(), 0.8) << kind.model;
    }
    // Skid-steered robots do not turn exactly about the base: measured 0.27 m (hauler) and 0.39 m (crawler).
    // This excludes a robot that drives away instead of turning.
    EXPECT_LT(at.T_map_base.translation().norm(), 0.45) << kind.model;
  }
}

TEST(RobotKinds, TheCarFollowsTheCircleOfItsSteeringAngle) {
  Simulation simulation = make(floor_of(40), with_robots({"buggy"}));
  spawn(simulation, articulated("r", "buggy", 0, 0));
  drive(simulation, "r", {0.5, 0, 10}, 3);  // at its tightest turn
  const RobotMotion& at = motion(simulation, "r");
  const auto angle = [&](const char* joint) {
    for (std::size_t i = 0; i < at.joints.names.size(); ++i) {
      if (at.joints.names[i] == joint) return at.joints.positions[i];
    }
    ADD_FAILURE() << joint;
    return 0.0;
  };
  const double inner = angle("left_steering"), outer = angle("right_steering");
  EXPECT_NEAR(inner, 0.6, 1e-3);
  // Ackermann's condition: the cotangents differ by the track over the wheelbase.
  EXPECT_NEAR(1 / std::tan(outer) - 1 / std::tan(inner), 0.44 / 0.56, 0.01);
  const double radius = 0.56 / std::tan(inner) + 0.22;  // of the middle of the rear axle
  EXPECT_NEAR(at.rotation_rate.z() * radius, 0.5, 0.05);
}

TEST(RobotKinds, SmallWheelsDoNotClimbSteps) {
  for (const char* model : {"rover", "buggy"}) {
    Simulation simulation = make(flight(5, 0.17, 0.30), with_robots({model}));
    spawn(simulation, articulated("r", model, 0, 0));
    drive(simulation, "r", {0.5, 0, 0}, 5);
    EXPECT_LT(motion(simulation, "r").T_map_base.translation().x(), 0.9) << model;
    EXPECT_LT(motion(simulation, "r").T_map_base.translation().z(), 0.2) << model;
  }
}

/// A slope that rises along x from x = 0 on.
SemanticModel ramp(double angle) {
  SemanticModel model = floor_of(30);
  ModelEntity slope = model_box("ramp", EntityLabel::floor, {0, 0, 0}, {8, 3, 0.2});
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(-angle, Eigen::Vector3d::UnitY()));
  slope.T_map_body = Transform<Map, Body>(turn, turn * Eigen::Vector3d(4, 0, -0.1));
  model.entities.push_back(slope);
  return model;
}

TEST(RobotKinds, TheTrackedRobotClimbsSlopesUpToItsFrictionAngle) {
  // Friction 0.75 is 36.9 degrees; climbing needs a margin for internal slip.
  for (const double angle : {20.0, 30.0}) {
    Simulation simulation = make(ramp(angle * kDegree), with_robots({"crawler"}));
    spawn(simulation, articulated("r", "crawler", -1, 0));
    drive(simulation, "r", {0.5, 0, 0}, 5);
    EXPECT_GT(motion(simulation, "r").T_map_base.translation().z(), 0.3) << angle;
    run(simulation, 1.5);  // the command holds for half a second
    const double reached = motion(simulation, "r").T_map_base.translation().x();
    run(simulation, 2);
    EXPECT_NEAR(motion(simulation, "r").T_map_base.translation().x(), reached, 0.02) << angle;
  }
  Simulation simulation = make(ramp(42 * kDegree), with_robots({"crawler"}));
  spawn(simulation, articulated("r", "crawler", -1, 0));
  drive(simulation, "r", {0.4, 0, 0}, 9);
  EXPECT_LT(motion(simulation, "r").T_map_base.translation().x(), 0.6);
}

}  // namespace
}  // namespace parhelion::simulation
