// The names on the bus; every one can be remapped by the scenario.
#pragma once

namespace parhelion::channel {

inline constexpr const char* robot = "ROBOT";
inline constexpr const char* scan = "SCAN";
inline constexpr const char* lines = "LINES";
inline constexpr const char* odometry = "ODOMETRY";
inline constexpr const char* pose_cov = "POSE_COV";
inline constexpr const char* pose = "POSE";
inline constexpr const char* reference_pose = "REFERENCE_POSE";
inline constexpr const char* camera = "CAMERA";
inline constexpr const char* depth = "DEPTH";
inline constexpr const char* imu = "IMU";
inline constexpr const char* teleop = "TELEOP";
inline constexpr const char* joint_state = "JOINT_STATE";
inline constexpr const char* joint_cmd = "JOINT_CMD";
inline constexpr const char* bumper = "BUMPER";
inline constexpr const char* operators = "OPERATOR";
inline constexpr const char* hazard = "HAZARD";
inline constexpr const char* loop = "LOOP";
inline constexpr const char* mr_agent_cmd = "MR_AGENT_CMD";
inline constexpr const char* mr_scan = "MR_SCAN";
inline constexpr const char* mr_scan_info = "MR_SCAN_INFO";
inline constexpr const char* mr_camera = "MR_CAMERA";
inline constexpr const char* mr_depth = "MR_DEPTH";
inline constexpr const char* mr_session = "MR_SESSION";
inline constexpr const char* mr_model = "MR_MODEL";
inline constexpr const char* mr_world = "MR_WORLD";
inline constexpr const char* mr_events = "MR_EVENTS";
inline constexpr const char* mr_status = "MR_STATUS";
inline constexpr const char* mr_cmd = "MR_CMD";
inline constexpr const char* mr_joint_cmd = "MR_JOINT_CMD";

}  // namespace parhelion::channel
