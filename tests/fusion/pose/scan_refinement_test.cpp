// A scan's own pose, against known truth: odometry that is late and wrong, people, corridors, empty halls.
#include "fusion/pose/scan_refinement.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>

#include "fusion/pose/matching/scan_points.hpp"
#include "fusion/pose/pose_track.hpp"
#include "tests/allocations.hpp"
#include "tests/fusion/pose/room.hpp"

namespace parhelion::pose {
namespace {

using test::Segment;

/// As mapped from these places, with 1 cm of noise.
std::shared_ptr<const MatchingMap> map_of(const std::vector<Segment>& walls,
                                          const std::vector<Pose2>& places) {
  const RobotDescription robot = test::robot_with_laser();
  std::mt19937 random(5);
  auto map = std::make_shared<MatchingMap>();
  map->id = "a";
  for (const Pose2& place : places) {
    const Scan scan = test::scan_from(walls, robot, place, {}, {}, random);
    const ScanPoints points = deskewed(scan, *robot.laser, {});
    map->fine.add(points.points, place);
    map->coarse.add(points.points, place);
  }
  map->fine.finish();
  map->coarse.finish();
  return map;
}

std::vector<Pose2> ring_places() {
  std::vector<Pose2> places;
  for (const test::Sample& sample : test::drive(test::ring_building(), test::robot_with_laser(), 1, 0, 3))
    places.push_back(sample.T_map_base);
  return places;
}

const std::shared_ptr<const MatchingMap>& ring_map() {
  static const auto map = map_of(test::ring_building(), ring_places());
  return map;
}

/// m, of a phantom 8 m before the robot.
double refined_phantom_error(const Pose2& estimated, const Pose2& truth) {
  const Eigen::Vector2d phantom(8, 0);
  return (estimated * phantom - truth * phantom).norm();
}

MatchPrior prior_at(const Pose2& pose, double sigma, double yaw_sigma) {
  return {pose, Eigen::Vector3d(sigma * sigma, sigma * sigma, yaw_sigma * yaw_sigma).asDiagonal(), {}};
}

Scan scan_at(const std::vector<Segment>& walls, const Pose2& pose, std::uint32_t seed) {
  std::mt19937 random(seed);
  return test::scan_from(walls, test::robot_with_laser(), pose, {}, {}, random);
}

struct Errors {
  std::vector<double> carried, matched;
};

PoseEstimate slam_estimate(SensorTime stamp, const Pose2& T_map_base) {
  PoseEstimate estimate;
  estimate.stamp = stamp;
  estimate.T_map_base = transform<Map, Base>(T_map_base);
  estimate.covariance.diagonal() << 1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 4e-6;
  estimate.state = SlamState::tracking;
  return estimate;
}

/// A drive whose odometry is stamped 0.1 s too early, with 10 ms of jitter, and 2 % too long; SLAM sends a
/// pose for each fifth scan, 0.1 s after it.
Errors drive_with_bad_odometry() {
  const RobotDescription robot = test::robot_with_laser();
  const auto samples = test::drive(test::ring_building(), robot, 2, 0.02, 17);
  std::mt19937 random(23);
  std::normal_distribution<double> jitter(0, 0.01), noise(0, 1);
  PoseTrack carried(robot, {}), refined(robot, {});
  ScanRefiner refiner(*robot.laser, ring_map());
  Errors errors;
  std::optional<PoseEstimate> from_slam;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const test::Sample& sample = samples[i];
    Odometry odometry = sample.odometry;
    odometry.stamp = odometry.stamp - seconds(0.1 + jitter(random));
    for (PoseTrack* track : {&carried, &refined}) {
      if (from_slam) track->add(*from_slam);
      track->add(odometry);
    }
    from_slam.reset();
    if (i % 5 == 0) {
      const Pose2 off{0.01 * noise(random), 0.01 * noise(random), 0.002 * noise(random)};
      from_slam = slam_estimate(sample.stamp, sample.T_map_base * off);
    }
    const auto prior = refined.match_prior(sample.stamp);
    if (!prior) continue;
    const RefinedPose found = refiner.refine(sample.scan, *prior);
    if (found.match == ScanMatch::matched)
      refined.refine(sample.stamp, found.T_map_base, found.covariance, found.twist);
    const auto a = carried.at(sample.stamp), b = refined.at(sample.stamp);
    if (!a || !b || i < 20) continue;
    errors.carried.push_back(refined_phantom_error(planar(a->T_map_base), sample.T_map_base));
    errors.matched.push_back(refined_phantom_error(planar(b->T_map_base), sample.T_map_base));
  }
  return errors;
}

double quantile_of(std::vector<double> values, double fraction) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(fraction * static_cast<double>(values.size() - 1))];
}

