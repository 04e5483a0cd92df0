// What a Simulation is made of; its functions are spread over simulation.cpp, commands.cpp, real_robot.cpp,
// contacts.cpp, handling.cpp, supervision.cpp, foresight.cpp, hazard_events.cpp, robot_supply.cpp, doors.cpp,
// door_events.cpp, behaviour.cpp, goals.cpp, coasting.cpp and clearance.cpp.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/simulation/articulated_robot.hpp"
#include "server/simulation/bodies.hpp"
#include "server/simulation/building.hpp"
#include "server/simulation/cable.hpp"
#include "server/simulation/contacts.hpp"
#include "server/simulation/handling.hpp"
#include "server/simulation/hazards.hpp"
#include "server/simulation/history.hpp"
#include "server/simulation/neighbours.hpp"
#include "server/simulation/physics.hpp"
#include "server/simulation/prediction.hpp"
#include "server/simulation/robot_supply.hpp"
#include "server/simulation/router.hpp"
#include "server/simulation/simulation.hpp"
#include "server/simulation/steering.hpp"
#include "server/simulation/supervision.hpp"

namespace parhelion::simulation {

/// An agent's own simulated laser and what its newest scan said.
struct AgentLaser {
  LaserDescription description;
  SimulationTime next;                     ///< when the next scan is due
  SimulationTime asked;                    ///< when the newest was asked for, and...
  Transform<Map, Laser> T_map_laser;       ///< ...where the laser was
  std::optional<SimulationTime> measured;  ///< instant of the points
  std::vector<Footprint> points;           ///< in the map; the nearest of each sector
};

/// The way that an agent is on.
struct AgentRoute {
  std::vector<Eigen::Vector2d> points;
  std::size_t next = 0;  ///< of `points`, to be gone to
  Eigen::Vector2d goal = Eigen::Vector2d::Zero();
  bool asked = false;           ///< a search is under way
  int failures = 0;             ///< since the goal is this one
  bool said = false;            ///< that it is unreachable
  std::uint64_t ask_again = 0;  ///< step; before it none is looked for
};

struct Agent {
  AgentDefinition definition;
  AgentForm form;
  BodyId first_body = 0;
  std::size_t body_count = 0;
  std::uint64_t turn = 0;  ///< steps by which it decides before others: one after another
  PhysicsHandle handle = 0;
  std::unique_ptr<ArticulatedRobot> robot;  ///< of one with a robot model: all that `handle` is not
  std::unique_ptr<Cable> cable;             ///< of a cable: `handle` is its middle
  bool trainee = false;                     ///< the trainee's own robot, simulated
  std::uint64_t key = 0;                    ///< of its name: its stream of random numbers
  std::uint32_t epoch = 0;                  ///< counts spawn and teleports
  double floor = 0;                         ///< m, z that it stands on (upright agents)
  bool frozen = false;
  bool coasts = false;  ///< nothing can touch it now: it is moved without the solver
  AgentShown shown = AgentShown::shown;
  bool clear_of_real = false;  ///< at the newest step, of one that is returning

  RigidState rigid;  ///< at the newest step
  Pose2 pose;
  Footprint placed;  ///< form.footprint at pose
  PartMotion parts;
  std::vector<Transform<Base, Body>> part_poses;  ///< at the newest step
  std::uint32_t part_epoch = 0;                   ///< epoch of part_poses

  Twist2 driven;  ///< what its motors ask for now, after limits of acceleration
  Twist2 teleop;
  std::optional<SimulationTime> teleop_until;
  SteeringState steering;
  AgentRoute route;
  bool arrived = false;  ///< of who follows, flees or blocks: it is where it wants to be
  std::optional<AgentLaser> laser;
  BodyWatch watch;
  Foresight foresight;  ///< of one with a robot model
  RobotSupply supply;
  GripperWatch gripper;
};

constexpr double kDecisionPeriod = 0.05;  // s between two decisions of an agent
constexpr double kStopMargin = 0.15;      // m around where the real robot can stop

struct RealBody {
  std::string name;
  BodyId id = 0;
  PhysicsHandle handle = 0;
  double mass = 0;
  double height = 0;
  RobotLimits limits;
  Footprint footprint;  ///< in base_link
  std::uint32_t epoch = 0;
  bool present = false;    ///< at the newest step
  bool touchable = false;  ///< contacts count: present, and not in the step of a relocalization
  bool sensed = true;
  Footprint placed;  ///< where it was last
  bool ever_present = false;
  RealRobotState last;  ///< where it was last
  std::uint32_t last_epoch = 0;
  BodyWatch watch;
  Foresight foresight;
};

struct Simulation::State {
  State(const SimulationOptions& with, SimulationTime at_start);

  SimulationOptions options;
  double dt;  ///< s
  SimulationTime start;
  std::uint64_t step = 0;

