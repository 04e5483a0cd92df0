// The tick matches a real robot's scans to the session's map, and says so.
#include <gtest/gtest.h>

#include "fusion/pose/matching/scan_points.hpp"
#include "tests/server/tick/tick_fixture.hpp"

namespace parhelion::tick {
namespace {

/// Of the synthetic room, seen from the circle on which its robot drives.
std::shared_ptr<const pose::MatchingMap> room_map(const std::string& id = "synthetic") {
  auto map = std::make_shared<pose::MatchingMap>();
  map->id = id;
  for (double t = 0; t < 40; t += 0.5) {
    const auto points = pose::deskewed(test::scan_at(t), *test::robot().laser, {});
    map->fine.add(points.points, planar(test::pose_at(t)));
    map->coarse.add(points.points, planar(test::pose_at(t)));
  }
  map->fine.finish();
  map->coarse.finish();
  return map;
}

class ScanMatchingTest : public test::TickTest {
 protected:
  static Configuration with_map() {
    Configuration configuration = test::configuration({test::agent("box_1", AgentKind::box, 3, 2)});
    configuration.map = room_map();
    return configuration;
  }
  std::vector<Event> changes_of_odometry() {
    std::vector<Event> all = decoded<Event>(channel::kMrEvents);
    std::erase_if(all, [](const Event& event) { return event.kind != EventKind::odometry_changed; });
    return all;
  }
};

TEST_F(ScanMatchingTest, ReportsOfEachScanHowItWasPlaced) {
  start(with_map());
  feed(test::drive(5));
  const auto infos = decoded<ScanInfo>(channel::kMrScanInfo);
  ASSERT_GT(infos.size(), 20U);
  EXPECT_GT(state_->tally.scans_matched, infos.size() * 9 / 10);
  const ScanInfo& last = infos.back();
  EXPECT_EQ(last.pose, "matched");
  EXPECT_LT(last.residual, 0.05);
  EXPECT_GT(last.explained, 0.9);
  EXPECT_LT(last.pose_covariance(0, 0), 1e-3);
}

TEST_F(ScanMatchingTest, WithoutAMapThePoseIsCarried) {
  start(test::configuration({}));
  feed(test::drive(5));
  const auto infos = decoded<ScanInfo>(channel::kMrScanInfo);
  ASSERT_FALSE(infos.empty());
  EXPECT_EQ(infos.back().pose, "off");
  EXPECT_EQ(infos.back().residual, std::numeric_limits<double>::infinity());
  EXPECT_EQ(state_->tally.scans_matched, 0U);
}

// SLAM is 5 cm and 1 degree off, within what it says of itself: the scans put it right.
TEST_F(ScanMatchingTest, PutsRightWhatSlamHasWrong) {
  start(with_map());
  double worst = 0;
  for (Message each : test::drive(10)) {
    PoseEstimate estimate;
    if (each.channel == channel::kPoseCov && decode(each.channel, each.payload, estimate).ok()) {
      estimate.T_map_base = Transform<Map, Map>::planar(0.04, -0.03, 0.015) * estimate.T_map_base;
      estimate.covariance.diagonal() << 0.0025, 0.0025, 1e-4, 1e-4, 1e-4, 0.0009;
      encode(estimate, each.payload);
    }
    feed(each);
    Scan scan;
    if (each.channel != channel::kScan || !decode(each.channel, each.payload, scan).ok()) continue;
    const double t = (scan.stamp.utime() - test::kStartUs) * 1e-6;
    const auto pose = robot_pose(state_->robots.front().pose, scan.stamp);
    if (t < 2 || !pose) continue;
    worst = std::max(worst, (pose->T_map_base.translation() - test::pose_at(t).translation()).norm());
  }
  EXPECT_GT(worst, 0);
  EXPECT_LT(worst, 0.02);
}

TEST_F(ScanMatchingTest, ReportsOnceThatOdometryIsTooLong) {
  start(with_map());
  for (Message each : test::drive(60)) {
    Odometry odometry;
    if (each.channel == channel::kOdometry && decode(each.channel, each.payload, odometry).ok()) {
      const Pose2 pose = planar(odometry.T_odom_base);
      odometry.T_odom_base = transform<Odom, Base>({1.1 * pose.x, 1.1 * pose.y, pose.yaw});
      encode(odometry, each.payload);
    }
    feed(each);
  }
  const auto changes = changes_of_odometry();
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_NE(changes[0].text.find("translation times 0.9"), std::string::npos) << changes[0].text;
  EXPECT_NE(changes[0].text.find("rotation times 1.0"), std::string::npos) << changes[0].text;
}

TEST_F(ScanMatchingTest, ReportsNothingOfOdometryThatIsRight) {
  start(with_map());
  feed(test::drive(60));
  EXPECT_TRUE(changes_of_odometry().empty());
}

TEST(ScanMatching, AMapOfAnotherSiteIsRefused) {
  const Scenario scenario;
  const auto refused = configure(scenario, test::robot(), test::room(), {}, room_map("another"));
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("another"), std::string::npos);
  EXPECT_NE(refused.error().message.find("synthetic"), std::string::npos);
}

}  // namespace
}  // namespace parhelion::tick