TEST(ScanRefinement, APhantomStandsStillWhateverOdometryIsLike) {
  const Errors errors = drive_with_bad_odometry();
  ASSERT_GT(errors.matched.size(), 500U);
  const double median = quantile_of(errors.matched, 0.5), p95 = quantile_of(errors.matched, 0.95);
  RecordProperty("median_mm", std::to_string(1e3 * median));
  RecordProperty("p95_mm", std::to_string(1e3 * p95));
  EXPECT_LT(median, 0.010);
  EXPECT_LT(p95, 0.030);
  EXPECT_GT(quantile_of(errors.carried, 0.5), 2 * median) << "carried by odometry alone it is worse";
}

TEST(ScanRefinement, IsDeterministic) {
  const Errors a = drive_with_bad_odometry(), b = drive_with_bad_odometry();
  EXPECT_EQ(a.matched, b.matched);
}

TEST(ScanRefinement, AlongACorridorThePredictionDecides) {
  const std::vector<Segment> walls{{{-60, 0}, {60, 0}}, {{-60, 2}, {60, 2}}};
  std::vector<Pose2> places;
  for (double x = -20; x < 20; x += 0.2) places.push_back({x, 1, 0});
  RobotDescription robot = test::robot_with_laser();
  ScanRefiner refiner(*robot.laser, map_of(walls, places));
  const Pose2 truth{0, 1.1, 0.02};
  const auto prior = prior_at({0.3, 1.0, 0}, 0.2, 0.05);
  const RefinedPose found = refiner.refine(scan_at(walls, truth, 1), prior);
  ASSERT_EQ(found.match, ScanMatch::matched);
  EXPECT_NEAR(found.T_map_base.y, truth.y, 0.01);
  EXPECT_NEAR(found.T_map_base.yaw, truth.yaw, 0.003);
  EXPECT_GT(std::sqrt(found.covariance(0, 0)), 0.1) << "a scan says nothing along a corridor";
  EXPECT_LT(std::sqrt(found.covariance(1, 1)), 0.02);
  EXPECT_LT(std::abs(found.T_map_base.x - truth.x), 3 * std::sqrt(found.covariance(0, 0)));
}

TEST(ScanRefinement, AnEmptyHallGivesNoMatch) {
  RobotDescription robot = test::robot_with_laser();
  ScanRefiner refiner(*robot.laser, ring_map());
  Scan scan = scan_at(test::ring_building(), {3, 1.4, 0}, 1);
  for (float& range : scan.ranges) range = 60;
  EXPECT_EQ(refiner.refine(scan, prior_at({3, 1.4, 0}, 0.05, 0.02)).match, ScanMatch::few_points);
}

/// m, of each pose of the ring that is matched while this part of the beams ends at people around the robot.
std::vector<double> errors_among_people(double hidden) {
  const RobotDescription robot = test::robot_with_laser();
  ScanRefiner refiner(*robot.laser, ring_map());
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<double> errors;
  for (const Pose2& truth : ring_places()) {
    Scan scan = scan_at(test::ring_building(), truth, 4);
    for (std::size_t i = 0; i < scan.ranges.size(); i += 12) {
      if (unit(random) >= hidden) continue;
      const float leg = static_cast<float>(0.4 + unit(random));
      for (std::size_t k = i; k < std::min(i + 12, scan.ranges.size()); ++k)
        scan.ranges[k] = std::min(scan.ranges[k], leg);
    }
    const RefinedPose found = refiner.refine(scan, prior_at(truth * Pose2{0.03, -0.02, 0.01}, 0.05, 0.02));
    if (found.match == ScanMatch::matched)
      errors.push_back((found.T_map_base.position() - truth.position()).norm());
  }
  return errors;
}

