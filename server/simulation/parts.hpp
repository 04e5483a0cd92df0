// The parts of a Simulation. Each part has its data and its functions; operations on several parts are in
// step.cpp and commands.cpp.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/simulation/behaviour/agent_motion.hpp"
#include "server/simulation/behaviour/behaviour.hpp"
#include "server/simulation/events/contacts.hpp"
#include "server/simulation/events/grippers.hpp"
#include "server/simulation/events/hazards.hpp"
#include "server/simulation/events/pose_conflicts.hpp"
#include "server/simulation/events/predictor.hpp"
#include "server/simulation/recorder.hpp"
#include "server/simulation/simulation.hpp"
#include "server/simulation/world/surroundings.hpp"
#include "server/simulation/world/unconstrained_motion.hpp"

namespace parhelion::simulation {

/// Ids of the buildings' bodies. They are the lowest ones, so that bodies stay in ascending order when
/// another building is inserted.
struct BuildingNumbers {
  BodyId next = 1, end = 1;
};

struct Simulation::Parts {
  Parts(const SimulationOptions& with, SimulationTime start);

  const SimulationOptions options;
  StepClock clock;
  Physics physics;
  BuildingNumbers building_numbers;
  Environment environment;
  RealRobots real_robots;
  Agents agents;
  Neighbours neighbours;
  Behaviours behaviours;
  ContactForecast forecast;
  Contacts contacts;
  Grippers grippers;
  PoseConflicts pose_conflicts;
  Predictor predictor;
  std::optional<Hazards> hazards;  ///< set by create(), as it needs the building
  Recorder recorder;
  std::vector<Event> events;  ///< since the last take_events()
  Footprint swept;            ///< reused memory of clearance()

  Surroundings surroundings() const { return {options, clock, environment, real_robots, agents, neighbours}; }
  void publish(Event event) { events.push_back(std::move(event)); }
  /// Call after bodies were added or removed.
  void rebuild_scene();

  // step.cpp
  /// One fixed step: an outline of the simulation.
  void step(RealRobotStates states, std::vector<LaserRequest>& requests);
  void move_real_robots(RealRobotStates states);
  void move_real_robot(RealRobot& robot, const std::optional<RealRobotState>& state);
  /// Moves agents that appear to the robot's sensors (`all`, or only returning ones) within its stopping
  /// distance to the nearest free place.
  void clear_stop_zone(const RealRobot& robot, const RealRobotState& state, bool all);

  // commands.cpp
  Status spawn(const AgentDefinition& definition, RealRobotStates states, std::uint64_t request,
               bool trainee = false);
  /// A movable object of the site, where the model has it. Error: it is not finite, or its name is taken.
  Status add_object(const ModelObject& object);
  void enter_physics(Agent& agent);
  /// Moves the agent there: a new epoch, without interpolation. `bottom`: m, z of its underside; none: on the
  /// floor.
  void put(Agent& agent, const Pose2& pose, std::optional<double> bottom = std::nullopt);
  /// Error: what it follows, flees or blocks is not there.
  Status check_target(const Behaviour& behaviour) const;
  Status apply(const AgentSpawn& command, RealRobotStates states);
  Status apply(const AgentMove& command, RealRobotStates states);
  Status apply(const AgentBehaviour& command, RealRobotStates states);
  Status apply(const AgentRemove& command, RealRobotStates states);
  Status apply(const AgentFreeze& command, RealRobotStates states);
  void remove(std::size_t index, std::uint64_t request);
};

}  // namespace parhelion::simulation
