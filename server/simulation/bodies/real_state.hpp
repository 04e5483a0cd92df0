// What is known of the real robots, people and obstacles around the agents: inputs of a step.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "protocols/frames.hpp"
#include "protocols/pose2.hpp"
#include "protocols/time.hpp"

namespace parhelion::simulation {

/// The real robot's known state at a step; absent: its body is suspended (no contacts).
struct RealRobotState {
  Transform<Map, Base> T_map_base;
  bool attitude_known = false;  ///< roll and pitch are measured
  Twist2 twist;                 ///< body frame, from odometry, never differenced from corrections
  double sigma = 0;             ///< m, 1 sigma of its position: the margin of distance queries
  bool relocalized = false;     ///< teleport: no velocity, contacts suspended for this step
  /// False while injection is degraded: contacts are flagged undetectable and agents nearby freeze. When it
  /// becomes true again, an agent inside the stopping distance is moved to the nearest free place outside
  /// (event agent_moved).
  bool injection_live = true;
};

/// One entry for each real robot, in the order of the robot descriptions.
using RealRobotStates = std::span<const std::optional<RealRobotState>>;

/// A short-lived real obstacle that the model does not explain (such as a person): a disc in the map.
struct RealObstacle {
  Eigen::Vector2d center;
  double radius = 0.2;
};

/// A real person whom sensors follow: identity and motion are known, unlike those of an obstacle.
struct RealPerson {
  std::uint32_t id = 0;
  Eigen::Vector2d position;                            ///< m, map, at `stamp`
  Eigen::Vector2d velocity = Eigen::Vector2d::Zero();  ///< m/s, map
  double radius = 0.25;                                ///< m
  SimulationTime stamp;
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Identity() * 0.0025;  ///< m^2, map, of the position
  SimulationTime seen = {};  ///< instant of the last scan that showed the person
};

/// Name of a real person's body, and in events: "real person 7". No agent can have it.
std::string name_of(const RealPerson& person);

/// Whether the real robot's sensors show an agent now. A withheld agent freezes near the robot and its
/// contacts with the robot are undetectable; a returning one is also kept outside the stopping distance
/// (event agent_moved) until it is shown.
enum class AgentShown : std::uint8_t { shown, withheld, returning };

}  // namespace parhelion::simulation
