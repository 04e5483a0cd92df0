// All state that changes while the server runs. Owned by the loop, modified only by the tick. Each path has
// its own part, declared in the path's header; its further dependencies are in its <Name>Path struct.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/simulation/simulation.hpp"
#include "server/tick/agent_cameras.hpp"
#include "server/tick/camera_path.hpp"
#include "server/tick/command_path.hpp"
#include "server/tick/configuration.hpp"
#include "server/tick/door_tracker.hpp"
#include "server/tick/encoders.hpp"
#include "server/tick/executor.hpp"
#include "server/tick/fault_path.hpp"
#include "server/tick/grading_path.hpp"
#include "server/tick/injection_path.hpp"
#include "server/tick/instructor_path.hpp"
#include "server/tick/laser_path.hpp"
#include "server/tick/model_path.hpp"
#include "server/tick/operator_path.hpp"
#include "server/tick/people_path.hpp"
#include "server/tick/pose_path.hpp"
#include "server/tick/scan_path.hpp"
#include "server/tick/scan_silence.hpp"
#include "server/tick/script_path.hpp"
#include "server/tick/scripts.hpp"
#include "server/tick/sensor_path.hpp"
#include "server/tick/start_path.hpp"
#include "server/tick/tally.hpp"
#include "server/tick/tick_context.hpp"
#include "server/tick/world_path.hpp"

namespace parhelion::tick {

/// A robot that is not an agent: real, or the trainee's simulated one.
struct RobotState {
  RobotState(const Configuration& configuration, std::size_t index);

  std::string name;
  std::size_t index = 0;  ///< in State::robots
  PoseState pose;
  EncoderState encoders;
  ScanState scan;                            ///< of the first laser
  std::vector<FurtherLaser> further_lasers;  ///< in the order of the description
  PeopleState people;                        ///< whom the first laser shows
  InjectionState injection;
  CameraState camera;                        ///< the first
  std::vector<CameraState> further_cameras;  ///< in the order of the description
  ScanSilence scan_silence;
  CommandState command;
  HazardMeters hazard_meters;
  std::unique_ptr<SimulatedSensors> sensors;  ///< null: a real robot
};

struct State {
  State(simulation::Simulation simulation_, const Configuration& configuration,
        std::unique_ptr<Executor> executor);

  simulation::Simulation simulation;
  std::vector<RobotState> robots;  ///< in the order of the configuration
  RealRobots real;                 ///< the same, at the newest step
  Bystanders bystanders;
  SiteState site;
  DoorTracker doors;
  LaserState lasers;
  AgentCameras agent_cameras;
  WorldState world;
  Scripts scripts;
  FaultState faults;
  Operators operators;
  OperatorAdmission operator_admission;
  bool waiting = false;                            ///< for the start of the training
  std::optional<SimulationTime> operator_refused;  ///< when that was last reported
  std::unique_ptr<LiveGrading> grading;            ///< null: the scenario has no training
  Tally tally;

  /// The robot of that name, which must exist.
  RobotState& robot(std::string_view name);

  TickContext context(const Configuration& configuration, SimulationTime now, Outputs& outputs,
                      std::size_t robot = 0);
  ScanPath scan_path(RobotState& robot, std::size_t laser = 0);
  PeoplePath people_path(RobotState& robot, std::size_t laser = 0);
  DepthPeoplePath depth_people_path(RobotState& robot, std::size_t camera = 0);
  CameraPath camera_path(RobotState& robot, std::size_t camera = 0);
  CommandPath command_path(RobotState& robot);
  AgentPath agent_path();
  InstructorPath instructor_path();
  ScriptPath script_path();
  StartPath start_path();
  OperatorPath operator_path(const TickContext& context);
  SensorPath sensor_path(RobotState& robot);  ///< of a simulated robot
};

/// The state before the first input, with the physics clock at `start` and the scenario's agents. `executor`:
/// casts agents' lasers; results do not depend on its size. `solve_all`: see SimulationOptions; for
/// comparisons, as no session log records it. Does not check whether memory suffices for the agents.
Result<std::unique_ptr<State>> make_state(
    const Configuration& configuration, ArrivalTime start,
    std::unique_ptr<Executor> executor = std::make_unique<SerialExecutor>(), bool solve_all = false);

}  // namespace parhelion::tick
