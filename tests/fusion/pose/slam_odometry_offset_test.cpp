// SLAM says by how much odometry's stamps are off against the scans'.
#include <gtest/gtest.h>

#include "fusion/pose/slam.hpp"
#include "tests/fusion/pose/swept_drive.hpp"

namespace parhelion::pose {
namespace {

TEST(SlamOdometryOffset, IsTheErrorOfItsClock) {
  constexpr double interval = 0.05 / 361;  // s
  for (const double late : {-0.15, 0.0, 0.15}) {
    const test::SweptDrive drive = test::swept_drive(51, interval, interval, late, 1);
    auto slam = make_mapper(drive.robot, {});
    ASSERT_TRUE(slam.ok()) << slam.error().message;
    for (const test::DriveInput& input : drive.inputs) {
      if (input.scan)
        (*slam)->add(*input.scan);
      else
        (*slam)->add(input.odometry);
    }
    const auto offset = (*slam)->odometry_offset();
    ASSERT_TRUE(offset);
    EXPECT_NEAR(offset->seconds, -late, 0.04);
    EXPECT_LT(offset->sigma, 0.02);
  }
}

}  // namespace
}  // namespace parhelion::pose
