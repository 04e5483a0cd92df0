// ODOMETRY, IMU, JOINT_STATE, POSE and POSE_COV: the robot's pose at any instant.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fusion/pose/pose_track.hpp"
#include "fusion/pose/scan_refinement.hpp"
#include "fusion/pose/tracks/attitude_track.hpp"
#include "fusion/pose/tracks/joint_track.hpp"
#include "protocols/bus/bus.hpp"
#include "protocols/joints.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/clock_offset.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

struct SimulatedSensors;
struct SiteState;

/// All robots at the newest step, by index; none: the pose is lost.
using RealRobots = std::vector<std::optional<simulation::RealRobotState>>;

/// Encoder position of each joint, and its arrival. At most 256 joints are kept.
using JointPositions = std::map<std::string, std::pair<double, SimulationTime>>;

struct PoseState {
  PoseState(const Configuration& configuration, const RobotDescription& robot);

  pose::PoseTrack track;
  pose::AttitudeTrack attitude;
  pose::JointTrack joints;
  std::optional<pose::ScanRefiner> refiner;  ///< none: scans are not matched
  ClockOffset clock;                         ///< of the robot against the server's
  JointPositions joint_positions;
  Joints joint_state;                    ///< scratch of JOINT_STATE
  OdometryCorrection reported_odometry;  ///< by scans, as in the newest event

  std::optional<simulation::RealRobotState>
      at_this_step;                                  ///< at the last physics step; none: the pose is lost
  pose::NoPose why_unknown = pose::NoPose::no_slam;  ///< of a real robot, at the last step without a pose
  bool known = false;                                ///< as in the newest event
  std::optional<SimulationTime> unknown_since;
  bool relocalized = false;  ///< since the last physics step
};

/// True for a simulated robot without SLAM: its pose is the simulation's.
bool is_exact(const Scenario& scenario);

/// The robot's pose at t: position and heading from SLAM and odometry, roll and pitch from the inertial
/// sensor where known. `why`: the reason if there is none.
std::optional<pose::PoseAtInstant> robot_pose(const PoseState& pose, SensorTime t,
                                              pose::NoPose* why = nullptr);

/// Matches the scan to the map, and corrects the pose track where that succeeds.
pose::RefinedPose match_scan(const Scan& scan, PoseState& pose);

void handle_odometry(const TickContext& context, const Message& input, PoseState& pose);
void handle_imu(const TickContext& context, const Message& input, PoseState& pose);
/// Error: it could not be decoded. Then, and where its stamp is off the robot's clock, PoseState::joint_state
/// is empty.
Status handle_joint_state(const TickContext& context, const Message& input, PoseState& pose);
/// POSE, which has no covariance: the scenario's is used.
void handle_pose(const TickContext& context, const Message& input, PoseState& pose);
/// POSE_COV. For a simulated robot that runs SLAM, the estimate is compared with the true pose: `sensors`,
/// null for a real robot.
void handle_pose_estimate(const TickContext& context, const Message& input, const SiteState& site,
                          const simulation::Simulation& simulation, SimulatedSensors* sensors,
                          PoseState& pose);

}  // namespace parhelion::tick
