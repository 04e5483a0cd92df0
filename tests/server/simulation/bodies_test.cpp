#include "server/simulation/bodies/bodies.hpp"

#include <algorithm>
#include <functional>

#include "server/simulation/bodies/gait.hpp"
#include "worlds.hpp"

namespace parhelion::simulation {
namespace {

using namespace test;

TEST(Bodies, StandingFeetNeitherSlideNorSinkIntoTheFloor) {
  const AgentDefinition walker = moving("walker", AgentKind::person, 0, 0, BehaviourKind::wander, 0.8);
  const double stride = stride_length(0.8);
  std::vector<Transform<Base, Body>> before, now;
  for (double walked = 0; walked < 3 * stride; walked += 0.01) {
    now.clear();
    part_poses(walker, {0, 0, walked / stride * 2 * std::numbers::pi, 1}, now);
    ASSERT_EQ(now.size(), agent_bodies(walker, 1).size());
    bool stands = false;
    for (const std::size_t foot : {5U, 8U}) {
      const double height = now[foot].translation().z() - kPerson.ankle;
      EXPECT_GE(height, -1e-12);
      if (height > 1e-9) continue;
      stands = true;
      if (before.empty() || before[foot].translation().z() - kPerson.ankle > 1e-9) continue;
      EXPECT_NEAR(now[foot].translation().x() - before[foot].translation().x(), -0.01, 1e-9)
          << "stays on its place";
    }
    EXPECT_TRUE(stands) << "walks, does not run";
    before = now;
  }
}

/// Number of steps by `foot` of the person in `duration` s, and its largest forward swing, m.
std::pair<int, double> steps_of(Simulation& simulation, const std::string& foot, double duration,
                                const std::function<RealRobotState(double)>& robot_at) {
  std::vector<LaserRequest> requests;
  int steps = 0;
  double farthest = 0;
  bool up = false;
  for (double t = 0; t < duration; t += 1.0 / 240) {
    simulation.step(robot_at(t), requests);
    const BodyState torso = body(simulation, "walker", "torso"), at = body(simulation, "walker", foot);
    const Eigen::Vector3d p = torso.T_map_body.inverse() * at.T_map_body.translation();
    farthest = std::max(farthest, p.x());
    const double height = at.T_map_body.translation().z() - kPerson.ankle;
    if (up && height < 0.002) ++steps;
    up = height > 0.015 || (up && height >= 0.002);
  }
  return {steps, farthest};
}

TEST(Bodies, TurningAndSidesteppingTakeSmallStepsOfBothFeet) {
  for (const bool aside : {false, true}) {
    for (const char* foot : {"left_foot", "right_foot"}) {
      Simulation simulation = make(room(20));
      AgentDefinition walker = moving("walker", AgentKind::person, 2, 0.1, BehaviourKind::stay);
      if (aside)
        walker.behaviour.yields = true;
      else
        walker.behaviour.kind = BehaviourKind::teleop;
      spawn(simulation, walker, real_at(-4, 0));
      const auto comes = [](double t) { return real_at(-4 + 0.5 * t, 0, 0, {0.5, 0, 0}); };
      const auto turns = [&](double) {
        simulation.teleop("walker", {0, 0, 1.0});
        return real_at(-4, 0);
      };
      const auto [steps, farthest] =
          aside ? steps_of(simulation, foot, 10, comes) : steps_of(simulation, foot, 6, turns);
      EXPECT_GE(steps, aside ? 1 : 2) << foot << (aside ? " aside" : " turning");
      EXPECT_LT(steps, 8) << foot;
      EXPECT_LT(farthest, 0.12) << "small ones";
    }
  }
}

TEST(Bodies, LegsStayConnectedThroughTheWholeGait) {
  const AgentDefinition walker = moving("walker", AgentKind::person, 0, 0, BehaviourKind::wander, 1.2);
  for (double amplitude : {0.0, 0.3, 1.0}) {
    for (double phase = 0; phase < 6.3; phase += 0.05) {
      std::vector<Transform<Base, Body>> poses;
      part_poses(walker, {0, 0, phase, amplitude}, poses);
      for (const std::size_t thigh : {3U, 6U}) {
        const Eigen::Vector3d knee = poses[thigh] * Eigen::Vector3d(0, 0, -kPerson.thigh);
        const Eigen::Vector3d ankle = poses[thigh + 1] * Eigen::Vector3d(0, 0, -kPerson.shank);
        EXPECT_LT((knee - poses[thigh + 1].translation()).norm(), 1e-9);
        EXPECT_LT((ankle - poses[thigh + 2].translation()).norm(), 1e-6);
        EXPECT_GE(knee.x(), std::min(poses[thigh].translation().x(), ankle.x()) - 1e-3)
            << "knees bend forward";
      }
    }
  }
}

/// Extent of an agent's shapes, all at the start.
Eigen::AlignedBox3d extent(const AgentDefinition& definition) {
  Eigen::AlignedBox3d box;
  std::vector<Transform<Base, Body>> poses;
  part_poses(definition, {}, poses);
  const auto bodies = agent_bodies(definition, 1);
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    for (const Shape& shape : bodies[i].shapes) {
      const bool is_box = shape.kind == ShapeKind::box;
      const double radius = is_box ? 0 : shape.size.x();
      const double half_height = shape.kind == ShapeKind::sphere    ? radius
                                 : shape.kind == ShapeKind::capsule ? shape.size.z() / 2 + radius
                                                                    : shape.size.z() / 2;
      const Eigen::Vector3d half =
          is_box ? Eigen::Vector3d(shape.size / 2) : Eigen::Vector3d(radius, radius, half_height);
      const Eigen::Isometry3d T = poses[i].isometry() * shape.T_body_shape.isometry();
      const Eigen::Vector3d reach = T.linear().cwiseAbs() * half;
      box.extend(Eigen::Vector3d(T.translation() - reach));
      box.extend(Eigen::Vector3d(T.translation() + reach));
    }
  }
  return box;
}

TEST(Bodies, EveryAgentStandsOnTheFloorAndFillsItsCollisionShape) {
  for (const AgentKind kind : {AgentKind::box, AgentKind::barrel, AgentKind::person, AgentKind::robot}) {
    const AgentDefinition definition = agent("x", kind, 0, 0);
    const Eigen::AlignedBox3d box = extent(definition);
    const AgentForm form = agent_form(definition);
    EXPECT_NEAR(box.min().z(), 0, 1e-6) << to_string(kind);
    EXPECT_NEAR(box.max().z(), form.size.z(), 0.03) << to_string(kind);
    EXPECT_LE(box.sizes().x(), form.size.x() + 0.02) << to_string(kind);
    EXPECT_LE(box.sizes().y(), form.size.y() + 0.02) << to_string(kind);
  }
}

TEST(Bodies, OnlyAgentsAreInjectable) {
  SemanticModel model = room(8);
  model.entities.push_back(model_box("glass", EntityLabel::wall, {2, 2, 1}, {1, 0.02, 2}));
  model.entities.back().is_virtual = true;
  Simulation simulation = make(model);
  spawn(simulation, agent("walker", AgentKind::person, 0, 0));
  for (const auto& definition : simulation.scene()->bodies) {
    EXPECT_EQ(definition->injectable, definition->owner == BodyOwner::agent || definition->entity == "glass")
        << definition->entity;
  }
}

TEST(Bodies, TheOutlineOfTheRealRobotIsItsFootprint) {
  Simulation simulation = make();
  const auto scene = simulation.scene();
  ASSERT_EQ(scene->bodies.size(), 1U);
  const BodyDefinition& real = *scene->bodies[0];
  ASSERT_EQ(real.shapes.size(), 4U);
  Eigen::AlignedBox3d box;
  for (const Shape& shape : real.shapes) {
    const Eigen::Vector3d reach = shape.T_body_shape.rotation().cwiseAbs() * (shape.size / 2);
    box.extend(Eigen::Vector3d(shape.T_body_shape.translation() - reach));
    box.extend(Eigen::Vector3d(shape.T_body_shape.translation() + reach));
  }
  EXPECT_TRUE(box.min().isApprox(Eigen::Vector3d(-0.25, -0.2, 0), 1e-9) ||
              (box.min() - Eigen::Vector3d(-0.25, -0.2, 0)).norm() < 1e-9);
  EXPECT_LT((box.max() - Eigen::Vector3d(0.25, 0.2, 0.5)).norm(), 1e-9);
}

}  // namespace
}  // namespace parhelion::simulation
