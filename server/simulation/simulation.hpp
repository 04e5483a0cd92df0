// The rigid-body world: agents, the real robot as a kinematic body, the building; fixed steps; two seconds of
// states. The parts of this class are simulation.cpp (creation, buildings, queries), step.cpp (what a step
// does) and commands.cpp (commands to agents, robots and doors); parts.hpp lists what it is made of.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocols/event.hpp"
#include "protocols/hazard.hpp"
#include "protocols/instructor_command.hpp"
#include "protocols/joints.hpp"
#include "protocols/model.hpp"
#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"
#include "protocols/status.hpp"
#include "protocols/world.hpp"
#include "protocols/zone.hpp"
#include "server/simulation/robot_model.hpp"
#include "server/simulation/robot_motion.hpp"

namespace parhelion::simulation {

class Building;

/// Where the real robot is known to be at a step; absent: its body is suspended (no contacts).
struct RealRobotState {
  Transform<Map, Base> T_map_base;
  bool attitude_known = false;  ///< roll and pitch are measured
  Twist2 twist;                 ///< body frame, from odometry, never differenced from corrections
  double sigma = 0;             ///< m, 1 sigma of its position: the margin of distance queries
  bool relocalized = false;     ///< teleport: no velocity, contacts suspended for this step
  /// False while injection is degraded: contacts are flagged unsensed, agents near freeze; when it comes
  /// back, an agent inside the stopping distance is put to the nearest free place outside (event
  /// agent_moved).
  bool sensed = true;
};

/// A short-lived real obstacle that the model does not explain (people): a disc in the map.
struct RealObstacle {
  Eigen::Vector2d center;
  double radius = 0.2;
};

/// Whether the real robot's sensors show an agent now, where they show any. One that they withhold
/// freezes near the robot and contacts with it are unsensed; one that is returning is kept out of the
/// stopping distance as well (event agent_moved), until it is shown.
enum class AgentShown : std::uint8_t { shown, withheld, returning };

struct SimulationOptions {
  double rate = 240;  ///< Hz
  Duration history = seconds(2.0);
  std::uint64_t seed = 1;
  std::size_t most_agents = 1000;
  BodyId building_bodies = 0;  ///< numbers kept for the bodies of later buildings (set_building)
  /// The library of articulated robots: AgentDefinition::model is the name of one of them.
  std::vector<std::shared_ptr<const RobotModel>> robot_models;
  /// The reference implementation: agents that nothing can touch go through the solver like the others. The
  /// same to rounding.
  bool solve_all = false;
  std::vector<Zone> zones;  ///< whose entering and leaving are events
  std::vector<Hazard> hazards;
  std::optional<Radio> radio;      ///< none: simulated robots are in reach everywhere
  std::optional<Battery> battery;  ///< none: theirs last for ever
  int level = 3;  ///< at levels 1 and 2 all doors move by themselves, at level 3 only virtual ones
  std::vector<DoorSettings> doors;  ///< settings of some of the building's; other names are ignored
};

/// An agent's laser wants a scan: the server casts it (fusion/scan) and hands it back with give_scan.
struct LaserRequest {
  std::string agent;
  SimulationTime stamp;
  Transform<Map, Laser> T_map_laser;
  LaserDescription laser;
  std::vector<BodyId> own_bodies;  ///< not to be seen by itself
};

/// How a door stands at the newest step.
struct DoorState {
  std::string name;
  double opening = 0;    ///< rad, turned from where it closes its opening (protocols/door.hpp)
  bool known = true;     ///< false: a real door that no sensor sees; the opening is the last that was known
  bool dynamic = false;  ///< it moves by itself; else it is real, and as sensors and the instructor report
  bool unhinged = false;
  Transform<Map, Body> T_map_leaf;  ///< at the centre of the leaf
};

/// What a simulated robot has left at the newest step; figures are there where the scenario asks for them.
struct SupplyState {
  std::optional<double> radio_power;  ///< dBm that it receives from its operator's console
  bool radio_lost = false;
  std::optional<double> battery_left;  ///< fraction, 0..1
  bool battery_empty = false;
};

/// Deterministic: same calls, same states, bit for bit. One thread.
class Simulation {
 public:
  static Result<Simulation> create(const SimulationOptions& options, const SemanticModel& model,
                                   const RobotDescription& robot, SimulationTime start);
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;
  ~Simulation();

