// The solver against mechanics computed by hand.
#include <gtest/gtest.h>

#include <cmath>

#include "server/simulation/physics/physics.hpp"
#include "tests/degree.hpp"
#include "tests/server/simulation/worlds.hpp"

namespace parhelion::simulation {
namespace {

constexpr double kSanityStep = 1.0 / 240;
constexpr double kEarthGravity = 9.81;
using test::kDegree;
constexpr double kFriction = 0.36;  // of two free or fixed bodies: 0.6 each, multiplied

Transform<Map, Body> at(double x, double y, double z) { return Transform<Map, Body>::planar(x, y, 0, z); }

/// A block on a slope that falls along +x, awake.
struct Slope {
  explicit Slope(double angle) : turn(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY())) {
    physics.add_fixed_box({turn, turn * Eigen::Vector3d(0, 0, -0.1)}, {20, 4, 0.2}, false);
    block = physics.add_free(ShapeKind::box, {0.4, 0.4, 0.2}, 5, {turn, turn * Eigen::Vector3d(-5, 0, 0)});
    physics.keep_awake(block, true);
  }
  void run(double duration) {
    for (int i = 0; i < duration / kSanityStep; ++i) physics.step();
  }
  /// m down the slope.
  double slid() const { return (turn.conjugate() * physics.state(block).T_map_body.translation()).x() + 5; }
  double speed() const { return (turn.conjugate() * physics.state(block).velocity).x(); }

  Physics physics{kSanityStep};
  Eigen::Quaterniond turn;
  PhysicsHandle block = 0;
};

TEST(PhysicalSanity, ABlockOnASlopeSlidesAtTheFrictionAngle) {
  const double angle = std::atan(kFriction);
  Slope below(angle - 0.5 * kDegree), above(angle + 0.5 * kDegree);
  below.run(4);
  above.run(4);
  EXPECT_LT(below.slid(), 0.01);
  EXPECT_GT(above.slid(), 0.1);
}

TEST(PhysicalSanity, ASlidingBodyAcceleratesByCoulombFriction) {
  const double angle = 30 * kDegree;
  Slope slope(angle);
  slope.run(1);
  const double before = slope.speed();
  slope.run(0.5);
  // Air drag: 2 % of the speed in a second.
  const double expected = kEarthGravity * (std::sin(angle) - kFriction * std::cos(angle));
  EXPECT_NEAR((slope.speed() - before) / 0.5, expected, 0.05 * expected);
}

/// Including pitched, rolled and elevated bodies; none moves in the first second.
TEST(PhysicalSanity, BodiesStayAtTheirModelPoses) {
  SemanticModel model = test::room(8);
  model.entities.push_back(
      test::model_box("step 1", EntityLabel::stairs, {1, 1, 0.085}, {0.3, 1, 0.17}, 0.4));
  model.entities.push_back(test::model_box("ceiling", EntityLabel::ceiling, {0, 0, 2.6}, {8, 8, 0.2}));
  model.entities.push_back(test::model_box("ramp", EntityLabel::unknown, {-1, -1, 0.5}, {1.5, 0.8, 0.1}));
  model.entities.back().T_map_body = Transform<Map, Body>(
      Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d(0.6, 0.8, 0))), Eigen::Vector3d(-1, -1, 0.5));
  model.entities.push_back(test::model_box("door 1", EntityLabel::door, {2, -2, 1}, {0.9, 0.05, 2}, 1.1));
  SimulationOptions options;
  options.level = 1;
  Simulation simulation = test::make(model, options);
  for (const double after : {0.1, 1.0}) {
    test::run(simulation, after);
    WorldSnapshot world;
    ASSERT_TRUE(simulation.at(simulation.now(), world));
    for (const ModelEntity& entity : model.entities) {
      const auto body = std::find_if(world.scene->bodies.begin(), world.scene->bodies.end(),
                                     [&](const auto& each) { return each->entity == entity.name; });
      ASSERT_NE(body, world.scene->bodies.end()) << entity.name;
      EXPECT_EQ((*body)->shapes.at(0).size, entity.size) << entity.name;
      const auto state = std::find_if(world.bodies.begin(), world.bodies.end(),
                                      [&](const BodyState& each) { return each.id == (*body)->id; });
      ASSERT_NE(state, world.bodies.end()) << entity.name;
      const Eigen::Isometry3d off = entity.T_map_body.isometry().inverse() *
                                    (state->T_map_body * (*body)->shapes.at(0).T_body_shape).isometry();
      EXPECT_LT(off.translation().norm(), 1e-6) << entity.name;
      EXPECT_LT(Eigen::AngleAxisd(off.rotation()).angle(), 1e-6) << entity.name;
    }
  }
}

