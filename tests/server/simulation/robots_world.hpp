// Articulated robots on level floors, ramps and stairs.
#pragma once

#include <map>
#include <memory>

#include "server/simulation/robots/robot_model.hpp"
#include "worlds.hpp"

namespace parhelion::test {

inline std::shared_ptr<const simulation::RobotModel> shipped(const std::string& name) {
  static std::map<std::string, std::shared_ptr<const simulation::RobotModel>> loaded;
  auto& model = loaded[name];
  if (model) return model;
  auto read = simulation::load_robot_model(name);
  EXPECT_TRUE(read.ok()) << (read ? "" : read.error().message);
  model = std::make_shared<const simulation::RobotModel>(std::move(read).value());
  return model;
}

inline simulation::SimulationOptions with_robots(const std::vector<std::string>& names) {
  simulation::SimulationOptions options;
  for (const std::string& name : names) options.robot_models.push_back(shipped(name));
  return options;
}

inline AgentDefinition articulated(const std::string& name, const std::string& model, double x, double y,
                                   double yaw = 0) {
  AgentDefinition definition = moving(name, AgentKind::robot, x, y, BehaviourKind::teleop);
  definition.T_map_base = Transform<Map, Base>::planar(x, y, yaw);
  definition.model = model;
  return definition;
}

inline SemanticModel floor_of(double side) {
  SemanticModel model;
  model.entities.push_back(model_box("floor", EntityLabel::floor, {0, 0, -0.05}, {side, side, 0.1}));
  return model;
}

/// A flight of steps starting at x = 1 m, with a landing behind it.
inline SemanticModel flight(int steps, double rise, double run) {
  SemanticModel model = floor_of(30);
  for (int i = 0; i < steps; ++i) {
    const double top = rise * (i + 1), depth = i + 1 < steps ? run : 4;
    model.entities.push_back(model_box("step " + std::to_string(i + 1), EntityLabel::stairs,
                                       {1 + run * i + depth / 2, 0, top / 2}, {depth, 2, top}));
    model.entities.back().part_of = "stairs 1";
  }
  return model;
}

inline const simulation::RobotMotion& motion(const simulation::Simulation& simulation,
                                             const std::string& name) {
  const simulation::RobotMotion* found = simulation.robot_motion(name);
  EXPECT_NE(found, nullptr) << name;
  return *found;
}

}  // namespace parhelion::test
