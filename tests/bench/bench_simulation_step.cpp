// A physics step with behaviours, and the world at a stamp: p50 and p99 in microseconds, and the real-time
// factor.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "server/simulation/simulation.hpp"

namespace {

using namespace parhelion;

SemanticModel hall(double side) {
  SemanticModel model;
  const auto add = [&model](double x, double y, double length, double width) {
    ModelEntity wall;
    wall.name = "wall " + std::to_string(model.entities.size());
    wall.label = EntityLabel::wall;
    wall.T_map_body = Transform<Map, Body>::planar(x, y, 0, 1.25);
    wall.size = {length, width, 2.5};
    model.entities.push_back(wall);
  };
  for (const double sign : {-1.0, 1.0}) {
    add(sign * side / 2, 0, 0.2, side);
    add(0, sign * side / 2, side, 0.2);
  }
  // 300 pieces of wall, as in an extruded grid map.
  for (int i = 0; i < 300; ++i)
    add(-side / 2 + 1 + std::fmod(i * 2.7, side - 2),
        -side / 2 + 1 + 2.7 * std::floor(i * 2.7 / (side - 2)) * 1.5, 0.3, 0.1);
  return model;
}

simulation::Simulation crowd(int robots, int persons, int boxes) {
  RobotDescription robot;
  robot.footprint = {{-0.25, -0.2}, {0.25, -0.2}, {0.25, 0.2}, {-0.25, 0.2}};
  const double side = 60;
  simulation::Simulation simulation =
      std::move(simulation::Simulation::create({}, hall(side), robot, SimulationTime{0})).value();
  const auto spawn = [&](AgentKind kind, BehaviourKind behaviour, int index) {
    AgentDefinition agent;
    agent.name = std::string(to_string(kind)) + std::to_string(index);
    agent.kind = kind;
    agent.behaviour.kind = behaviour;
    for (int attempt = 0; attempt < 2000; ++attempt) {
      const double n = index * 7 + attempt;
      agent.T_map_base = Transform<Map, Base>::planar(std::fmod(n * 3.71, side - 4) - side / 2 + 2,
                                                      std::fmod(n * 2.37, side - 4) - side / 2 + 2, 0);
      if (simulation.spawn(agent, std::nullopt).ok()) return;
    }
  };
  for (int i = 0; i < robots; ++i) spawn(AgentKind::robot, BehaviourKind::wander, i);
  for (int i = 0; i < persons; ++i) spawn(AgentKind::person, BehaviourKind::wander, i);
  for (int i = 0; i < boxes; ++i) spawn(AgentKind::box, BehaviourKind::stay, i);
  return simulation;
}

void measure(benchmark::State& state, simulation::Simulation& simulation) {
  std::vector<simulation::LaserRequest> requests;
  simulation::RealRobotState real;
  for (int i = 0; i < 480; ++i) simulation.step(real, requests);
  std::vector<double> us;
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    simulation.step(real, requests);
    us.push_back(std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - start).count());
  }
  double sum = 0;
  for (const double one : us) sum += one;
  std::sort(us.begin(), us.end());
  state.counters["p50_us"] = us[us.size() / 2];
  state.counters["p99_us"] = us[us.size() * 99 / 100];
  state.counters["x_real_time"] = 1e6 / 240 / (sum / static_cast<double>(us.size()));
}

void step(benchmark::State& state) {
  simulation::Simulation simulation = crowd(
      static_cast<int>(state.range(0)), static_cast<int>(state.range(1)), static_cast<int>(state.range(2)));
  measure(state, simulation);
}
BENCHMARK(step)
    ->ArgNames({"robots", "persons", "boxes"})
    ->Args({10, 0, 0})
    ->Args({10, 10, 0})
    ->Args({50, 0, 100})
    ->Iterations(7200)
    ->Unit(benchmark::kMicrosecond);

/// Robots that patrol through doors which they push open: 20 doors in a wall across a hall.
simulation::Simulation at_doors(int robots, const std::string& model_name) {
  constexpr int doors = 20;
  constexpr double spacing = 3;
  SemanticModel model;
  for (int i = 0; i <= doors; ++i) {
    ModelEntity wall;
    wall.name = "wall " + std::to_string(i);
    wall.label = EntityLabel::wall;
    wall.T_map_body = Transform<Map, Body>::planar(0, (i - 0.5) * spacing, 0, 1.25);
    wall.size = {0.1, spacing - 1.2, 2.5};
    model.entities.push_back(wall);
    if (i == doors) break;
    ModelEntity door;
    door.name = "door " + std::to_string(i);
    door.label = EntityLabel::door;
    door.T_map_body = Transform<Map, Body>::planar(0, i * spacing, std::numbers::pi / 2, 1);
    door.size = {1.15, 0.04, 2};
    door.is_virtual = true;
    model.entities.push_back(door);
  }
  RobotDescription robot;
  robot.footprint = {{-0.25, -0.2}, {0.25, -0.2}, {0.25, 0.2}, {-0.25, 0.2}};
  simulation::SimulationOptions options;
  if (!model_name.empty())
    options.robot_models = {
        std::make_shared<const simulation::RobotModel>(*simulation::load_robot_model(model_name))};
  simulation::Simulation simulation =
      std::move(simulation::Simulation::create(options, model, robot, SimulationTime{0})).value();
  for (int i = 0; i < robots; ++i) {
    AgentDefinition agent;
    agent.name = "robot" + std::to_string(i);
    agent.kind = AgentKind::robot;
    agent.model = model_name;
    agent.behaviour.kind = BehaviourKind::patrol;
    agent.behaviour.speed = 0.8;
    const double y = (i % doors) * spacing, x = 2.5 + 1.5 * (i / doors);
    agent.behaviour.waypoints = {{-x, y}, {x, y}};
    agent.T_map_base = Transform<Map, Base>::planar(x, y, std::numbers::pi);
    if (!simulation.spawn(agent, std::nullopt).ok()) std::abort();
  }
  return simulation;
}

void step_with_doors(benchmark::State& state) {
  const char* const models[] = {"", "rover", "crawler"};
  simulation::Simulation simulation = at_doors(static_cast<int>(state.range(0)), models[state.range(1)]);
  state.SetLabel(state.range(1) == 0 ? "single bodies" : models[state.range(1)]);
  measure(state, simulation);
}
BENCHMARK(step_with_doors)
    ->ArgNames({"robots", "model"})
    ->Args({50, 0})
    ->Args({50, 1})
    ->Args({50, 2})
    ->Iterations(4800)
    ->Unit(benchmark::kMicrosecond);

void world_at(benchmark::State& state) {
  simulation::Simulation simulation = crowd(50, 0, 100);
  std::vector<simulation::LaserRequest> requests;
  for (int i = 0; i < 480; ++i) simulation.step(std::nullopt, requests);
  WorldSnapshot world;
  const SimulationTime t = simulation.now() - milliseconds(3);
  for (auto _ : state) benchmark::DoNotOptimize(simulation.at(t, world));
}
BENCHMARK(world_at)->Unit(benchmark::kMicrosecond);

void clearance(benchmark::State& state) {
  simulation::Simulation simulation = crowd(50, 0, 100);
  std::vector<simulation::LaserRequest> requests;
  simulation.step(std::nullopt, requests);
  for (auto _ : state) {
    benchmark::DoNotOptimize(simulation.clearance(Transform<Map, Base>::planar(0, 0, 0), {0.5, 0, 0.3}, 3));
  }
}
BENCHMARK(clearance)->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
