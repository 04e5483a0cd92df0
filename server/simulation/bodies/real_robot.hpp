// A real robot in the simulation: a kinematic body at the robot's known pose, and the area that agents must
// avoid.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "protocols/robot.hpp"
#include "protocols/scene.hpp"
#include "server/simulation/bodies/body_watch.hpp"
#include "server/simulation/bodies/prediction.hpp"
#include "server/simulation/bodies/real_grip.hpp"
#include "server/simulation/bodies/real_state.hpp"
#include "server/simulation/building/planar.hpp"
#include "server/simulation/physics/physics.hpp"
#include "server/simulation/robots/robot_twin.hpp"

namespace parhelion::simulation {

constexpr double kStopMargin = 0.15;  // m added to the real robot's stopping area

struct RealRobot {
  std::string name;
  std::size_t index = 0;  ///< in RealRobots
  BodyId id = 0;
  PhysicsHandle handle = 0;
  double mass = 0;
  double height = 0;
  RobotLimits limits;
  Footprint footprint;  ///< in base_link
  double payload = 0;   ///< kg, of its gripper; 0: no limit
  /// Its bodies, ids from `id`: one of its footprint, or those of the twin.
  std::vector<std::shared_ptr<const BodyDefinition>> definitions;
  std::unique_ptr<RobotTwin> twin;  ///< null: no robot model, so that it has no joints
  bool encoders_fresh = false;      ///< of the twin's joints, at the newest step
  bool jumped = false;              ///< it appeared or was relocalized in the newest step
  RealGrip grip;
  std::uint32_t epoch = 0;     ///< counts appearances and relocalizations
  bool present = false;        ///< at the newest step
  bool touchable = false;      ///< has contacts: present, and not in the step of a relocalization
  bool injection_live = true;  ///< see RealRobotState
  Footprint placed;            ///< last known
  bool ever_present = false;
  RealRobotState last;  ///< last known
  BodyWatch watch;
  RobotPrediction prediction;
};

/// At least one; in the order of the robot descriptions.
using RealRobots = std::vector<RealRobot>;

/// `model`: that the description names; null: none.
RealRobot make_real_robot(const RobotDescription& description, std::shared_ptr<const RobotModel> model,
                          std::size_t index, BodyId id, Physics& physics);
/// Bodies that make_real_robot() makes.
std::size_t count_bodies(const RobotModel* model);
/// Whether a physics body is its own.
bool owns(const RealRobot& robot, PhysicsHandle handle);
/// Appends the states of its bodies.
void append_states(const RealRobot& robot, std::vector<BodyState>& bodies);

bool finite(const Twist2& twist);
/// Whether a state is present and finite.
bool is_known(const std::optional<RealRobotState>& state);

/// m that it needs to stop from `speed` m/s; `later`: s of delay before braking, in addition to its reaction
/// time.
double stopping_distance(const RobotLimits& limits, double speed, double later = 0);

/// Appends the area within the robot's stopping distance: footprints along its arc, with a margin. `later`:
/// as in stopping_distance().
void append_stop_zone(const RealRobot& robot, const RealRobotState& now, std::vector<Footprint>& zone,
                      double later = 0);

/// Sets the state from this step on; `jumped`: it appears there, without contacts in this step.
void place_real_robot(RealRobot& robot, const RealRobotState& now, bool jumped);
/// Moves the body, or the twin's, to the state.
void move_real_body(RealRobot& robot, Physics& physics);
/// Suspends the body: the robot's pose is unknown.
void suspend_real_robot(RealRobot& robot, Physics& physics);

}  // namespace parhelion::simulation
