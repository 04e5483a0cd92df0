// The sensors of the trainee's robot where that is simulated (levels 1 and 2).
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocols/bus/bus.hpp"
#include "protocols/joints.hpp"
#include "protocols/robot.hpp"
#include "server/simulation/simulation.hpp"
#include "server/tick/imu_model.hpp"
#include "server/tick/percentiles.hpp"
#include "server/tick/wheel_odometry.hpp"

namespace parhelion::tick {

struct Configuration;
struct State;

/// Which of its messages is due at a step: the first that lies at or after each multiple of its period. A
/// loop that skipped steps sends it once.
class Cadence {
 public:
  explicit Cadence(double rate) : rate_(rate) {}
  bool due(Duration since_start);

 private:
  double rate_;  ///< Hz
  std::int64_t last_ = -1;
};

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
  Message message;                    // scratch: what is sent is taken in from here
};

/// What SLAM says of the simulated robot. A map that is still being built has no id, and is the model's as
/// far as SLAM began where the robot did: it is taken for it. How far off it is goes into slam_error_um.
void take_slam_word(const Configuration& configuration, PoseEstimate& estimate, State& state);
/// For the report; empty where the pose is not SLAM's.
std::string slam_note(const State& state);

/// How a head that a sensor sits on is turned in a simulated robot's joints. Error: it lacks one of them.
Result<Transform<Base, Base>> simulated_head(const std::vector<HeadJoint>& head, const Joints& joints);

/// The trainee's simulated robot as agents must reckon with it; nullopt at level 3.
std::optional<simulation::RealRobotState> trainee_state(const Configuration& configuration,
                                                        const State& state);

}  // namespace parhelion::tick
