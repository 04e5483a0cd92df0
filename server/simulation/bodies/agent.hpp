// A virtual agent (or the trainee's simulated robot) at the newest step.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocols/agent.hpp"
#include "protocols/event.hpp"
#include "protocols/robot.hpp"
#include "server/simulation/bodies/bodies.hpp"
#include "server/simulation/bodies/body_watch.hpp"
#include "server/simulation/bodies/cable.hpp"
#include "server/simulation/bodies/handling.hpp"
#include "server/simulation/bodies/prediction.hpp"
#include "server/simulation/bodies/real_state.hpp"
#include "server/simulation/bodies/steering.hpp"
#include "server/simulation/bodies/step_clock.hpp"
#include "server/simulation/physics/physics.hpp"
#include "server/simulation/robots/articulated_robot.hpp"
#include "server/simulation/robots/robot_supply.hpp"

namespace parhelion::simulation {

/// An agent's own simulated laser and its newest scan.
struct AgentLaser {
  LaserDescription description;
  SimulationTime next;                     ///< when the next scan is due
  SimulationTime requested;                ///< when the newest scan was requested, and...
  Transform<Map, Laser> T_map_laser;       ///< ...the laser's pose then
  std::optional<SimulationTime> measured;  ///< instant of the points
  std::vector<Footprint> points;           ///< in the map; the nearest return of each sector
};

/// The route that an agent follows.
struct AgentRoute {
  std::vector<Eigen::Vector2d> points;
  std::size_t next = 0;  ///< index in `points` of the next one to reach
  Eigen::Vector2d goal = Eigen::Vector2d::Zero();
  bool requested = false;         ///< a search is under way
  int failures = 0;               ///< for the current goal
  bool reported = false;          ///< unreachability was reported
  std::uint64_t retry_after = 0;  ///< step; no search before it
};

/// Whether one real robot's sensors show the agent.
struct SeenByRobot {
  AgentShown shown = AgentShown::shown;
  bool clear_of_real = false;  ///< at the newest step, while returning
};

struct Agent {
  AgentDefinition definition;
  AgentForm form;
  BodyId first_body = 0;
  std::size_t body_count = 0;
  std::uint64_t decision_offset = 0;  ///< steps; spreads the decisions of agents
  PhysicsHandle handle = 0;
  std::unique_ptr<ArticulatedRobot> robot;  ///< with a robot model; `handle` is its base part
  std::unique_ptr<Cable> cable;             ///< of a cable; `handle` is its middle link
  bool trainee = false;                     ///< the trainee's simulated robot
  bool of_site = false;                     ///< a movable object of the site's model
  std::uint64_t name_hash = 0;
  std::uint64_t random_stream = 0;  ///< key of its random numbers
  std::uint32_t epoch = 0;          ///< counts spawn and teleports
  double floor = 0;                 ///< m, z of its floor (upright agents)
  bool frozen = false;
  bool unconstrained = false;        ///< no contact is possible now: moved without the solver
  std::vector<SeenByRobot> seen_by;  ///< by RealRobot::index

  RigidState rigid;  ///< at the newest step
  Pose2 pose;
  Footprint placed;  ///< form.footprint at pose
  PartMotion parts;
  std::vector<Transform<Base, Body>> part_poses;  ///< at the newest step
  std::uint32_t part_epoch = 0;                   ///< epoch of part_poses

  Twist2 driven;  ///< motor command, after acceleration limits
  Twist2 teleop;
  std::optional<SimulationTime> teleop_until;
  SteeringState steering;
  AgentRoute route;
  bool arrived = false;  ///< following, fleeing or blocking: at its destination
  std::optional<AgentLaser> laser;
  BodyWatch watch;
  RobotPrediction prediction;  ///< for agents with a robot model
  RobotSupply supply;
  GripperWatch gripper;
};

constexpr double kDecisionPeriod = 0.05;  // s between two decisions of an agent
constexpr double kSight = 3.0;            // m: obstacles farther away are ignored in decisions
constexpr double kReached = 0.3;          // m from a waypoint
constexpr double kPatience = 3.0;         // s without progress before a new route is searched

SteeringLimits limits_of(const Agent& agent);

/// Whether the agent decides at the newest step; decisions of many agents are spread over the steps.
bool decides(const Agent& agent, const StepClock& clock);

/// An event about the agent, at its position on the floor.
Event agent_event(EventKind kind, const Agent& agent, SimulationTime now, std::uint64_t request = 0,
                  std::string text = {});

}  // namespace parhelion::simulation
