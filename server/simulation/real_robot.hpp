// A real robot in the simulation: a kinematic body that goes where the robot is known to be, and what must
// keep clear of it.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "protocols/robot.hpp"
#include "protocols/scene.hpp"
#include "server/simulation/body_watch.hpp"
#include "server/simulation/physics.hpp"
#include "server/simulation/planar.hpp"
#include "server/simulation/prediction.hpp"
#include "server/simulation/simulation.hpp"

namespace parhelion::simulation {

constexpr double kStopMargin = 0.15;  // m around where a real robot can stop

struct RealRobot {
  std::string name;
  BodyId id = 0;
  PhysicsHandle handle = 0;
  double mass = 0;
  double height = 0;
  RobotLimits limits;
  Footprint footprint;  ///< in base_link
  std::shared_ptr<const BodyDefinition> definition;
  std::uint32_t epoch = 0;  ///< counts its appearances and relocalizations
  bool present = false;     ///< at the newest step
  bool touchable = false;   ///< contacts count: present, and not in the step of a relocalization
  bool sensed = true;       ///< as RealRobotState
  Footprint placed;         ///< where it was last
  bool ever_present = false;
  RealRobotState last;  ///< where it was last
  BodyWatch watch;
  RobotPrediction prediction;
};

/// One at least; the first one is that of the robot description.
using RealRobots = std::vector<RealRobot>;

RealRobot make_real_robot(const RobotDescription& description, BodyId id, Physics& physics);

bool finite(const Twist2& twist);
/// Whether a state can be used: it is there, and finite.
bool is_known(const std::optional<RealRobotState>& state);

/// m that it needs to stop from `speed` m/s; `later`: s that it goes on before it brakes, beyond its reaction
/// time.
double stopping_distance(const RobotLimits& limits, double speed, double later = 0);

/// Appends where the robot cannot help being within its stopping distance: footprints along its arc, with a
/// margin. `later`: as of stopping_distance().
void append_stop_zone(const RealRobot& robot, const RealRobotState& now, std::vector<Footprint>& zone,
                      double later = 0);

/// Where it is from this step on; `jumped`: it appears there, without contacts in this step.
void place_real_robot(RealRobot& robot, const RealRobotState& now, bool jumped);
/// Its body follows.
void move_real_body(const RealRobot& robot, Physics& physics);
/// The body is suspended: nobody knows where the robot is.
void suspend_real_robot(RealRobot& robot, Physics& physics);

}  // namespace parhelion::simulation
