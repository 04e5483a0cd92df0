#include "tools/demo/place_agents.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "tools/demo/free_floor.hpp"

namespace parhelion::tools {
namespace {

constexpr double kRobotRadius = 0.45;   // m, a robot and some space to turn
constexpr double kPathClearance = 0.8;  // m, so that the recorded robot does not drive through it

double distance_to_path(const std::vector<Eigen::Vector3d>& path, const Eigen::Vector2d& at) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& pose : path) smallest = std::min(smallest, (pose.head<2>() - at).norm());
  return smallest;
}

/// Index of the pose at fraction `s` of the path's length.
std::size_t along(const std::vector<Eigen::Vector3d>& path, double s) {
  double length = 0;
  for (std::size_t i = 1; i < path.size(); ++i) length += (path[i] - path[i - 1]).head<2>().norm();
  double driven = 0;
  for (std::size_t i = 1; i < path.size(); ++i) {
    driven += (path[i] - path[i - 1]).head<2>().norm();
    if (driven >= s * length) return i;
  }
  return path.size() - 1;
}

/// Free floor on either side of the path at pose `i`, as close to it as possible.
std::optional<Eigen::Vector2d> beside(const pose::GridMap& map, const std::vector<Eigen::Vector3d>& path,
                                      std::size_t i) {
  const double yaw = path[i].z();
  const Eigen::Vector2d left(-std::sin(yaw), std::cos(yaw));
  for (double offset = kPathClearance; offset <= 2.5; offset += 0.05) {
    for (const double side : {1.0, -1.0}) {
      const Eigen::Vector2d at = path[i].head<2>() + side * offset * left;
      if (is_free(map, at, kRobotRadius) && distance_to_path(path, at) >= kPathClearance) return at;
    }
  }
  return std::nullopt;
}

/// The first place beside the path at or after fraction `s`.
std::optional<std::pair<std::size_t, Eigen::Vector2d>> place_from(const pose::GridMap& map,
                                                                  const std::vector<Eigen::Vector3d>& path,
                                                                  double s) {
  for (double fraction = s; fraction < s + 0.25 && fraction < 1; fraction += 0.01) {
    const std::size_t i = along(path, fraction);
    if (const auto at = beside(map, path, i)) return std::pair(i, *at);
  }
  return std::nullopt;
}

AgentDefinition robot(const std::string& name, const Eigen::Vector2d& at, double yaw) {
  AgentDefinition agent;
  agent.name = name;
  agent.kind = AgentKind::robot;
  agent.T_map_base = Transform<Map, Base>::planar(at.x(), at.y(), yaw);
  return agent;
}

}  // namespace

Result<std::vector<AgentDefinition>> place_agents(const pose::GridMap& map,
                                                  const std::vector<Eigen::Vector3d>& path) {
  std::vector<AgentDefinition> agents;
  const char* names[] = {"robot_1", "robot_2", "robot_3"};
  const double fractions[] = {0.15, 0.40, 0.65};
  for (int i = 0; i < 3; ++i) {
    const auto found = path.size() < 2 ? std::nullopt : place_from(map, path, fractions[i]);
    if (!found) return Error{std::string("no free floor beside the driven path for ") + names[i]};
    const auto& [index, at] = *found;
    agents.push_back(robot(names[i], at, wrap_angle(path[index].z() + std::numbers::pi)));
  }
  // The second robot patrols between two places beside the path.
  if (const auto further = place_from(map, path, 0.50)) {
    agents[1].behaviour.kind = BehaviourKind::patrol;
    agents[1].behaviour.speed = 0.4;
    agents[1].behaviour.waypoints = {agents[1].T_map_base.translation().head<2>(), further->second};
  }
  agents[2].behaviour.kind = BehaviourKind::wander;
  agents[2].behaviour.speed = 0.4;
  agents[2].laser = "lms-200";
  return agents;
}

}  // namespace parhelion::tools
