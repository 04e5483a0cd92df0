// Worlds for several tests of the simulation.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "server/simulation/simulation.hpp"
#include "tests/model_box.hpp"

namespace parhelion::test {

inline const SimulationTime kStart{1'000'000'000'000};
inline constexpr double kStep = 1.0 / 240;  // s

inline RobotDescription robot() {
  RobotDescription description;
  description.name = "pioneer";
  description.footprint = {{-0.25, -0.2}, {0.25, -0.2}, {0.25, 0.2}, {-0.25, 0.2}};
  description.height = 0.5;
  description.mass = 40;
  return description;
}

/// Four walls of a room of `side` m around the origin, and a floor.
inline SemanticModel room(double side) {
  SemanticModel model;
  const double half = side / 2 + 0.1;
  model.entities.push_back(model_box("floor", EntityLabel::floor, {0, 0, -0.05}, {side + 1, side + 1, 0.1}));
  model.entities.push_back(model_box("wall 1", EntityLabel::wall, {half, 0, 1.25}, {0.2, side + 0.4, 2.5}));
  model.entities.push_back(model_box("wall 2", EntityLabel::wall, {-half, 0, 1.25}, {0.2, side + 0.4, 2.5}));
  model.entities.push_back(model_box("wall 3", EntityLabel::wall, {0, half, 1.25}, {side, 0.2, 2.5}));
  model.entities.push_back(model_box("wall 4", EntityLabel::wall, {0, -half, 1.25}, {side, 0.2, 2.5}));
  return model;
}

inline AgentDefinition agent(const std::string& name, AgentKind kind, double x, double y, double yaw = 0) {
  AgentDefinition definition;
  definition.name = name;
  definition.kind = kind;
  definition.T_map_base = Transform<Map, Base>::planar(x, y, yaw);
  return definition;
}

inline AgentDefinition moving(const std::string& name, AgentKind kind, double x, double y,
                              BehaviourKind behaviour, double speed = 0.5) {
  AgentDefinition definition = agent(name, kind, x, y);
  definition.behaviour.kind = behaviour;
  definition.behaviour.speed = speed;
  return definition;
}

inline simulation::RealRobotState real_at(double x, double y, double yaw = 0, Twist2 twist = {}) {
  simulation::RealRobotState state;
  state.T_map_base = Transform<Map, Base>::planar(x, y, yaw);
  state.twist = twist;
  return state;
}

inline simulation::Simulation make(const SemanticModel& model = {},
                                   const simulation::SimulationOptions& options = {}) {
  auto simulation = simulation::Simulation::create(options, model, robot(), kStart);
  EXPECT_TRUE(simulation.ok()) << (simulation ? "" : simulation.error().message);
  return std::move(simulation).value();
}

inline void spawn(simulation::Simulation& simulation, const AgentDefinition& definition,
                  const std::optional<simulation::RealRobotState>& real = std::nullopt) {
  const Status status = simulation.spawn(definition, real);
  ASSERT_TRUE(status.ok()) << status.error().message;
}

inline void run(simulation::Simulation& simulation, double seconds_of_it,
                const std::optional<simulation::RealRobotState>& real = std::nullopt) {
  std::vector<simulation::LaserRequest> requests;
  const auto end = simulation.now() + seconds(seconds_of_it);
  while (simulation.now() < end) {
    requests.clear();
    simulation.step(real, requests);
  }
}

/// Drives an agent for a time (s). The twist is sent before each step.
inline void drive(simulation::Simulation& simulation, const std::string& name, const Twist2& twist,
                  double duration, const std::optional<simulation::RealRobotState>& real = std::nullopt) {
  std::vector<simulation::LaserRequest> requests;
  const auto end = simulation.now() + seconds(duration);
  while (simulation.now() < end) {
    simulation.teleop(name, twist);
    requests.clear();
    simulation.step(real, requests);
  }
}

/// Steps for a time (s) with the real robot at `robot_at(t)`, t in s from now. Returns the events.
template <class Motion>
std::vector<Event> follow(simulation::Simulation& simulation, double duration, Motion robot_at) {
  std::vector<simulation::LaserRequest> requests;
  for (int i = 1; i <= std::lround(duration / kStep); ++i)
    simulation.step(std::optional<simulation::RealRobotState>(robot_at(i * kStep)), requests);
  return simulation.take_events();
}

/// s
inline double since_start(const Event& event) { return (event.stamp - kStart).seconds(); }

/// The body `part` of `entity` now; fails where there is none.
inline BodyState body(const simulation::Simulation& simulation, const std::string& entity,
                      const std::string& part = "") {
  WorldSnapshot world;
  EXPECT_TRUE(simulation.at(simulation.now(), world));
  std::optional<BodyState> found;  // the first
  for_each_body(world, [&](const BodyDefinition& definition, const BodyState& state) {
    if (!found && definition.entity == entity && (part.empty() || definition.part == part)) found = state;
  });
  EXPECT_TRUE(found) << "no body of " << entity << " " << part;
  return found.value_or(BodyState{});
}

inline bool has_body(const simulation::Simulation& simulation, SimulationTime t, const std::string& entity) {
  WorldSnapshot world;
  EXPECT_TRUE(simulation.at(t, world));
  bool found = false;
  for_each_body(world, [&](const BodyDefinition& definition, const BodyState&) {
    found = found || definition.entity == entity;
  });
  return found;
}

/// The events of a kind.
inline std::vector<Event> only(const std::vector<Event>& events, EventKind kind) {
  std::vector<Event> found;
  for (const Event& event : events) {
    if (event.kind == kind) found.push_back(event);
  }
  return found;
}

inline std::size_t count(const std::vector<Event>& events, EventKind kind) {
  std::size_t n = 0;
  for (const Event& event : events) n += event.kind == kind;
  return n;
}

}  // namespace parhelion::test
