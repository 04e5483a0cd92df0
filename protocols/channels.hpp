// Channel names on the bus; every one can be remapped by the scenario. docs/reference/messages.md is
// generated from the comments here: message type, direction as seen from the server, meaning.
#pragma once

namespace parhelion::channel {

/// robot_t, in or out: description of the real robot, as YAML; out where the robot is simulated.
inline constexpr const char* kRobot = "ROBOT";
/// planar_lidar_t or lidar_t, in or out: scans of the robot's laser, unchanged from the sensor.
inline constexpr const char* kScan = "SCAN";
/// planar_lidar_t or lidar_t, in: scans of a second laser that is swept over the site, to build a model of
/// it.
inline constexpr const char* kLines = "LINES";
/// pose2D_t, in or out: wheel odometry.
inline constexpr const char* kOdometry = "ODOMETRY";
/// pose_cov_t, in or out: pose of the robot in the map with its covariance, from SLAM or another
/// localization.
inline constexpr const char* kPoseCov = "POSE_COV";
/// pose_t, in or out: pose without covariance, used where the scenario asks for it.
inline constexpr const char* kPose = "POSE";
/// pose_t, in: pose that estimates are compared with, for example from a motion capture system. Not used
/// while driving.
inline constexpr const char* kReferencePose = "REFERENCE_POSE";
/// image_t, in or out: images of the robot's camera.
inline constexpr const char* kCamera = "CAMERA";
/// image_t, in or out: images of the robot's depth camera.
inline constexpr const char* kDepth = "DEPTH";
/// imu_t or mbot_imu_t, in or out: samples of the inertial sensor.
inline constexpr const char* kImu = "IMU";
/// twist2D_t or mbot_motor_command_t, in: velocity commanded by the trainee.
inline constexpr const char* kTeleop = "TELEOP";
/// joints_t, in or out: positions of the joints, from encoders.
inline constexpr const char* kJointState = "JOINT_STATE";
/// joints_t, in: joint motion commanded by the trainee.
inline constexpr const char* kJointCmd = "JOINT_CMD";
/// joints_t, out: bumpers of a simulated robot by their links; position 1: in contact, 0: not.
inline constexpr const char* kBumper = "BUMPER";
/// operator_t, in: which operator drives which robot.
inline constexpr const char* kOperators = "OPERATOR";
/// hazard_reading_t, out: what the robot's hazard sensor measures.
inline constexpr const char* kHazard = "HAZARD";
/// loop_t, out: decisions that depend on wall time, for replay.
inline constexpr const char* kLoop = "LOOP";
/// agent_spawn_t, in: adds an agent.
inline constexpr const char* kMrSpawn = "MR_SPAWN";
/// agent_move_t, in: moves an agent to another place at once.
inline constexpr const char* kMrMove = "MR_MOVE";
/// agent_behaviour_t, in: changes the behaviour of an agent.
inline constexpr const char* kMrBehaviour = "MR_BEHAVIOUR";
/// agent_remove_t, in: removes an agent, or all.
inline constexpr const char* kMrRemove = "MR_REMOVE";
/// agent_freeze_t, in: freezes or unfreezes an agent, or all.
inline constexpr const char* kMrFreeze = "MR_FREEZE";
/// door_cmd_t, in: opening angle of a door.
inline constexpr const char* kMrDoor = "MR_DOOR";
/// fault_cmd_t, in: starts or ends a fault that is injected for training.
inline constexpr const char* kMrFault = "MR_FAULT";
/// camera_rate_t, in: picture rate of an agent's camera.
inline constexpr const char* kMrCameraRate = "MR_CAMERA_RATE";
/// object_report_t, in: the trainee reports an object as found.
inline constexpr const char* kMrObjectReport = "MR_OBJECT_REPORT";
/// script_start_t, in: starts a script of the scenario.
inline constexpr const char* kMrScript = "MR_SCRIPT";
/// training_start_t, in: starts the clock of a training that waits for it.
inline constexpr const char* kMrStart = "MR_START";
/// emergency_stop_t, in: emergency stop of a robot, and its release.
inline constexpr const char* kMrEmergencyStop = "MR_EMERGENCY_STOP";
/// planar_lidar_t or lidar_t, out: SCAN with the virtual objects in it. Same type, utime and beams.
inline constexpr const char* kMrScan = "MR_SCAN";
/// scan_info_t, out: which agent each beam of MR_SCAN hit, or why nothing was injected.
inline constexpr const char* kMrScanInfo = "MR_SCAN_INFO";
/// image_t, out: CAMERA with the virtual objects in it. Same utime, same size.
inline constexpr const char* kMrCamera = "MR_CAMERA";
/// image_t, out: DEPTH with the virtual objects in it. Same utime, same size.
inline constexpr const char* kMrDepth = "MR_DEPTH";
/// session_t, out: configuration of the session; the first event of its log.
inline constexpr const char* kMrSession = "MR_SESSION";
/// model_t, out: a new version of the semantic model.
inline constexpr const char* kMrModel = "MR_MODEL";
/// world_t, out: poses of all bodies.
inline constexpr const char* kMrWorld = "MR_WORLD";
/// event_t, out: events of the session: collisions, doors, tasks, replies to commands.
inline constexpr const char* kMrEvents = "MR_EVENTS";
/// status_t, out: measured durations, loads and counts of dropped messages.
inline constexpr const char* kMrStatus = "MR_STATUS";
/// twist2D_t or mbot_motor_command_t, out: velocity command to the real robot: TELEOP, limited where needed.
inline constexpr const char* kMrCmd = "MR_CMD";
/// joints_t, out: joint command to the real robot.
inline constexpr const char* kMrJointCmd = "MR_JOINT_CMD";

// One of each for every planar laser of a robot after its first (see channel_map.hpp):
/// SCAN_<name>: planar_lidar_t or lidar_t, in or out: scans of the laser of that name.
/// MR_SCAN_<name>: planar_lidar_t or lidar_t, out: SCAN_<name> with the virtual objects in it.
/// MR_SCAN_INFO_<name>: scan_info_t, out: as MR_SCAN_INFO, of MR_SCAN_<name>.

// One of each for every entry of a robot's cameras after the first (see channel_map.hpp):
/// CAMERA_<name>: image_t, in or out: images of the camera of that name.
/// DEPTH_<name>: image_t, in or out: images of the depth camera of that name.
/// MR_CAMERA_<name>: image_t, out: CAMERA_<name> with the virtual objects in it.
/// MR_DEPTH_<name>: image_t, out: DEPTH_<name> with the virtual objects in it.

// One of each for every agent (see channel_map.hpp):
/// MR_AGENT_<name>_TELEOP: twist2D_t, in: velocity command to a virtual robot that an operator drives.
/// MR_AGENT_<name>_JOINT_CMD: joints_t, in: joint motion of a virtual robot that has a robot model.
/// MR_AGENT_<name>_SCAN: planar_lidar_t, out: scans of the agent's simulated laser.
/// MR_AGENT_<name>_CAMERA: image_t, out: images of the agent's simulated camera.

}  // namespace parhelion::channel
