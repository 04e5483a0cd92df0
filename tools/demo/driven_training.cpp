#include "tools/demo/driven_training.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/demo/free_floor.hpp"

namespace parhelion::tools {
namespace {

constexpr int kHeadings = 32;
constexpr double kStep = 0.05, kShortest = 1.5, kLongest = 3;  // m
constexpr double kBeside = 0.55;                               // m, clearance for a robot that does not drive
                                                               // quite straight
constexpr double kHalfZone = 0.6;                              // m

double free_run(const pose::GridMap& map, const Eigen::Vector2d& from, const Eigen::Vector2d& along) {
  double run = 0;
  while (run + kStep <= kLongest + kHalfZone && is_free(map, from + (run + kStep) * along, kBeside))
    run += kStep;
  return std::min(run, kLongest);
}

Zone zone_at(const Eigen::Vector2d& centre, double yaw) {
  const Eigen::Rotation2Dd turn(yaw);
  Zone zone;
  zone.name = "gate";
  for (const auto& [x, y] : {std::pair{1, 1}, {-1, 1}, {-1, -1}, {1, -1}})
    zone.outline.push_back(centre + turn * Eigen::Vector2d(kHalfZone * x, kHalfZone * y));
  zone.bottom = -1;
  zone.top = 2;
  return zone;
}

Condition when(Condition::Kind kind) {
  Condition condition;
  condition.kind = kind;
  return condition;
}

Condition when(EventKind event) {
  Condition condition = when(Condition::Kind::event);
  condition.event = event;
  return condition;
}

Training training_for(const std::string& robot) {
  Training training;
  training.robot = robot;
  training.text =
      "Drive " + robot +
      ", a virtual robot, into the marked zone ahead of it, and stop there. The real robot drives as "
      "it was recorded and will not make way: keep clear of it, of the others and of the walls.";
  training.pass_mark = 0.6;
  Task drive{"drive into the zone", "", 60, true, {}, when(Condition::Kind::reach), {}, {}};
  drive.done.target = "gate";
  Task stop{"stop", "", 40, false, {}, when(Condition::Kind::still), {}, {}};
  stop.done.duration = 2;
  training.tasks = {std::move(drive), std::move(stop)};
  training.penalties = {{"collision", 20, 0, 60, when(EventKind::contact_started)},
                        {"near miss", 10, 0, 30, when(EventKind::near_miss)}};
  return training;
}

}  // namespace

Status add_driven_training(const pose::GridMap& map, const std::string& robot, Scenario& scenario) {
  const auto agent = std::find_if(scenario.agents.begin(), scenario.agents.end(),
                                  [&](const AgentDefinition& each) { return each.name == robot; });
  if (agent == scenario.agents.end()) return Error{"no agent " + robot + " to drive"};
  const Eigen::Vector2d from = agent->T_map_base.translation().head<2>();
  double best = 0, best_yaw = 0;
  for (int i = 0; i < kHeadings; ++i) {
    const double yaw = wrap_angle(agent->T_map_base.yaw() + 2 * std::numbers::pi * i / kHeadings);
    const double run = free_run(map, from, {std::cos(yaw), std::sin(yaw)});
    if (run > best + kStep / 2) std::tie(best, best_yaw) = std::pair(run, yaw);
  }
  if (best < kShortest) return Error{"no free floor ahead of " + robot + " to be driven over"};
  agent->T_map_base = Transform<Map, Base>::planar(from.x(), from.y(), best_yaw);
  agent->behaviour.kind = BehaviourKind::teleop;
  scenario.zones.push_back(
      zone_at(from + best * Eigen::Vector2d(std::cos(best_yaw), std::sin(best_yaw)), best_yaw));
  scenario.training = training_for(robot);
  return {};
}

}  // namespace parhelion::tools