  /// Does the command or reports why not; a refused place is answered with the nearest free one in the text,
  /// an unknown name with the nearest known one. `real` is the robot now, for what must not appear on it or
  /// inside its stopping distance v r + v^2 / (2 a) plus a margin. What was done is appended to the events
  /// (agent_spawned, agent_moved, agent_removed, with the request's number); command_accepted and
  /// command_refused are published by the server.
  Status command(const AgentCommand& command, const std::optional<RealRobotState>& real);
  /// Puts a simulated door's leaf there, or sets where a real one's is. Error: no such door, off its hinge,
  /// or an opening that it does not have.
  Status set_door(const DoorCommand& command);
  Status spawn(const AgentDefinition& agent, const std::optional<RealRobotState>& real);
  /// The trainee's robot where it is simulated (levels 1 and 2): an articulated robot whose bodies are the
  /// real robot's (BodyOwner::real_robot, never injected), driven by teleop(); the kinematic body of the real
  /// one stays suspended (step() with none). It may have the robot description's name. Error: no model, a
  /// second one, or as spawn(). Commands may move it, not remove it.
  Status spawn_trainee(const AgentDefinition& trainee);
  /// The definition (with the behaviour of now) of an agent that exists, or nullptr; valid until the next
  /// command.
  const AgentDefinition* find_agent(const std::string& name) const;
  /// Where an agent is at the newest step; none: there is no such agent.
  std::optional<Transform<Map, Base>> pose_of(const std::string& agent) const;
  /// The command of an agent that is teleoperated; holds for 0.5 s. One that is out of radio range does not
  /// receive it.
  void teleop(const std::string& agent, const Twist2& twist);
  /// Wheels or tracks of these sides of an articulated robot do not turn, until the next call; an
  /// unknown name is ignored.
  void block_sides(const std::string& agent, bool left, bool right);
  /// Positions, or else velocities, or else efforts of an articulated robot's joints. A position holds until
  /// the next command (velocities beside it bound how fast it is gone for); velocities and efforts hold for
  /// 0.5 s, then the joint stays where it is. What is beyond a limit goes to the limit. Error: an unknown
  /// robot; joints that it has not (the others are commanded); values that are not finite or not one for each
  /// name (none is commanded); an empty battery.
  Status joint_command(const std::string& agent, const Joints& joints);
  /// Joints that broke hold again, where they started; event joints_restored. Error: an unknown robot.
  Status restore_joints(const std::string& agent, std::uint64_t request = 0);
  /// How an articulated robot moves at the newest step; valid until the next command. nullptr: there is no
  /// such robot.
  const RobotMotion* robot_motion(const std::string& agent) const;
  /// Of a robot that is not simulated, or not there: nothing is lost.
  SupplyState supply_of(const std::string& robot) const;
  /// From the next step on; an unknown name is a drawn part of the building, which stays where it is.
  void show(const std::string& agent, AgentShown shown);
  /// False: at the newest step the agent was inside the real robot's stopping distance, and there was no free
  /// place for it.
  bool clear_of_real(const std::string& agent) const;

  /// The doors of the building, in the order of the model.
  std::vector<DoorState> doors() const;
  /// What sensors measure of a real door: rad from where it closes its opening, or nothing. From the
  /// next step on; an instructor's command (DoorCommand) overrides it. Other doors and names are
  /// ignored.
  void observe_door(const std::string& door, std::optional<double> opening);
  /// Of the semantic net: what relates to the entity of an event.
  const std::vector<Relation>& relations_of(const std::string& entity) const;

  void set_real_obstacles(const std::vector<RealObstacle>& obstacles);

  /// What takes time of set_building(); needs no simulation, so that another thread may do it. Error: an
  /// entity or a mesh that is not finite.
  static Result<std::shared_ptr<Building>> prepare_building(const SemanticModel& model);

  /// Puts another building in the old one's place, from the next step on: agents and robot stay where they
  /// are, and what was before is still answered with the old one. Error, and nothing is changed: an entity
  /// that is not finite or has an agent's name, or no more than `building_bodies` are left.
  Status set_building(const SemanticModel& model);
  /// `building`: of the same model, prepared and not used before.
  Status set_building(const SemanticModel& model, std::shared_ptr<Building> building);

  SimulationTime now() const;                       ///< instant of the newest state
  SimulationTime next_step() const;                 ///< instant of the state that step() would make
  SimulationTime after(std::uint64_t steps) const;  ///< instant of the state so many steps on
  std::uint64_t steps_due(
      SimulationTime until) const;  ///< not done yet, with an instant at or before `until`
  /// One fixed step; `real` is the robot at next_step(). Laser requests that fall due are appended to
  /// `requests`.
  void step(const std::optional<RealRobotState>& real, std::vector<LaserRequest>& requests);
  /// Lets `steps` pass without doing them: everything stands still meanwhile. For a machine that fell behind.
  void skip(std::uint64_t steps);
  /// The agent's newest own scan (ranges as the preset writes them), for its behaviour.
  void give_scan(const std::string& agent, const Scan& scan);

  /// The world at t, interpolated between two steps; up to one step ahead is extrapolated. False: older than
  /// the history or further ahead. A body that is spawned, moved or removed by the later step stays as the
  /// earlier one has it; it is there from its first step on. `snapshot` is to be filled by this function
  /// only: its memory is reused, and what does not move is not written again.
  bool at(SimulationTime t, WorldSnapshot& snapshot) const;
  std::shared_ptr<const Scene> scene() const;

  /// How many agents the newest step moved without the solver, as nothing could touch them.
  std::size_t coasting() const;

  /// Events since the last call. A collision's subject is the real robot or else an agent. Its impulse: of
  /// the first step in collision_started, the largest of one step in collision_stopped; of the real robot
  /// with the building, mass times closing speed.
  std::vector<Event> take_events();

  /// What the hazard sensor of the real robot (of the trainee's simulated one, where there is no real one),
  /// on its top, reads at the newest step; the stamp is the caller's. False: there is no such robot now, or
  /// there are no sources.
  bool hazard_reading(HazardReading& reading);

  /// Promise 3's geometry: how far the real robot's footprint can be swept along the arc of `twist` until it
  /// touches the nearest agent, m travelled by the footprint's fastest point (so a turn on the spot has a
  /// distance too), at most `limit`, never more than there is; for a zero twist the gap as it is. In a
  /// contact: 0, unless `twist` moves out of all contacts that exist (moving_out), then the distance to the
  /// other agents.
  struct Clearance {
    double distance = 0;
    bool moving_out = false;
    std::string agent;  ///< nearest
  };
  Clearance clearance(const Transform<Map, Base>& T_map_base, const Twist2& twist, double limit) const;

 private:
  struct Parts;
  explicit Simulation(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

/// The bodies of an agent at its origin: what lasers hit and cameras see.
std::vector<BodyDefinition> agent_bodies(const AgentDefinition& agent, BodyId first_id);

}  // namespace parhelion::simulation
