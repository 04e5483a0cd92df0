// The sensors of the trainee's simulated robot (levels 1 and 2).
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
struct FurtherLaser;
struct InjectionState;
struct LaserState;
struct PoseState;
struct ScanState;
struct SiteState;

/// A planar laser of the simulated robot.
struct SimulatedLaser {
  Cadence clock;
  simulation::LaserRequest request;  ///< the part that is constant from scan to scan
};

/// A camera of the simulated robot, and the depth camera that belongs to it.
struct SimulatedCameras {
  std::optional<Cadence> camera_clock;  ///< of either kind; none: there is no camera
  std::optional<Cadence> depth_clock;   ///< none: there is no depth camera
};

struct SimulatedSensors {
  SimulatedSensors(const Configuration& configuration, const simulation::RobotModel& model,
                   SimulationTime start);

  SimulationTime start;
  Cadence robot, imu_clock, joints_clock, bumper_clock, odometry_clock, pose_clock;
  std::vector<SimulatedCameras> cameras;  ///< the first, then further ones
  WheelOdometry odometry;
  std::optional<ImuModel> imu;
  std::uint32_t imu_epoch = 0;
  std::vector<std::string> bumpers;    ///< links, in the model's order
  std::vector<std::string> touching;   ///< in the last BUMPER
  std::vector<SimulatedLaser> lasers;  ///< the first, then further ones
  Percentiles slam_error_um;           ///< of POSE_COV in the plane, against the true position
  Joints joints;                       // scratch
  WorldSnapshot truth;                 // scratch
  Message message;                     // scratch: the newest published
};

/// Dependencies of the simulated sensors.
struct SensorPath {
  SimulatedSensors& sensors;
  PoseState& pose;
  ScanState& scan;
  InjectionState& injection;
  std::vector<FurtherLaser>& further_lasers;
  CameraState& camera;
  std::vector<CameraState>& further_cameras;
  LaserState& lasers;
  const FaultState& faults;
  const SiteState& site;
  simulation::Simulation& simulation;
};

/// Publishes the measurements of the newest step. They are outputs that are also handled at once as inputs,
/// like messages arriving from a real robot.
void publish_sensors(const TickContext& context, const SensorPath& path);

/// Spawns the trainee's robot in the simulation, with its sensors. Null at level 3.
Result<std::unique_ptr<SimulatedSensors>> spawn_trainee(const Configuration& configuration,
                                                        simulation::Simulation& simulation);

/// Checks SLAM's pose estimate of the simulated robot. A map still being built has no id; it matches the
/// model because SLAM started at the robot's start, so the estimate gets the model's id. The error is added
/// to slam_error_um.
void check_slam_estimate(const Configuration& configuration, const SiteState& site,
                         const simulation::Simulation& simulation, SimulatedSensors& sensors,
                         PoseEstimate& estimate);
/// Text for the report; empty where the pose is not from SLAM. `sensors`: null at level 3.
std::string slam_note(const SimulatedSensors* sensors);

/// The trainee's simulated robot as an obstacle for agents; nullopt at level 3.
std::optional<simulation::RealRobotState> trainee_state(const Configuration& configuration,
                                                        const simulation::Simulation& simulation);

}  // namespace parhelion::tick
