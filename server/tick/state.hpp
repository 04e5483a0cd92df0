// All that changes while the server runs. Owned by the loop, touched by the tick alone.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fusion/pose/attitude_track.hpp"
#include "fusion/pose/joint_track.hpp"
#include "fusion/pose/pose_track.hpp"
#include "fusion/scan/augment.hpp"
#include "fusion/scan/unexplained.hpp"
#include "protocols/codec.hpp"
#include "server/simulation/simulation.hpp"
#include "server/simulation/virtual_contact.hpp"
#include "server/tick/clock_offset.hpp"
#include "server/tick/configuration.hpp"
#include "server/tick/executor.hpp"
#include "server/tick/hazard_sensor.hpp"
#include "server/tick/injection_gate.hpp"
#include "server/tick/model_version.hpp"
#include "server/tick/percentiles.hpp"
#include "server/tick/scripts.hpp"

namespace parhelion::tick {

/// Why a scan went out as it came in.
enum class Degraded : std::uint8_t {
  no,
  pose,            ///< the pose track has none; the reason names why
  error,           ///< predicted error above the scenario's limit for every agent in range
  clock,           ///< the stamp disagrees with the robot's clock
  history,         ///< the world at the stamp is no longer, or not yet, known
  robot_mismatch,  ///< the scan does not fit the robot description
  unreadable,      ///< it says that it is a scan, and cannot be decoded
  guard,           ///< no answer in time
  fault,           ///< a broken invariant; the text says which
};
constexpr std::size_t degraded_kinds = 9;
const char* to_string(Degraded why);

/// Counts that the report is made of.
struct Tally {
  std::uint64_t scans_in = 0, scans_out = 0;
  std::uint64_t scans_left_out = 0;  ///< of these, went out as they came and are not in the session log
  std::uint64_t foreign_scans =
      0;  ///< messages on SCAN that are of another type: not sent on, not in scans_in
  std::array<std::uint64_t, degraded_kinds> scans_degraded{};
  std::uint64_t beams_total = 0, beams_replaced = 0;
  std::uint64_t frames_in = 0, frames_out = 0, frames_composited = 0;
  std::uint64_t agent_frames_in = 0, agent_frames_out = 0;  ///< of agents' cameras: due, and published
  std::uint64_t refused_inputs = 0;
  std::string last_refusal;
  std::array<std::uint64_t, static_cast<std::size_t>(kLastEventKind) + 1> events{};  ///< by EventKind
  Percentiles pose_age_us;
  Percentiles slam_us;                              ///< what POSE_COV says of its own step
  std::optional<double> radio_power, battery_left;  ///< of the trainee's simulated robot (SupplyState)
};

/// Buffers of the scan path, warm after the first scans.
struct ScanPath {
  std::uint64_t sequence = 0;
  Scan real, out;
  bool have_real = false;
  std::vector<float> beam_time;
  std::vector<scan::RangeHit> virtual_hits, building_hits;
  bool building_cast = false;                    ///< building_hits hold for this scan
  std::vector<scan::BodyMotion> motions, doors;  ///< what may be injected; what moves of the building
  std::vector<std::int32_t> beam_body;
  WorldSnapshot world_start, world_end;
  ScanInfo info;
  bool live = false;              ///< the last scan was answered with the truth
  std::optional<bool> said_live;  ///< what the newest event says; none: none was said
  SimulationTime last_scan;       ///< arrival of the last scan
};

/// All that any laser of a step may meet, over a sweep that began at `start`.
struct SweptWorld {
  SimulationTime start;
  std::vector<scan::BodyMotion> motions;
  std::vector<scan::BodyGroup> groups;  ///< of each agent
};

/// What one thread casts a simulated laser with.
struct LaserBench {
  scan::RayCaster caster;
  std::vector<float> beam_time;
  std::vector<scan::BodyGroup> groups;  ///< all but its own
  std::vector<scan::RangeHit> body_hits, building_hits;
};

/// A simulated laser that is to be cast: reads the state, and writes to its bench and scan alone.
struct LaserJob {
  const simulation::LaserRequest* request = nullptr;
  std::size_t sweep = 0;  ///< of AgentScanPath::sweeps
  scan::LaserMotion laser;
  scan::NoiseKey key;
  SensorTime stamp;
};

/// The simulated lasers of agents, and of the trainee's robot where it is simulated.
struct AgentScanPath {
  WorldSnapshot world_start, world_end;
  SimulationTime swept;            ///< end of...
  std::vector<SweptWorld> sweeps;  ///< ...these, of which...
  std::size_t sweep_count = 0;     ///< ...so many are of this step
  std::uint64_t sequence = 0;
  std::vector<LaserJob> jobs;
  std::vector<Scan> scans;          ///< of each job
  std::vector<LaserBench> benches;  ///< one for each thread; of a laser that is cast alone the first
};

/// A camera image that waits for the depth image of its moment.
struct WaitingImage {
  Image image;
  std::uint64_t sequence = 0;
  SimulationTime arrival;
};

/// Where the encoders said last that each joint is, and when that arrived. At most 256 joints are kept.
using JointPositions = std::map<std::string, std::pair<double, SimulationTime>>;

struct SimulatedSensors;
struct AgentCameras;
struct DoorSights;
struct LiveGrading;

/// What TELEOP tells of the trainee's dead-man switch, whether a robot hears it or not.
struct DeadMan {
  bool pressed = false;
  ArrivalTime heard;                 ///< the newest TELEOP
  std::optional<ArrivalTime> moved;  ///< the newest that asked for motion...
  double speed = 0;                  ///< ...of the footprint's fastest point, m/s
};

/// What goes wrong on purpose, and whether it does now.
struct HeldLesson {
  Lesson lesson;
  bool holds = false;
};

/// Whom an operator drives, by what the console says.
struct DrivingOperator {
  std::string robot;
  ArrivalTime heard;  ///< of the newest word
};

struct State {
  State(simulation::Simulation simulation_, const Configuration& configuration,
        std::unique_ptr<Executor> executor_);
  ~State();

