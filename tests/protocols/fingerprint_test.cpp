// The fingerprints that are promised to others: changing one breaks every log and every robot.
#include <gtest/gtest.h>

#include <cstdint>

#include "parhelion/agent_cmd_t.hpp"
#include "parhelion/event_t.hpp"
#include "parhelion/image_t.hpp"
#include "parhelion/loop_t.hpp"
#include "parhelion/planar_lidar_t.hpp"
#include "parhelion/pose2D_t.hpp"
#include "parhelion/pose_cov_t.hpp"
#include "parhelion/pose_t.hpp"
#include "parhelion/robot_t.hpp"
#include "parhelion/scan_info_t.hpp"
#include "parhelion/session_t.hpp"
#include "parhelion/status_t.hpp"
#include "parhelion/twist2D_t.hpp"
#include "parhelion/world_t.hpp"

namespace parhelion {
namespace {

template <class T>
std::uint64_t fingerprint() {
  return static_cast<std::uint64_t>(T::getHash());
}

TEST(Fingerprint, OdometryIsThatOfTheMBot) { EXPECT_EQ(fingerprint<pose2D_t>(), 0x1f317af1246276acU); }

}  // namespace
}  // namespace parhelion