TEST(ScanRefinement, PeopleAroundTheRobotDoNotMoveIt) {
  const auto half = errors_among_people(0.5);
  EXPECT_GT(half.size(), ring_places().size() * 9 / 10);
  EXPECT_LT(quantile_of(half, 0.5), 0.010);
  EXPECT_LT(quantile_of(half, 0.98), 0.035);
  const auto nearly_all = errors_among_people(0.9);
  EXPECT_LT(nearly_all.size(), ring_places().size() / 10) << "mostly no match, rather than a wrong one";
  for (const double error : nearly_all) EXPECT_LT(error, 0.15);
}

RC_GTEST_PROP(ScanRefinement, NeverLeavesWhatThePredictionAllows, ()) {
  RobotDescription robot = test::robot_with_laser();
  ScanRefiner refiner(*robot.laser, ring_map());
  const auto any = [](double limit) { return *rc::gen::inRange(-10'000, 10'000) * 1e-4 * limit; };
  const Pose2 truth{6 + any(6), 4 + any(4), any(3.14)};
  const Pose2 start{6 + any(7), 4 + any(5), any(3.14)};
  const double sigma = 0.02 + std::abs(any(0.3)), yaw_sigma = 0.005 + std::abs(any(0.2));
  const auto prior = prior_at(start, sigma, yaw_sigma);
  const RefinedPose found = refiner.refine(scan_at(test::ring_building(), truth, 6), prior);
  if (found.match != ScanMatch::matched) return;
  const Eigen::Vector3d off(found.T_map_base.x - start.x, found.T_map_base.y - start.y,
                            wrap_angle(found.T_map_base.yaw - start.yaw));
  const double chi2 = off.dot(prior.covariance.inverse() * off);
  RC_ASSERT(chi2 <= (found.explained >= 0.8 ? 65.3 : 16.4));
  RC_ASSERT(found.covariance.allFinite());
  RC_ASSERT(found.covariance(0, 0) <= prior.covariance(0, 0) + 1e-4);
}

/// m, largest of a phantom before the robot, over the ring. The robot has begun to turn, of which odometry
/// knows nothing yet: the prediction lags, and so does the twist that the sweep would be corrected with.
double error_in_unknown_turn(bool twist_refined) {
  const RobotDescription robot = test::robot_with_laser();
  ScanRefiner refiner(*robot.laser, ring_map());
  std::mt19937 random(31);
  constexpr double since = 0.1, acceleration = 4;  // s, rad/s^2
  double worst = 0;
  for (const Pose2& truth : ring_places()) {
    const Twist2 twist{0.3, 0, acceleration * since};
    const Scan scan = test::scan_from(test::ring_building(), robot, truth, twist, {}, random);
    MatchPrior prior = prior_at(truth * Pose2{0, 0, -acceleration * since * since / 2}, 0.02, 0.02);
    prior.twist = {0.3, 0, 0};
    // It drove straight on until the scan before.
    const Pose2 before = truth * moved({0.3, 0, acceleration * since / 2}, -since);
    if (twist_refined)
      prior.before = ScanMotion::Step{SensorTime{} - seconds(since), before, {0.3, 0, 0}, since};
    const RefinedPose found = refiner.refine(scan, prior);
    EXPECT_EQ(found.match, ScanMatch::matched);
    EXPECT_NEAR(found.twist.wz, twist_refined ? twist.wz : 0, 0.25);
    worst = std::max(worst, refined_phantom_error(found.T_map_base, truth));
  }
  return worst;
}

TEST(ScanRefinement, ASweepIsUnbentByTheTwistThatTheScanShows) {
  const double by_odometry = error_in_unknown_turn(false), by_scan = error_in_unknown_turn(true);
  EXPECT_GT(by_odometry, 0.045);
  EXPECT_LT(by_scan, 0.025);
}

