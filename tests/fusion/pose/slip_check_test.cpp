// A robot that slipped along a corridor is suspected; one whose laser people cover is not.
#include "fusion/pose/tracking/slip_check.hpp"

#include <gtest/gtest.h>

#include "tests/fusion/pose/true_drive.hpp"

namespace parhelion::pose {
namespace {

/// 30 m long, with columns at irregular distances along both walls.
test::TrueBuilding corridor_with_columns() {
  test::TrueBuilding building;
  test::add_box(building.mapped, 0, 0, 30, 2.4);
  for (const double x : {2.0, 4.6, 8.3, 10.1, 13.9, 17.2, 18.8, 22.9, 26.0}) {
    test::add_box(building.mapped, x, 0, x + 0.5, 0.3);
    test::add_box(building.mapped, x + 1.1, 2.1, x + 1.5, 2.4);
  }
  building.now = building.mapped;
  building.route = {{3, 1.2}, {24, 1.2}};
  return building;
}

class SlipCheckTest : public testing::Test {
 protected:
  SlipCheckTest() { options_.range_sigma = map_.sigma; }

  /// The check's answers while the robot drives for `seconds` from 8 s on, taken to be `off` (m) further
  /// along the corridor. `people`: how many walk around it.
  std::vector<bool> answers(SlipCheck& check, double off, int people, double seconds) {
    test::TrueDriveOptions drive;
    drive.people = people;
    std::vector<bool> result;
    for (const test::TrueScan& at : test::true_drive(building_, robot_, drive).scans) {
      const double t = (at.scan.stamp - SensorTime{test::TrueDrive::kStart}).seconds();
      if (t < 8 || t > 8 + seconds) continue;
      const ScanPoints points = deskewed(at.scan, *robot_.laser, {});
      const Pose2 taken{at.T_map_base.x + off, at.T_map_base.y, at.T_map_base.yaw};
      result.push_back(check.add(map_, points, taken, explained(points, taken), usual_, options_));
    }
    return result;
  }

  RobotDescription robot_ = test::robot_with_laser();
  test::TrueBuilding building_ = corridor_with_columns();
  FrozenMap map_ = frozen_map_of(test::true_map(building_, robot_), 0);

 private:
  double explained(const ScanPoints& points, const Pose2& at) const {
    const Eigen::Matrix3d held = 1e12 * Eigen::Matrix3d::Identity();
    return match(map_.fine, points.points, at, at, held, options_).explained;
  }

  MatchOptions options_;
  double usual_ = 0.95;
};

TEST_F(SlipCheckTest, SuspectsARobotThatIsTwoMetresFromWhereItIsTakenToBe) {
  SlipCheck check;
  const std::vector<bool> slipped = answers(check, 2, 0, 3);
  ASSERT_GT(slipped.size(), 20U);
  EXPECT_TRUE(std::find(slipped.begin(), slipped.end(), true) != slipped.end());
  EXPECT_FALSE(slipped[0] || slipped[1]);  // one scan is no evidence
}

TEST_F(SlipCheckTest, IsCalmWhereTheRobotIsWhereItIsTakenToBe) {
  SlipCheck check;
  for (const bool slipped : answers(check, 0, 0, 10)) EXPECT_FALSE(slipped);
}

TEST_F(SlipCheckTest, PeopleWhoCoverTheLaserAreNoSlip) {
  SlipCheck check;
  for (const bool slipped : answers(check, 0, 12, 10)) EXPECT_FALSE(slipped);
}

TEST_F(SlipCheckTest, EndsWhereTheMapExplainsAsMuchAsUsualAgain) {
  SlipCheck check;
  const std::vector<bool> before = answers(check, 2, 0, 3);
  ASSERT_TRUE(before.back());
  const std::vector<bool> after = answers(check, 0, 0, 1);
  ASSERT_GT(after.size(), 4U);
  EXPECT_TRUE(after.front());
  EXPECT_FALSE(after.back());
}

}  // namespace
}  // namespace parhelion::pose
