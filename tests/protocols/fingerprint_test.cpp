// The published fingerprints: changing one breaks every log and every robot.
#include <gtest/gtest.h>

#include <cstdint>

#include "parhelion/agent_behaviour_t.hpp"
#include "parhelion/agent_freeze_t.hpp"
#include "parhelion/agent_move_t.hpp"
#include "parhelion/agent_remove_t.hpp"
#include "parhelion/agent_spawn_t.hpp"
#include "parhelion/camera_rate_t.hpp"
#include "parhelion/door_cmd_t.hpp"
#include "parhelion/emergency_stop_t.hpp"
#include "parhelion/event_t.hpp"
#include "parhelion/fault_cmd_t.hpp"
#include "parhelion/hazard_reading_t.hpp"
#include "parhelion/image_t.hpp"
#include "parhelion/imu_t.hpp"
#include "parhelion/joints_t.hpp"
#include "parhelion/lidar_t.hpp"
#include "parhelion/loop_t.hpp"
#include "parhelion/mbot_imu_t.hpp"
#include "parhelion/mbot_motor_command_t.hpp"
#include "parhelion/model_t.hpp"
#include "parhelion/object_report_t.hpp"
#include "parhelion/operator_t.hpp"
#include "parhelion/planar_lidar_t.hpp"
#include "parhelion/pose2D_t.hpp"
#include "parhelion/pose_cov_t.hpp"
#include "parhelion/pose_t.hpp"
#include "parhelion/robot_t.hpp"
#include "parhelion/scan_info_t.hpp"
#include "parhelion/script_start_t.hpp"
#include "parhelion/session_t.hpp"
#include "parhelion/status_t.hpp"
#include "parhelion/training_start_t.hpp"
#include "parhelion/twist2D_t.hpp"
#include "parhelion/world_t.hpp"

namespace parhelion {
namespace {

template <class T>
std::uint64_t fingerprint() {
  return static_cast<std::uint64_t>(T::getHash());
}

TEST(Fingerprint, OdometryAndImuMatchARealMBot) {
  EXPECT_EQ(fingerprint<pose2D_t>(), 0x1f317af1246276acU);
  EXPECT_EQ(fingerprint<mbot_imu_t>(), 0x5d3f1ec742142382U);
}

// Compared with fingerprints of types with the members that bot2-core and the MBot publish.
TEST(Fingerprint, TypesOfOtherProjectsAreUnchanged) {
  EXPECT_EQ(fingerprint<planar_lidar_t>(), 0xe3d17423180b5e8dU);
  EXPECT_EQ(fingerprint<pose_t>(), 0x2e16efb052b0105eU);
  EXPECT_EQ(fingerprint<image_t>(), 0x14739ffe13d5f5f0U);
  EXPECT_EQ(fingerprint<twist2D_t>(), 0x85d72aee83523195U);
  EXPECT_EQ(fingerprint<lidar_t>(), 0x89dc5b879a5056cfU);
  EXPECT_EQ(fingerprint<mbot_motor_command_t>(), 0xe817386df0c405a3U);
}

TEST(Fingerprint, OwnTypesAreUnchanged) {
  EXPECT_EQ(fingerprint<pose_cov_t>(), 0xbdbe6848aaae8c55U);
  EXPECT_EQ(fingerprint<imu_t>(), 0x574360037da0350eU);
  EXPECT_EQ(fingerprint<joints_t>(), 0x5446b6c04d532a98U);
  EXPECT_EQ(fingerprint<robot_t>(), 0x01848a2e835a8412U);
  EXPECT_EQ(fingerprint<model_t>(), 0x62c27ab1a2f2a9b3U);
  EXPECT_EQ(fingerprint<session_t>(), 0x348ba8fe510a4d32U);
  EXPECT_EQ(fingerprint<scan_info_t>(), 0xbaab5b61c1f33176U);
  EXPECT_EQ(fingerprint<loop_t>(), 0xc90a662fd21f457cU);
  EXPECT_EQ(fingerprint<status_t>(), 0xbad2fe72da73b450U);
  EXPECT_EQ(fingerprint<agent_spawn_t>(), 0xdfc1f2fee7d8b5e3U);
  EXPECT_EQ(fingerprint<agent_move_t>(), 0x468599a2c710912bU);
  EXPECT_EQ(fingerprint<agent_behaviour_t>(), 0xfd94eb09e274dc00U);
  EXPECT_EQ(fingerprint<agent_remove_t>(), 0xee17ddc94a6a8e41U);
  EXPECT_EQ(fingerprint<agent_freeze_t>(), 0xf614616ff32914e2U);
  EXPECT_EQ(fingerprint<door_cmd_t>(), 0x775a678439085187U);
  EXPECT_EQ(fingerprint<fault_cmd_t>(), 0x5e6d8a0eb669f03aU);
  EXPECT_EQ(fingerprint<camera_rate_t>(), 0x0648bf12436936d4U);
  EXPECT_EQ(fingerprint<object_report_t>(), 0x4dfc9f05fd22e8b3U);
  EXPECT_EQ(fingerprint<script_start_t>(), 0x9e6ba4f27ada2b27U);
  EXPECT_EQ(fingerprint<emergency_stop_t>(), 0x77632ca1e6dbdc12U);
  EXPECT_EQ(fingerprint<operator_t>(), 0x41bf0903e8b400d4U);
  EXPECT_EQ(fingerprint<event_t>(), 0xb24d58f9e36606c5U);
  EXPECT_EQ(fingerprint<hazard_reading_t>(), 0x273b8d493089dcdfU);
  EXPECT_EQ(fingerprint<world_t>(), 0x59e033b4acd79bfeU);
}

}  // namespace
}  // namespace parhelion
