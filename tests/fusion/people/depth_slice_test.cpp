// People in depth images: the slice that a laser would see, and who is found in it.
#include "fusion/people/depth_slice.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/fusion/people/depth_score.hpp"

namespace parhelion::people {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

test::DepthRoom empty_room(double height, double pitch) {
  test::DepthRoomOptions options;
  options.walkers = options.standing = options.boxes = options.poles = options.tables = 0;
  options.duration = 0.5;
  options.height = height, options.pitch = pitch;
  options.tremble = 1 * kDegree;
  options.pose_noise = options.pose_drift = 0;
  return make_depth_room(options);
}

TEST(DepthSlice, LiesOnTheWallsAtAnyTiltOfTheCamera) {
  for (const double pitch : {-10.0, 0.0, 12.0}) {
    const test::DepthRoom room = empty_room(0.9, pitch * kDegree);
    DepthSlice slice = depth_slices()[1];
    for (const auto& image : room.images) {
      ASSERT_TRUE(slice.set(room.view(image)));
      const auto walls = room.building(slice);
      std::size_t measured = 0;
      for (std::size_t i = 0; i < walls.size(); ++i) {
        const float range = slice.scan().ranges[i];
        if (std::isnan(range)) continue;
        ++measured;
        EXPECT_NEAR(range, walls[i].range, 0.05 + 0.006 * walls[i].range * walls[i].range)
            << pitch << " beam " << i;
      }
      EXPECT_GE(measured, walls.size() * 4 / 5) << pitch;
    }
  }
}

TEST(DepthSlice, IsLevelWhereverTheCameraLooks) {
  const test::DepthRoom room = empty_room(1.4, 30 * kDegree);
  DepthSlice slice;
  ASSERT_TRUE(slice.set(room.view(room.images.front())));
  const auto& T_map_laser = slice.motion().T_map_laser_end;
  EXPECT_NEAR(T_map_laser.rotation()(2, 2), 1, 1e-12);
  EXPECT_DOUBLE_EQ(T_map_laser.translation().z(), DepthSliceOptions{}.height);
  EXPECT_NEAR(T_map_laser.yaw(), 0, 4 * kDegree);
}

TEST(DepthSlice, RefusesWhatGivesNoScan) {
  const test::DepthRoom room = empty_room(0.5, 0);
  const DepthView good = room.view(room.images.front());
  DepthSlice slice;
  DepthView view = good;
  view.T_map_depth = Transform<Map, DepthOptical>();  // looks straight up
  EXPECT_FALSE(slice.set(view));
  EXPECT_TRUE(slice.scan().ranges.empty());
  view = good;
  view.millimetres = view.millimetres.first(100);
  EXPECT_FALSE(slice.set(view));
  view = good;
  const std::vector<Eigen::Vector3f> no_direction(good.directions.size(), Eigen::Vector3f::Zero());
  view.directions = no_direction;
  EXPECT_FALSE(slice.set(view));
  view = good;
  const std::vector<std::uint16_t> nothing(good.millimetres.size(), 0);
  view.millimetres = nothing;
  ASSERT_TRUE(slice.set(view));
  for (const float range : slice.scan().ranges) EXPECT_TRUE(std::isnan(range));
}

test::PeopleScore rooms(std::uint64_t seed, int n, double height, double pitch) {
  test::PeopleScore all;
  for (int i = 0; i < n; ++i) {
    test::DepthRoomOptions options;
    options.seed = seed + static_cast<std::uint64_t>(i);
    options.height = height, options.pitch = pitch;
    all += score(options);
  }
  return all;
}

// Of twelve rooms a height on other seeds: recall 0.86 to 0.89, precision 0.81 to 0.85, 0.13 to 0.14 m.
TEST(PeopleInDepth, PeopleAreFoundAmongFurniture) {
  for (const auto& [height, pitch] : {std::pair(0.35, 0.0), std::pair(0.6, 5.0), std::pair(1.2, 15.0)}) {
    const test::PeopleScore s = rooms(100, 3, height, pitch * kDegree);
    EXPECT_GE(s.recall(), 0.75) << height;
    EXPECT_GE(s.precision(), 0.8) << height;
    EXPECT_LE(s.rms_error(), 0.18) << height;
  }
}

TEST(PeopleInDepth, FurnitureAloneIsHardlyEverAPerson) {
  int reported = 0, images = 0;
  for (std::uint64_t seed = 300; seed < 304; ++seed) {
    test::DepthRoomOptions options;
    options.seed = seed;
    options.walkers = options.standing = 0;
    reported += score(options).reported;
    images += static_cast<int>(options.duration * options.rate);
  }
  // 0.19 an image; 0.21 with the thresholds of lasers, which were chosen for who stands still.
  EXPECT_LE(reported, images / 5);
}

}  // namespace
}  // namespace parhelion::people