TEST(ScanRefinement, AllocatesNothingAfterTheFirstScan) {
  RobotDescription robot = test::robot_with_laser();
  ScanRefiner refiner(*robot.laser, ring_map());
  const Scan scan = scan_at(test::ring_building(), {3, 1.4, 0}, 1);
  refiner.refine(scan, prior_at({3, 1.4, 0}, 0.05, 0.02));
  const test::AllocationWatch watch;
  MatchPrior prior = prior_at({3.02, 1.4, 0.02}, 0.05, 0.02);
  prior.before = ScanMotion::Step{SensorTime{} - seconds(0.1), {3, 1.4, 0}, {}, 0.1};
  refiner.refine(scan, prior);
  EXPECT_EQ(watch.count(), 0U);
}

class RefinedTrack : public testing::Test {
 protected:
  RefinedTrack() {
    for (double t = 0; t < 1; t += 0.1) track_.add(Odometry{at(t), transform<Odom, Base>(Pose2{t, 0, 0})});
    slam(0.5, {0.5, 0, 0}, SlamState::tracking);
  }
  static SensorTime at(double s) { return SensorTime{1'000'000'000'000'000} + seconds(s); }
  void slam(double t, const Pose2& pose, SlamState state) {
    PoseEstimate estimate;
    estimate.stamp = at(t);
    estimate.T_map_base = transform<Map, Base>(pose);
    estimate.covariance = PoseCovariance::Identity() * 1e-4;
    estimate.state = state;
    track_.add(estimate);
  }
  Pose2 pose(double t) const { return planar(track_.at(at(t))->T_map_base); }

  PoseTrack track_{test::robot_with_laser(), {}};
  const Eigen::Matrix3d sure_ = Eigen::Vector3d(2.5e-5, 2.5e-5, 1e-6).asDiagonal();
};

TEST_F(RefinedTrack, CarriesARefinedPoseByOdometry) {
  ASSERT_TRUE(track_.match_prior(at(0.7)));
  track_.refine(at(0.7), {0.73, 0.02, 0.01}, sure_);
  EXPECT_NEAR(pose(0.7).x, 0.73, 1e-9);
  EXPECT_NEAR(pose(0.7).yaw, 0.01, 1e-9);
  EXPECT_NEAR(pose(0.9).x, 0.93, 1e-3);
}

TEST_F(RefinedTrack, FollowsTheScansTwistToTheEndOfItsSweepOnly) {
  track_.refine(at(0.7), {0.7, 0, 0}, sure_, Twist2{1, 0, 0.5});
  EXPECT_NEAR(pose(0.72).yaw, 0.01, 0.002);
  EXPECT_NEAR(pose(0.9).yaw, 0, 1e-4);
}

TEST_F(RefinedTrack, KeepsItWhereSlamAgreesAndDropsItWhereSlamDoesNot) {
  track_.refine(at(0.7), {0.71, 0.01, 0}, sure_);
  slam(0.7, {0.70, 0, 0}, SlamState::tracking);
  EXPECT_NEAR(pose(0.7).x, 0.71, 1e-9);
  track_.refine(at(0.8), {0.81, 0.01, 0}, sure_);
  slam(0.8, {0.90, 0, 0}, SlamState::tracking);
  EXPECT_NEAR(pose(0.8).x, 0.90, 1e-9) << "SLAM is the source of the pose";
}

TEST_F(RefinedTrack, NeverMakesALostRobotKnown) {
  slam(0.6, {0.6, 0, 0}, SlamState::lost);
  EXPECT_FALSE(track_.match_prior(at(0.7)));
  track_.refine(at(0.7), {0.7, 0, 0}, sure_);
  EXPECT_FALSE(track_.at(at(0.7)));
}

TEST_F(RefinedTrack, IsMatchedNoMoreWhenSlamIsSilent) {
  for (double t = 1; t < 4; t += 0.1) track_.add(Odometry{at(t), transform<Odom, Base>(Pose2{t, 0, 0})});
  EXPECT_TRUE(track_.match_prior(at(2.4)));
  EXPECT_FALSE(track_.match_prior(at(2.6)));
}

}  // namespace
}  // namespace parhelion::pose
