#include "server/simulation/bodies.hpp"

#include <algorithm>

#include "server/simulation/gait.hpp"
#include "worlds.hpp"

namespace parhelion {
namespace {

using namespace test;

TEST(Bodies, FeetThatStandDoNotSlideAndNoneIsBelowTheFloor) {
  const AgentDefinition walker = moving("walker", AgentKind::person, 0, 0, BehaviourKind::wander, 0.8);
  const double stride = stride_length(0.8);
  std::vector<Transform<Base, Body>> before, now;
  for (double way = 0; way < 3 * stride; way += 0.01) {
    now.clear();
    part_poses(walker, {0, 0, way / stride * 2 * std::numbers::pi, 1}, now);
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

TEST(Bodies, LegsStayJointedThroughTheWholeGait) {
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

TEST(Bodies, EveryAgentStandsOnTheFloorAndFillsWhatItCollidesWith) {
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

TEST(Bodies, AgentsAreInjectableAndTheBuildingAndTheRealRobotAreNot) {
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

TEST(Bodies, TheRealRobotsOutlineIsItsFootprint) {
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
}  // namespace parhelion
