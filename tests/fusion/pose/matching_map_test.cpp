// A map as bytes: the same surfaces, and no damage that a reader does not notice or survive.
#include "fusion/pose/maps/matching_map.hpp"

#include <gtest/gtest.h>

#include <random>

#include "fusion/pose/maps/mapped_scan.hpp"
#include "fusion/pose/matching/scan_points.hpp"
#include "tests/fusion/pose/room.hpp"
#include "tests/temporary_folder.hpp"

namespace parhelion::pose {
namespace {

class MatchingMapTest : public testing::Test {
 protected:
  MatchingMapTest() {
    const RobotDescription robot = test::robot_with_laser();
    for (const test::Sample& sample : test::drive(test::ring_building(), robot, 0.5, 0, 3)) {
      scans_.push_back({sample.T_map_base, robot.laser->T_base_laser,
                        rectified(deskewed(sample.scan, *robot.laser, sample.twist), *robot.laser), 30});
    }
    EXPECT_TRUE(write_simplemap(scans_, path_));
    auto packed = pack_matching_map(path_);
    EXPECT_TRUE(packed) << (packed ? "" : packed.error().message);
    bytes_ = std::move(*packed);
  }

  test::TemporaryFolder folder_;
  const std::string path_ = folder_ / "map.simplemap";
  std::vector<MappedScan> scans_;
  std::vector<std::uint8_t> bytes_;
};

TEST_F(MatchingMapTest, HasTheSurfacesOfItsFile) {
  const auto map = unpack_matching_map(bytes_, "log");
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_EQ(map->packed, bytes_);
  EXPECT_FALSE(map->id.empty());
  SurfelMap fine(0.1), coarse(0.4);
  const auto scans = read_simplemap(path_);  // as the file rounds them
  ASSERT_TRUE(scans) << scans.error().message;
  for (const MappedScan& scan : *scans) {
    fine.add(points_of(scan), scan.T_map_base);
    coarse.add(points_of(scan), scan.T_map_base);
  }
  int compared = 0;
  for (double x = 0; x < 12; x += 0.037) {
    for (const double y : {0.01, 2.49, 7.99}) {
      for (const auto& [a, b] : {std::pair{&fine, &map->fine}, std::pair{&coarse, &map->coarse}}) {
        const Eigen::Vector2d p(x, y);
        const Surfel *expected = a->nearest(p), *found = b->nearest(p);
        ASSERT_EQ(expected == nullptr, found == nullptr);
        if (expected == nullptr) continue;
        // Of two that are equally near, rounding may choose the other; and a point on the border of two
        // coarse cells may count for the other one.
        EXPECT_NEAR((expected->mean - p).norm(), (found->mean - p).norm(), b == &map->fine ? 1e-4 : 0.01);
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 500);
}

TEST_F(MatchingMapTest, DamagedBytesAreRefusedOrGiveAMap) {
  std::mt19937 random(1);
  for (int i = 0; i < 500; ++i) {
    std::vector<std::uint8_t> damaged = bytes_;
    if (i % 2 == 0) damaged.resize(random() % damaged.size());
    for (int flips = 1 + static_cast<int>(random() % 4); flips > 0 && !damaged.empty(); --flips)
      damaged[random() % std::min<std::size_t>(damaged.size(), i % 3 == 0 ? 100 : damaged.size())] ^=
          static_cast<std::uint8_t>(1U << (random() % 8));
    const auto map = unpack_matching_map(damaged, "log");
    if (!map) {
      EXPECT_EQ(map.error().message.rfind("log: ", 0), 0U);
    } else {
      map->fine.nearest({1, 1});
    }
  }
}

TEST_F(MatchingMapTest, AFileThatIsNoMapIsNamed) {
  const auto packed = pack_matching_map(folder_ / "no.simplemap");
  ASSERT_FALSE(packed);
  EXPECT_NE(packed.error().message.find("no.simplemap"), std::string::npos);
}

}  // namespace
}  // namespace parhelion::pose
