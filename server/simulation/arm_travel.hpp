// How far a real robot's arm can move until it touches a virtual thing (promise 3 for arms).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "server/simulation/bodies/agents.hpp"
#include "server/simulation/bodies/real_robot.hpp"
#include "server/simulation/physics/physics.hpp"

namespace parhelion::simulation {

/// The motion of a joint of the robot's model, from where its encoder says that it is.
struct JointMotion {
  std::size_t joint = 0;
  double velocity = 0;           ///< rad/s or m/s
  std::optional<double> target;  ///< rad or m: it stops there
};

struct ArmTravel {
  double time = 0;    ///< s that the motion can last, at most the horizon, never overestimated
  std::string thing;  ///< that ends it
};

/// Moves of all parts that the joints move, and of a held thing. In contact: 0, unless the motion leads out.
/// Fingers may push what is between them, and close on it until they hold it.
ArmTravel joint_travel(const RealRobot& robot, const Agents& agents, const Physics& physics,
                       const std::vector<JointMotion>& motions, double horizon);

/// The same for the base that drives with `twist`, all joints at rest: of all parts but the base's own.
ArmTravel base_travel(const RealRobot& robot, const Agents& agents, const Physics& physics,
                      const Transform<Map, Base>& T_map_base, const Twist2& twist, double horizon);

}  // namespace parhelion::simulation
