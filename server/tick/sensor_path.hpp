// The sensors of the trainee's robot where that is simulated (levels 1 and 2).
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/joints.hpp"
#include "protocols/pose.hpp"
#include "protocols/world.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/cadence.hpp"
#include "server/tick/imu_model.hpp"
#include "server/tick/percentiles.hpp"
#include "server/tick/tick_context.hpp"
#include "server/tick/wheel_odometry.hpp"

namespace parhelion::tick {

struct CameraState;
struct FaultState;
struct InjectionState;
struct LaserState;
struct PoseState;
struct ScanState;
struct SiteState;

struct SimulatedSensors {
  SimulatedSensors(const Configuration& configuration, const simulation::RobotModel& model,
                   SimulationTime start);

  SimulationTime start;
  Cadence robot, imu_clock, joints_clock, bumper_clock, odometry_clock, pose_clock, scan_clock;
  std::optional<Cadence> camera_clock;  ///< of whatever camera it has; none: it has no camera
  std::optional<Cadence> depth_clock;   ///< among the camera's; none: it has no depth camera
  WheelOdometry odometry;
  std::optional<ImuModel> imu;
  std::uint32_t imu_epoch = 0;
  std::vector<std::string> bumpers;   ///< links, as the model lists them
  std::vector<std::string> touching;  ///< of the last BUMPER
  simulation::LaserRequest laser;     ///< what stays the same from scan to scan
  Percentiles slam_error_um;          ///< of POSE_COV in the plane, against where the robot was
  Joints joints;                      // scratch
  WorldSnapshot truth;                // scratch
  Message message;                    // scratch: the newest that was sent
};

/// What the simulated sensors work on.
struct SensorPath {
  SimulatedSensors& sensors;
  PoseState& pose;
  ScanState& scan;
  InjectionState& injection;
  CameraState& camera;
  LaserState& lasers;
  const FaultState& faults;
  const SiteState& site;
  simulation::Simulation& simulation;
};

/// What the sensors measure at the newest step: outputs that are handled at once, as a real robot's are when
/// they arrive.
void publish_sensors(const TickContext& context, const SensorPath& path);

/// The trainee's robot into the simulation, with its sensors. Null at level 3.
Result<std::unique_ptr<SimulatedSensors>> spawn_trainee(const Configuration& configuration,
                                                        simulation::Simulation& simulation);

/// SLAM's estimate of the simulated robot's pose. A map that is still being built has no id, and is the
/// model's as far as SLAM began where the robot did: the estimate gets that. Its error goes into
/// slam_error_um.
void check_slam_estimate(const Configuration& configuration, const SiteState& site,
                         const simulation::Simulation& simulation, SimulatedSensors& sensors,
                         PoseEstimate& estimate);
/// For the report; empty where the pose is not SLAM's. `sensors`: null at level 3.
std::string slam_note(const SimulatedSensors* sensors);

/// The trainee's simulated robot as agents must reckon with it; nullopt at level 3.
std::optional<simulation::RealRobotState> trainee_state(const Configuration& configuration,
                                                        const simulation::Simulation& simulation);

}  // namespace parhelion::tick