  Physics physics;
  std::shared_ptr<Building> building;
  std::vector<Door> doors;  ///< of the building, ascending id
  RealBody real;
  std::vector<std::unique_ptr<Agent>> agents;  ///< ascending first_body: in the order of their spawns
  std::uint64_t next_turn = 0;
  BodyId next_body = 1;
  /// Buildings have the lowest numbers, so that bodies stay in ascending order when another one is put in.
  BodyId next_building = 1, end_of_buildings = 1;

  std::shared_ptr<const Scene> scene;
  std::shared_ptr<const BodyDefinition> real_definition;
  std::vector<std::shared_ptr<const BodyDefinition>> agent_definitions;
  History history;
  std::vector<Event> events;
  ContactTracker contacts;
  std::vector<HazardState> hazards;  ///< as options.hazards
  Router router;
  Neighbours neighbours;  ///< of agents, by index
  std::vector<RealObstacle> real_obstacles;
  std::vector<Footprint> real_discs;

  // Memory that is used again and again.
  std::vector<const FixedObstacle*> near;
  std::vector<Transform<Base, Body>> poses;
  SteeringScratch steering;
  std::vector<Footprint> fair_zone;
  std::vector<Router::Answer> route_answers;
  std::vector<TouchingPair> touching;
  std::vector<JointIncident> incidents;
  std::vector<FingerForce> finger_forces;
  Footprint moved_real, own_disc;
  std::vector<std::uint32_t> nearby;

  SimulationTime stamp_of(std::uint64_t number) const {
    return start + seconds(static_cast<double>(number) / options.rate);
  }
  Agent* find(const std::string& name);
  void rebuild_scene();
  void record();
  void append_states(Agent& agent, std::vector<BodyState>& bodies);
  void observe_robot(Agent& agent);
  void observe_cable(Agent& agent);

  // real_robot.cpp
  void move_real(const std::optional<RealRobotState>& now);
  /// Sets where it is for what must not be near it, without moving its body.
  void clear_return_of_real(const RealRobotState& now, bool all);
  /// Where the robot cannot help being within its stopping distance: footprints along its arc, with a margin.
  /// `later`: s that it goes on before it brakes, beyond its reaction time.
  void stop_zone(const RealRobotState& now, std::vector<Footprint>& zone, double later = 0) const;

  // commands.cpp
  Status check_definition(const AgentDefinition& agent, bool trainee) const;
  Status check_behaviour(const AgentDefinition& agent) const;
  Status check_goals(const AgentDefinition& agent) const;
  /// Empty: the place is free for `form` at `pose`; else what is in the way.
  std::string occupied(const AgentForm& form, const Pose2& pose, const Agent* except,
                       const std::vector<Footprint>& zone);
  std::optional<Pose2> nearest_free(const AgentForm& form, const Pose2& pose, const Agent* except,
                                    const std::vector<Footprint>& zone);
  Status check_model(const AgentDefinition& agent) const;
  std::shared_ptr<const RobotModel> find_model(const std::string& name) const;
  AgentForm form_of(const AgentDefinition& agent) const;
  Status check_place(const AgentDefinition& agent, const Agent* except,
                     const std::optional<RealRobotState>& now);
  void put(Agent& agent, const Pose2& pose);
  Status spawn(const AgentDefinition& definition, const std::optional<RealRobotState>& now,
               std::uint64_t request, bool trainee = false);
  Status apply(const AgentSpawn& command, const std::optional<RealRobotState>& now);
  Status apply(const AgentMove& command, const std::optional<RealRobotState>& now);
  Status apply(const AgentBehaviour& command);
  Status apply(const AgentRemove& command);
  Status apply(const AgentFreeze& command);
  void remove(std::size_t index, std::uint64_t request);
  Status unknown(const std::string& name) const;
  void say(EventKind kind, const Agent& agent, std::uint64_t request, std::string text);

  // behaviour.cpp
  void drive_agents();
  bool decides(const Agent& agent) const;
  Twist2 wanted(Agent& agent);
  Twist2 decide(Agent& agent);
  Twist2 wander(Agent& agent);
  Twist2 patrol(Agent& agent);
  Status fit_laser(Agent& agent);
  bool held_still(const Agent& agent) const;
  void gather_obstacles(const Agent& agent, double range);
  void move_parts(Agent& agent);
  void ask_lasers(std::vector<LaserRequest>& requests);

  // coasting.cpp
  /// Nothing can touch it before it decides again.
  bool alone(const Agent& agent);
  void set_coasting(Agent& agent, bool coasts);
  /// One step of one that coasts.
  void coast(Agent& agent);
  void wake_all();
  /// Those that may be touched by what appears there.
  void wake_near(const Footprint& placed);

