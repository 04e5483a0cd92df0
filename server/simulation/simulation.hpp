// The rigid-body world: agents, the real robot as a kinematic body, the building; fixed steps; two seconds of
// states. Implemented in simulation.cpp (creation, buildings, queries), step.cpp (a step) and commands.cpp
// (commands to agents, robots and doors); parts.hpp lists its parts.
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/hazard.hpp"
#include "protocols/instructor_command.hpp"
#include "protocols/joints.hpp"
#include "protocols/model.hpp"
#include "protocols/model_objects.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"
#include "protocols/status.hpp"
#include "protocols/world.hpp"
#include "protocols/zone.hpp"
#include "server/simulation/bodies/real_state.hpp"
#include "server/simulation/robots/robot_motion.hpp"
#include "server/simulation/robots/supply_state.hpp"
#include "server/simulation/world/simulation_options.hpp"

namespace parhelion::simulation {

class Building;

/// Request for an agent's laser scan: the server casts it (fusion/scan) and returns it with give_scan.
struct LaserRequest {
  std::string agent;
  SimulationTime stamp;
  Transform<Map, Laser> T_map_laser;
  LaserDescription laser;
  std::vector<BodyId> own_bodies;  ///< excluded from its own scan
};

/// State of a door at the newest step.
struct DoorState {
  std::string name;
  double opening = 0;    ///< rad from its closed angle (protocols/door.hpp)
  bool known = true;     ///< false: a real door without measurements; the opening is the last known one
  bool dynamic = false;  ///< moved by physics; else a real door, set by sensors and the instructor
  bool unhinged = false;
  Transform<Map, Body> T_map_leaf;  ///< at the centre of the leaf
};

/// Deterministic: same calls, same states, bit for bit. One thread.
class Simulation {
 public:
  /// `robots`: at least one, with different names. Functions below that take one robot's state are for a
  /// simulation of one real robot; `robot` of others is an index in `robots`.
  static Result<Simulation> create(const SimulationOptions& options, const SemanticModel& model,
                                   std::span<const RobotDescription> robots, SimulationTime start);
  static Result<Simulation> create(const SimulationOptions& options, const SemanticModel& model,
                                   const RobotDescription& robot, SimulationTime start);
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;
  ~Simulation();

  /// Applies the command or reports why not; the error gives the nearest free place for an occupied one, and
  /// the nearest known name for an unknown one. `real` is the robot's current state, for objects that must
  /// not appear on it or inside its stopping distance v r + v^2 / (2 a) plus a margin. Results are appended
  /// to the events (agent_spawned, agent_moved, agent_removed, with the request's number); the server
  /// publishes command_accepted and command_refused.
  Status command_among_robots(const AgentCommand& command, RealRobotStates real);
  Status command(const AgentCommand& command, const std::optional<RealRobotState>& real);
  /// Sets the angle of a simulated door's leaf, or the reported angle of a real one. Error: no such door, off
  /// its hinge, or an opening outside its range.
  Status set_door(const DoorCommand& command);
  Status spawn_among_robots(const AgentDefinition& agent, RealRobotStates real);
  Status spawn(const AgentDefinition& agent, const std::optional<RealRobotState>& real);
  /// Spawns the trainee's simulated robot (levels 1 and 2): an articulated robot whose bodies are the real
  /// robot's (BodyOwner::real_robot, never injected), driven by teleop(); the kinematic body of the real one
  /// stays suspended (step() with none). It may have the robot description's name. Error: no model, a second
  /// one, or as spawn(). Commands may move it, not remove it.
  Status spawn_trainee(const AgentDefinition& trainee);
  /// The definition of an existing agent, with its current behaviour, or nullptr; valid until the next
  /// command.
  const AgentDefinition* find_agent(const std::string& name) const;
  /// Pose of an agent at the newest step; none: no such agent.
  std::optional<Transform<Map, Base>> pose_of(const std::string& agent) const;
  /// The command of a teleoperated agent; holds for 0.5 s. It is lost out of radio range.
  void teleop(const std::string& agent, const Twist2& twist);
  /// Whether the newest command of a teleoperated agent still holds, and moves it.
  bool is_driven(const std::string& agent) const;
  /// Blocks wheels or tracks of these sides of an articulated robot until the next call; an unknown name is
  /// ignored.
  void block_sides(const std::string& agent, bool left, bool right);
  /// Positions, or else velocities, or else efforts of an articulated robot's joints. A position holds until
  /// the next command (velocities beside it limit the speed); velocities and efforts hold for 0.5 s, then the
  /// joint holds its position. Values are clamped to their limits. Error: an unknown robot; unknown joints
  /// (the others are commanded); values that are not finite or not one for each name (none is commanded); an
  /// empty battery.
  Status joint_command(const std::string& agent, const Joints& joints);
  /// Repairs broken joints at their start positions; event joints_restored. Error: an unknown robot.
  Status restore_joints(const std::string& agent, std::uint64_t request = 0);
  /// Encoders of a real robot that has a robot model, from the next step on; joints that mimic another follow
  /// it. Not `fresh`: they are not known, so that its gripper takes nothing and lets nothing go.
  void set_encoders(const JointPosture& posture, bool fresh, std::size_t robot = 0);
  /// What is in the gripper of a real robot; empty: nothing.
  const std::string& held_by(std::size_t robot = 0) const;
  /// A joint whose command was reduced, and the virtual thing that is in its way.
  struct LimitedJoint {
    std::string joint, thing;
  };
  /// Promise 3 for the joints of a real robot that has a robot model: velocities are reduced so that nothing
  /// virtual is touched within `reaction` s, positions so that nothing is touched within `holds` s, and
  /// efforts that push into something are 0. Motion out of a contact is free. Names must be joints of the
  /// model.
  std::vector<LimitedJoint> limit_joints(Joints& command, double reaction, double holds,
                                         std::size_t robot = 0) const;
  /// Motion of an articulated robot at the newest step; valid until the next command. nullptr: no such robot.
  const RobotMotion* robot_motion(const std::string& agent) const;
  /// For an unknown robot, or one that is not simulated: full supply.
  SupplyState supply_of(const std::string& robot) const;
  /// From the next step on; an unknown name is a drawn part of the building, which is not affected.
  void show(const std::string& agent, AgentShown shown, std::size_t robot = 0);
  /// False: at the newest step the agent was inside the real robot's stopping distance, without a free place
  /// for it.
  bool clear_of_real(const std::string& agent, std::size_t robot = 0) const;