TEST(PhysicalSanity, AThrownBodyFollowsTheParabola) {
  Physics physics(kSanityStep);
  physics.add_floor(0);
  physics.add_fixed_box(at(-2, 0, 1), {4, 2, 2}, false);
  const Eigen::Vector3d centre(0, 0, 0.15);
  const PhysicsHandle box = physics.add_free(ShapeKind::box, {0.3, 0.3, 0.3}, 3, at(-0.6, 0, 2));
  const PhysicsHandle bat = physics.add_kinematic({{-0.1, -0.1}, {0.1, -0.1}, {0.1, 0.1}, {-0.1, 0.1}}, 0.3);
  physics.suspend(bat, false);
  const double bat_speed = 4;
  double x = -1.2;
  Eigen::Vector3d p0 = Eigen::Vector3d::Zero(), v0 = p0;
  int flying = 0;
  for (int i = 0; i < 480; ++i) {
    const bool swings = x < -0.5;
    x += swings ? bat_speed * kSanityStep : 0;
    physics.move_kinematic(bat, at(x, 0, 2), {swings ? bat_speed : 0, 0, 0}, Eigen::Vector3d::Zero());
    physics.step();
    const RigidState state = physics.state(box);
    const Eigen::Vector3d arm = state.T_map_body.rotation() * centre;
    const Eigen::Vector3d p = state.T_map_body.translation() + arm;
    if (p.z() < 0.5) break;
    if (p.x() < 0.35) continue;
    if (flying++ == 0) {
      p0 = p;
      v0 = state.velocity + state.rotation_rate.cross(arm);
      ASSERT_GT(v0.x(), 2);
      continue;
    }
    const double t = (flying - 1) * kSanityStep;
    const Eigen::Vector3d expected = p0 + v0 * t - Eigen::Vector3d(0, 0, kEarthGravity * t * t / 2);
    // A step of semi-implicit Euler is g t dt / 2 off, and air drag takes 2 % of the speed in a second.
    const double off = kEarthGravity * t * kSanityStep / 2 + 0.02 * v0.norm() * t * t;
    EXPECT_NEAR((p - expected).norm(), 0, off + 1e-6) << t;
  }
  EXPECT_GT(flying, 60);
}

TEST(PhysicalSanity, AStackOfBoxesStandsForAMinuteAndGainsNoEnergy) {
  Physics physics(kSanityStep);
  physics.add_floor(0);
  constexpr int kBoxes = 5;
  constexpr double kSide = 0.3, kMass = 4;
  std::vector<PhysicsHandle> boxes;
  for (int i = 0; i < kBoxes; ++i) {
    boxes.push_back(
        physics.add_free(ShapeKind::box, {kSide, kSide, kSide}, kMass, at(0.01 * (i % 2), 0, kSide * i)));
    physics.keep_awake(boxes.back(), true);  // placed asleep, it would prove nothing
  }
  const auto energy = [&] {
    double sum = 0;
    for (const PhysicsHandle box : boxes) {
      const RigidState state = physics.state(box);
      sum += kMass * (kEarthGravity * state.T_map_body.translation().z() + state.velocity.squaredNorm() / 2);
    }
    return sum;
  };
  const double before = energy();
  physics.step();
  for (const PhysicsHandle box : boxes) physics.keep_awake(box, false);
  for (int i = 0; i < 60 * 240; ++i) {
    physics.step();
    if (i % 24 == 0) {
      ASSERT_LT(energy(), before + 0.01) << "after " << i * kSanityStep << " s";
    }
  }
  for (int i = 0; i < kBoxes; ++i) {
    const Transform<Map, Body> pose = physics.state(boxes[static_cast<std::size_t>(i)]).T_map_body;
    EXPECT_NEAR(pose.translation().x(), 0.01 * (i % 2), 0.03) << i;
    EXPECT_NEAR(pose.translation().z(), kSide * i, 0.005) << i;
    EXPECT_GT(pose.rotation()(2, 2), 0.9999) << i;
  }
}

}  // namespace
}  // namespace parhelion::simulation