  // goals.cpp
  struct Target {
    Pose2 pose;
    Twist2 twist;  ///< body frame
    const Footprint* placed;
    bool is_trainee;  ///< whom nobody may surprise, real or simulated
  };
  std::optional<Target> target_of(const Behaviour& behaviour);
  /// Into fair_zone, where an agent that acts on the trainee's robot must not go.
  void gather_fair_zone(const Target& target);
  RouteGrid& grid_of(const Agent& agent);
  RouteQuery query_to(const Agent& agent, const Eigen::Vector2d& goal, bool round_agents);
  /// Whether it can go there straight, past building and closed doors.
  bool sees(const Agent& agent, const Eigen::Vector2d& p);
  void ask_route(Agent& agent, const Eigen::Vector2d& goal, bool round_agents);
  void take_routes();
  void forget_route(Agent& agent);
  std::optional<Eigen::Vector2d> lead(Agent& agent, const Eigen::Vector2d& goal);
  std::optional<Twist2> straight_to(const Agent& agent, const Eigen::Vector2d& point);
  Twist2 drive_to(Agent& agent, const Eigen::Vector2d& point, const Eigen::Vector2d& goal);
  Twist2 approach(Agent& agent, const Eigen::Vector2d& goal);
  Twist2 go(Agent& agent);
  Twist2 follow(Agent& agent);
  Twist2 flee(Agent& agent);
  Twist2 block(Agent& agent);
  std::optional<Twist2> step_aside(Agent& agent);
  // doors.cpp
  DoorRules door_rules() const { return {options.level, options.doors}; }
  Door* find_door(const std::string& name);
  /// Before the physics: leaves that are said to stand elsewhere, closers.
  void move_doors();
  void work_hinge(Door& door);
  /// Whether the agent opens that leaf by walking on.
  bool walks_through(const Agent& agent, const FixedObstacle& leaf) const;
  /// Off its hinge, with the impulse that broke it (N s).
  void unhinge(Door& door, double impulse);
  /// After it: where the leaves are now, and what broke.
  void read_doors();
  /// From the old building's doors to the new one's of the same make.
  void keep_doors(const std::vector<Door>& old);
  void record_doors(std::vector<BodyState>& bodies) const;
  Status set_door(const DoorCommand& command);
  Status unknown_door(const std::string& name) const;
  /// Puts a leaf there at once.
  void put_leaf(Door& door, double angle);

  // door_events.cpp: opened and closed, who is in the opening.
  void watch_doors();
  void say_door(EventKind kind, Door& door, double value);
  void watch_space(Door& door);
  void pass_space(Door& door, const std::string& who, bool enters, PairKind pair, bool unsensed,
                  const Eigen::Vector3d& position);

  // contacts.cpp
  void track_contacts();
  void collect_body_contacts();
  void collect_building_contacts();

  // handling.cpp
  void watch_grippers();
  std::optional<HandledBody> handled(const std::string& name);

  // supervision.cpp
  void supervise();

  // hazard_events.cpp
  /// Of one whose agent, if it is one, exists.
  Eigen::Vector3d place_of(const Hazard& hazard);
  void watch_hazards();
  /// `nearest`: m, in the plane; at most so far at the call.
  void watch_nearness(const Hazard& hazard, const Eigen::Vector3d& place, double& nearest, std::string& who,
                      PairKind& pair);
  double read_sources(HazardKind kind, const Eigen::Vector3d& p);

  // robot_supply.cpp
  void watch_radio(Agent& agent, const ObservedMotion& motion);
  void watch_battery(Agent& agent, const ObservedMotion& motion);

  // foresight.cpp
  /// Whose way is looked along, and how.
  struct Looking {
    const std::string* name;
    MovingFootprint own;
    const Footprint& placed;
    Eigen::Vector2d center;
    double margin;       ///< m from the building that is a contact
    double bottom, top;  ///< m, z of what it can hit
    double climb;        ///< m over `bottom` up to which steps beside it are no obstacle
    bool is_virtual, unsensed;
    double speed;  ///< m/s of its fastest point
    NearMissWatch& misses;
    /// So fast that a near miss is its own.
    bool moves() const { return speed > NearMissWatch::kCareful; }
  };
  void foresee_real(const ObservedMotion& motion);
  void foresee(Agent& agent, const ObservedMotion& motion);
  /// `self`: none of the real robot.
  std::optional<Ahead> look_ahead(const Looking& from, const Agent* self);
  void foresee_collisions(const Looking& from, const Agent* self, const Supervised& body,
                          const ObservedMotion& motion, Foresight& foresight);
  void look_beside(const Looking& from, const Footprint& placed, const std::string& name, PairKind pair,
                   bool unsensed);
  void look_at_building(const Looking& from, std::optional<Ahead>& ahead);
  void look_at_body(const Looking& from, const MovingFootprint& other, const Footprint& placed,
                    const std::string& name, bool is_virtual, bool unsensed, std::optional<Ahead>& ahead);
};

SteeringLimits limits_of(const Agent& agent);
bool finite(const Twist2& twist);

/// Seeds an agent's random stream from its name (FNV-1a).
std::uint64_t name_key(const std::string& name);

}  // namespace parhelion::simulation