  /// The doors of the building, in the order of the model.
  std::vector<DoorState> doors() const;
  /// Measured opening of a real door, rad from its closed angle; none: not measured. From the next step on;
  /// an instructor's command (DoorCommand) overrides it. Other doors and names are ignored.
  void observe_door(const std::string& door, std::optional<double> opening);
  /// Relations of an entity in the semantic net.
  const std::vector<Relation>& relations_of(const std::string& entity) const;

  /// As seen by one sensor of a real robot, with a number of its own; those of the others stay.
  void set_real_obstacles(const std::vector<RealObstacle>& obstacles, std::size_t sensor = 0);
  /// The real people, in ascending id: bodies (BodyOwner::real_person) that sensors of agents see, that
  /// agents keep clear of and brake before. Contacts are events; a robot that drives into one is
  /// person_touched.
  void set_real_people(const std::vector<RealPerson>& people);
  /// As set last.
  const std::vector<RealPerson>& real_people() const;

  /// The expensive part of set_building(); independent of the simulation, so that another thread may do it.
  /// Error: an entity or a mesh that is not finite.
  static Result<std::shared_ptr<Building>> prepare_building(const SemanticModel& model);

  /// Replaces the building from the next step on: agents and robot keep their poses, and earlier instants are
  /// answered with the old building. Error, and nothing is changed: an entity that is not finite or has an
  /// agent's name, or not enough of `building_bodies` left.
  Status set_building(const SemanticModel& model);
  /// `building`: prepared from the same model, and unused.
  Status set_building(const SemanticModel& model, std::shared_ptr<Building> building);

  SimulationTime now() const;                       ///< instant of the newest state
  SimulationTime next_step() const;                 ///< instant of the next state
  SimulationTime after(std::uint64_t steps) const;  ///< instant of the state after this many steps
  std::uint64_t steps_due(
      SimulationTime until) const;  ///< steps not done yet, with an instant at or before `until`
  /// One fixed step; `real` is the robot at next_step(). Appends due laser requests to `requests`.
  void step_robots(RealRobotStates real, std::vector<LaserRequest>& requests);
  void step(const std::optional<RealRobotState>& real, std::vector<LaserRequest>& requests);
  /// Skips `steps` steps: all motion pauses meanwhile. For a machine that is too slow.
  void skip(std::uint64_t steps);
  /// Agents, the timers of hazards and batteries stand still until begin().
  void wait();
  void begin();
  /// The agent's newest own scan (ranges according to the preset), for its behaviour.
  void give_scan(const std::string& agent, const Scan& scan);

  /// The world at t, interpolated between two steps; extrapolated by up to one step. False: older than the
  /// history or further ahead. A body that is spawned, moved or removed by the later step keeps its state of
  /// the earlier one; it exists from its first step on. Fill `snapshot` only with this function: its memory
  /// is reused, and unmoved bodies are not written again.
  bool at(SimulationTime t, WorldSnapshot& snapshot) const;
  std::shared_ptr<const Scene> scene() const;

  /// Number of agents that the newest step moved without the solver, as no contact was possible.
  std::size_t unconstrained_agents() const;

  /// Events since the last call. A collision's subject is the real robot or else an agent. Its impulse: of
  /// the first step in contact_started, the largest of one step in contact_ended; of the real robot
  /// with the building, mass times closing speed.
  std::vector<Event> take_events();

  /// Reading at the newest step of the hazard sensor on top of the real robot, or of the trainee's simulated
  /// one; the caller sets the stamp. False: no such robot now, or no sources.
  bool hazard_reading(HazardReading& reading, std::size_t robot = 0);

  /// Geometry of promise 3: how far the real robot's footprint can be swept along the arc of `twist` until it
  /// touches the nearest agent, m travelled by the footprint's fastest point (so a turn on the spot has a
  /// distance too), at most `limit`, never overestimated; for a zero twist the current gap. In contact: 0,
  /// unless `twist` moves out of all existing contacts (moving_out), then the distance to the other agents.
  struct Clearance {
    double distance = 0;
    bool moving_out = false;
    std::string agent;  ///< nearest
    /// m, like `distance`, until a part of its arm touches an agent other than what it grips; at most
    /// `limit`.
    double arm_distance = std::numeric_limits<double>::infinity();
  };
  Clearance clearance(const Transform<Map, Base>& T_map_base, const Twist2& twist, double limit,
                      std::size_t robot = 0) const;

 private:
  struct Parts;
  explicit Simulation(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace parhelion::simulation