  simulation::Simulation simulation;
  pose::PoseTrack track;
  pose::AttitudeTrack attitude;
  pose::JointTrack joints;
  ClockOffset robot_clock;
  scan::RayCaster caster;
  InjectionGate gate;
  ScanPath scan;
  HazardResponse hazard_sensor;
  std::unique_ptr<Executor> executor;  ///< runs the jobs of agent_laser
  AgentScanPath agent_laser;
  std::unique_ptr<SimulatedSensors> sensors;    ///< of the trainee's robot where it is simulated
  std::unique_ptr<AgentCameras> agent_cameras;  ///< null: no agent's was ever asked for
  std::vector<simulation::LaserRequest> laser_requests;
  std::vector<simulation::RealObstacle> obstacles;
  SimulationTime obstacles_seen;  ///< arrival of the scan that showed them
  scan::UnexplainedReturns unexplained;
  std::unique_ptr<DoorSights> doors;  ///< null: there are no real ones

  std::uint64_t step = 0;                          ///< physics steps done
  bool relocalized = false;                        ///< since the last physics step
  std::optional<simulation::RealRobotState> real;  ///< at the last physics step
  bool pose_known = false;
  simulation::VirtualContactState contact;
  std::optional<TwistCommand> teleop;  ///< the newest
  ArrivalTime teleop_arrival;
  DeadMan dead_man;
  SimulationTime last_command;  ///< when MR_CMD was last sent
  JointPositions joint_positions;
  Joints joint_state;    ///< scratch of JOINT_STATE
  Joints joint_command;  ///< the newest; empty at the start: nobody moves joints
  ArrivalTime joint_command_arrival;
  SimulationTime last_joint_command;  ///< when MR_JOINT_CMD was last sent
  simulation::HoldReason held = simulation::HoldReason::none;
  bool emergency_stop = false;  ///< of the trainee's robot
  bool joints_stopped = false;  ///< and whoever moves its joints has not let go since it was taken back
  Scripts scripts;
  SimulationTime started;
  std::vector<HeldLesson> lessons;                   ///< the scenario's, then those begun by command
  std::unique_ptr<LiveGrading> grading;              ///< null: the scenario has no training
  std::map<std::string, DrivingOperator> operators;  ///< by their names, those that drive
  std::map<std::string, AgentKind> kinds;            ///< of the agents, for MR_WORLD
  std::uint64_t scene_published = 0;                 ///< version of the scene in the last MR_WORLD
  WorldMessage world_message;

  std::shared_ptr<const SemanticModel> model;   ///< of MR_MODEL; null: the configuration's still holds
  std::uint64_t model_version = 0;              ///< of MR_MODEL; 0: the configuration's
  std::optional<PreparedModel> prepared_model;  ///< for the MR_MODEL that comes next, where it was made ahead

  std::uint64_t frame_sequence = 0;
  std::optional<WaitingImage> waiting_image;
  std::optional<Image> depth;  ///< the newest
  std::optional<Scan> line;    ///< of LINES, the newest

  Tally tally;
};

/// The real robot at t: place and heading from SLAM and odometry, roll and pitch from the inertial sensor
/// where these are known.
std::optional<pose::PoseAtInstant> robot_pose(const State& state, SensorTime t, pose::NoPose* why = nullptr);

/// The world before the first input, its physics clock set to `start`, with the scenario's agents in it.
/// `executor`: casts agents' lasers; what it makes is the same for any size. `solve_all`: SimulationOptions';
/// for comparisons, as no session log records it. Whether the machine has the memory for the agents is not
/// asked.
Result<std::unique_ptr<State>> make_state(
    const Configuration& configuration, ArrivalTime start,
    std::unique_ptr<Executor> executor = std::make_unique<SerialExecutor>(), bool solve_all = false);

}  // namespace parhelion::tick
