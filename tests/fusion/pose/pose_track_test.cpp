#include "fusion/pose/pose_track.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/allocations.hpp"

namespace parhelion::pose {
namespace {

SensorTime at_seconds(double s) { return SensorTime{1'000'000'000'000'000} + seconds(s); }

RobotDescription robot() {
  RobotDescription r;
  r.odometry_error_translation = 0.05;
  r.odometry_error_rotation = 0.05;
  return r;
}

Odometry odometry(double t, const Pose2& T_odom_base) {
  return {at_seconds(t), transform<Odom, Base>(T_odom_base)};
}

PoseEstimate estimate(double t, const Pose2& T_map_base, double sigma = 0.01) {
  PoseEstimate e;
  e.stamp = at_seconds(t);
  e.T_map_base = transform<Map, Base>(T_map_base);
  e.covariance.diagonal().setConstant(sigma * sigma);
  e.state = SlamState::tracking;
  e.map_id = "a";
  return e;
}

/// A robot on a circle: 1 m/s, 0.5 rad/s.
Pose2 on_circle(double t) { return moved({1, 0, 0.5}, t); }

double distance(const Pose2& a, const Pose2& b) { return (a.position() - b.position()).norm(); }

/// Reference implementation: keeps everything, searches linearly, recomputes at each call.
struct SlowTrack {
  std::vector<std::pair<double, Pose2>> odometry;
  std::vector<std::pair<double, Pose2>> estimates;

  Pose2 T_odom_base(double t) const {
    for (std::size_t i = 0; i + 1 < odometry.size(); ++i) {
      const auto& [t0, p0] = odometry[i];
      const auto& [t1, p1] = odometry[i + 1];
      if (t < t1 || i + 2 == odometry.size()) {
        if (t <= t1) return interpolate(p0, p1, (t - t0) / (t1 - t0));
        break;
      }
    }
    const auto& [t1, p1] = odometry.back();
    std::size_t start = odometry.size() - 2;
    while (start > 0 && t1 - odometry[start].first < 0.0399999) --start;
    const auto& [t0, p0] = odometry[start];
    return p1 * moved(twist_to(p0.inverse() * p1), (t - t1) / (t1 - t0));
  }
  Pose2 at(double t) const {
    const auto& [stamp, T_map_base] = estimates.back();
    return T_map_base * T_odom_base(stamp).inverse() * T_odom_base(t);
  }
};

TEST(PoseTrack, AgreesWithTheReferenceOnRandomDrives) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int drive = 0; drive < 30; ++drive) {
    PoseTrack track(robot(), {});
    SlowTrack slow;
    Pose2 pose{unit(random), unit(random), 6 * unit(random)};
    double t = 0, next_estimate = 0.3 * unit(random);
    int answered = 0;
    for (int i = 0; i < 300; ++i) {
      const double dt = 0.005 + 0.05 * unit(random);
      pose = pose * moved({unit(random), 0, 2 * unit(random) - 1}, dt);
      t += dt;
      track.add(odometry(t, pose));
      slow.odometry.emplace_back(t, pose);
      if (t > next_estimate && i > 2) {
        next_estimate = t + 0.1;
        // Before, at and after the newest odometry.
        const double stamp = t + 0.05 * (unit(random) - 0.8);
        const Pose2 word =
            Pose2{3, 4, 1} * slow.T_odom_base(stamp) * Pose2{0.01 * unit(random), 0, 0.01 * unit(random)};
        if (slow.estimates.empty() || stamp > slow.estimates.back().first) {
          ASSERT_NE(track.add(estimate(stamp, word)), PoseTrack::Correction::ignored);
          slow.estimates.emplace_back(stamp, word);
        }
      }
      if (slow.estimates.empty()) continue;
      for (int question = 0; question < 4; ++question) {
        const double asked = t + 0.4 - 1.2 * unit(random);
        if (asked < slow.odometry.front().first) continue;
        const auto fast = track.at(at_seconds(asked));
        ASSERT_TRUE(fast) << asked;
        EXPECT_LT(distance(planar(fast->T_map_base), slow.at(asked)), 1e-6);
        EXPECT_NEAR(wrap_angle(fast->T_map_base.yaw() - slow.at(asked).yaw), 0, 1e-6);
        ++answered;
      }
    }
    EXPECT_GT(answered, 800);
  }
}

TEST(PoseTrack, FollowsAnArcBetweenSlowOdometrySamples) {
  PoseTrack track(robot(), {});
  for (double t : {0.0, 0.25, 0.5}) track.add(odometry(t, on_circle(t)));
  track.add(estimate(0.5, on_circle(0.5)));
  const auto pose = track.at(at_seconds(0.37));
  ASSERT_TRUE(pose);
  EXPECT_LT(distance(planar(pose->T_map_base), on_circle(0.37)), 1e-6);
  EXPECT_NEAR(pose->twist.vx, 1, 1e-6);
  EXPECT_NEAR(pose->twist.wz, 0.5, 1e-6);
  EXPECT_EQ(pose->age, at_seconds(0.37) - at_seconds(0.5));
}

TEST(PoseTrack, ReanchorsAnEarlyEstimateWhenOdometryArrives) {
  PoseTrack track(robot(), {});
  track.add(odometry(0, {}));
  track.add(odometry(0.1, {0.1, 0, 0}));
  // The robot stops at 0.1 s: the extrapolated position of the estimate (0.15, ...) turns out to be (0.1,
  // ...).
  track.add(estimate(0.15, {5, 5, 0}));
  track.add(odometry(0.2, {0.1, 0, 0}));
  const auto pose = track.at(at_seconds(0.2));
  ASSERT_TRUE(pose);
  EXPECT_NEAR(pose->T_map_base.translation().x(), 5, 1e-9);
}

TEST(PoseTrack, CovarianceGrowsWithDistanceAndNeverShrinksWithoutEstimates) {
  PoseTrack track(robot(), {});
  for (int i = 0; i <= 20; ++i) track.add(odometry(0.05 * i, on_circle(0.05 * i)));
  track.add(estimate(0.2, on_circle(0.2)));
  double before = 0;
  for (double t = 0.2; t < 1.45; t += 0.05) {
    const auto pose = track.at(at_seconds(t));
    ASSERT_TRUE(pose) << t;
    const double sigma = predicted_error(*pose, pose->T_map_base * Eigen::Vector3d(3, 0, 0));
    EXPECT_GT(sigma, before);
    before = sigma;
    EXPECT_TRUE(pose->covariance.isApprox(pose->covariance.transpose(), 1e-12));
  }
}

/// A robot at 1.4 m/s for 20 s: SLAM is accurate to 1 cm four times a second; odometry reports the pose of up
/// to `jitter` seconds from its stamp, and its heading drifts by `heading` (rad, 1 sigma) per estimate.
/// Returns the error of the propagated poses just before each later estimate: real RMS and predicted, in m,
/// and the same for heading, in rad.
struct Propagated {
  double error = 0, predicted = 0, yaw = 0, predicted_yaw = 0;
};
Propagated propagate(double jitter, double heading) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> unit;
  PoseTrack track(robot(), {});
  Propagated sum;
  int words = 0;
  Pose2 T_odom_base{};
  double last = 0;
  for (int i = 0; i < 80; ++i) {
    const double t = 0.25 * i, seen = t + jitter * unit(random);
    T_odom_base = T_odom_base * Pose2{1.4 * (seen - last), 0, heading * unit(random)};
    last = seen;
    track.add(odometry(t, T_odom_base));
    const Pose2 T_map_base{1.4 * t, 0, 0};
    const auto propagated = track.at(at_seconds(t));
    if (propagated && i > 40) {
      ++words;
      const Pose2 guess = planar(propagated->T_map_base);
      sum.error += (guess.position() - T_map_base.position()).squaredNorm() / 2;
      sum.yaw += guess.yaw * guess.yaw;
      sum.predicted += propagated->covariance(0, 0) / 2 + propagated->covariance(1, 1) / 2;
      sum.predicted_yaw += propagated->covariance(5, 5);
    }
    track.add(estimate(t, T_map_base));
  }
  for (double* mean : {&sum.error, &sum.predicted, &sum.yaw, &sum.predicted_yaw})
    *mean = std::sqrt(*mean / words);
  return sum;
}

TEST(PoseTrack, PredictsTheErrorOfWorseThanDescribedOdometry) {
  const Propagated late = propagate(0.05, 0);
  EXPECT_GT(late.error, 0.04);
  EXPECT_NEAR(late.predicted / late.error, 1, 0.35);
  const Propagated winding = propagate(0, 0.03);
  EXPECT_GT(winding.yaw, 0.02);
  EXPECT_NEAR(winding.predicted_yaw / winding.yaw, 1, 0.35);
}

TEST(PoseTrack, NeverPredictsLessErrorThanTheOdometryDescription) {
  const Propagated exact = propagate(0, 0);
  EXPECT_LT(exact.error, 1e-9);
  // 5 % of the 0.35 m between two estimates, and the estimate's own centimetre.
  EXPECT_NEAR(exact.predicted, std::hypot(0.05 * 0.35, 0.01), 0.003);
}

TEST(PoseTrack, CovarianceDoesNotGrowAtStandstill) {
  PoseTrack track(robot(), {});
  for (int i = 0; i <= 40; ++i) track.add(odometry(0.05 * i, {1, 2, 0.3}));
  track.add(estimate(0.1, {7, 8, 0.5}));
  const auto pose = track.at(at_seconds(2.0));
  ASSERT_TRUE(pose);
  EXPECT_NEAR(pose->covariance(0, 0), 1e-4, 1e-12);
  EXPECT_NEAR(pose->twist.vx, 0, 1e-12);
}

TEST(PoseTrack, ReportsWhyThereIsNoPose) {
  PoseTrackOptions options;
  options.map_id = "a";
  PoseTrack track(robot(), options);
  const auto why = [&track](double t) {
    NoPose reason{};
    EXPECT_FALSE(track.at(at_seconds(t), &reason));
    return reason;
  };
  EXPECT_EQ(why(0), NoPose::no_slam);
  for (int i = 0; i <= 60; ++i) track.add(odometry(0.1 * i, {0.1 * i, 0, 0}));
  EXPECT_EQ(why(6), NoPose::no_slam);
  PoseEstimate foreign = estimate(5.5, {5.5, 0, 0});
  foreign.map_id = "b";
  EXPECT_EQ(track.add(foreign), PoseTrack::Correction::ignored);
  EXPECT_EQ(why(6), NoPose::map_mismatch);
  EXPECT_EQ(track.add(estimate(5.6, {5.6, 0, 0})), PoseTrack::Correction::first);
  EXPECT_TRUE(track.at(at_seconds(6)));
  EXPECT_EQ(why(6.6), NoPose::too_far_ahead);
  EXPECT_EQ(why(3.9), NoPose::older_than_history);
  PoseEstimate lost = estimate(5.7, {5.7, 0, 0});
  lost.state = SlamState::lost;
  track.add(lost);
  EXPECT_EQ(why(6), NoPose::slam_lost);
  EXPECT_EQ(track.add(estimate(5.8, {5.8, 0, 0})), PoseTrack::Correction::small);
  EXPECT_TRUE(track.at(at_seconds(6)));
}

TEST(PoseTrack, SlamIsSilentOnlyAfterAWhileInWhichTheRobotMoved) {
  const auto why_at_end = [](double speed, double yaw_rate, double seconds_after) {
    PoseTrack track(robot(), {});
    for (int i = 0; i <= 10; ++i) track.add(odometry(0.1 * i, {}));
    track.add(estimate(1, {}));
    const int steps = static_cast<int>(10 * seconds_after);
    for (int i = 1; i <= steps; ++i) track.add(odometry(1 + 0.1 * i, moved({speed, 0, yaw_rate}, 0.1 * i)));
    NoPose why = NoPose::no_slam;
    return track.at(at_seconds(1 + 0.1 * steps), &why) ? std::optional<NoPose>() : why;
  };
  EXPECT_EQ(why_at_end(0, 0, 3600), std::nullopt) << "standing, for an hour";
  EXPECT_EQ(why_at_end(1, 0, 1.9), std::nullopt) << "1.9 m, but in less than 2 s";
  EXPECT_EQ(why_at_end(0.1, 0, 9), std::nullopt) << "0.9 m";
  EXPECT_EQ(why_at_end(0, 0.1, 7), std::nullopt) << "0.7 rad";
  EXPECT_EQ(why_at_end(1, 0, 2.4), NoPose::slam_silent);
  EXPECT_EQ(why_at_end(0.1, 0, 11), NoPose::slam_silent);
  EXPECT_EQ(why_at_end(0, 0.5, 2.5), NoPose::slam_silent);
}

/// AMCL's defaults: an estimate once it moved 0.25 m or turned 0.2 rad, here with a delay of a second.
TEST(PoseTrack, ALocalizationThatSendsOnMotionAloneIsNotSilent) {
  for (const Twist2& twist : {Twist2{0.05, 0, 0}, Twist2{0.5, 0, 0.2}, Twist2{1, 0, 0}, Twist2{0, 0, 0.6}}) {
    PoseTrack track(robot(), {});
    std::vector<double> due;
    Pose2 sent;
    for (int i = 0; i < 1200; ++i) {
      const double t = 0.05 * i, moving = std::max(0.0, t < 30 ? t - 1 : 29.0);
      const Pose2 here = moved(twist, moving);
      track.add(odometry(t, here));
      const Pose2 since = sent.inverse() * here;
      if (i == 0 || since.position().norm() > 0.25 || std::abs(since.yaw) > 0.2) {
        due.push_back(t);
        sent = here;
      }
      while (!due.empty() && (t >= due.front() + 1 || due.front() == 0)) {
        track.add(estimate(due.front(), moved(twist, std::max(0.0, due.front() - 1))));
        due.erase(due.begin());
      }
      ASSERT_TRUE(track.at(at_seconds(t))) << t;
    }
  }
}

TEST(PoseTrack, AnEstimateEndsTheSilence) {
  PoseTrack track(robot(), {});
  for (int i = 0; i <= 60; ++i) {
    track.add(odometry(0.1 * i, {0.1 * i, 0, 0}));
    if (i == 10) track.add(estimate(1, {1, 0, 0}));
  }
  ASSERT_TRUE(track.silence(at_seconds(6)));
  EXPECT_NEAR(track.silence(at_seconds(6))->time.seconds(), 5, 1e-9);
  EXPECT_NEAR(track.silence(at_seconds(6))->distance, 5, 1e-3);
  EXPECT_EQ(track.add(estimate(5.9, {5.9, 0, 0})), PoseTrack::Correction::small);
  EXPECT_FALSE(track.silence(at_seconds(6)));
  EXPECT_TRUE(track.at(at_seconds(6)));
}

TEST(PoseTrack, JumpsInARowAreNotRelocalizations) {
  PoseTrack track(robot(), {});
  for (int i = 0; i <= 100; ++i) track.add(odometry(0.1 * i, {}));
  track.add(estimate(8.1, {}));
  EXPECT_EQ(track.add(estimate(8.2, {3, 0, 0})), PoseTrack::Correction::relocalization);
  EXPECT_EQ(track.add(estimate(8.3, {-1, 0, 0})), PoseTrack::Correction::relocalization);
  EXPECT_EQ(track.add(estimate(8.4, {2, 0, 0})), PoseTrack::Correction::jump);
  track.add(estimate(8.5, {2, 0, 0}));
  NoPose why{};
  EXPECT_FALSE(track.at(at_seconds(10), &why));
  EXPECT_EQ(why, NoPose::jumping);
  for (int i = 101; i <= 140; ++i) {
    track.add(odometry(0.1 * i, {}));
    track.add(estimate(0.1 * i, {2, 0, 0}));
  }
  EXPECT_TRUE(track.at(at_seconds(14)));
}

TEST(PoseTrack, RelocalizationStaysOffUntilTheCovarianceRecovers) {
  PoseTrack track(robot(), {});
  for (int i = 0; i <= 40; ++i) track.add(odometry(0.05 * i, {0, 0, 0}));
  track.add(estimate(0.5, {0, 0, 0}));
  EXPECT_EQ(track.add(estimate(0.6, {0.19, 0, 0})), PoseTrack::Correction::small);
  EXPECT_EQ(track.add(estimate(0.7, {0.5, 0, 0}, 0.2)), PoseTrack::Correction::relocalization);
  NoPose why{};
  EXPECT_FALSE(track.at(at_seconds(1), &why));
  EXPECT_EQ(why, NoPose::relocalizing);
  EXPECT_EQ(track.add(estimate(0.8, {0.5, 0, 0}, 0.2)), PoseTrack::Correction::small);
  EXPECT_FALSE(track.at(at_seconds(1)));
  EXPECT_EQ(track.add(estimate(0.9, {0.5, 0, 0}, 0.02)), PoseTrack::Correction::small);
  EXPECT_TRUE(track.at(at_seconds(1)));
  EXPECT_EQ(track.add(estimate(1.0, {0.5, 0, 0.1}, 0.02)), PoseTrack::Correction::relocalization)
      << "more than 5 degrees";
}

TEST(PoseTrack, RejectsAndCountsBackwardStamps) {
  PoseTrack track(robot(), {});
  for (int i = 0; i <= 10; ++i) track.add(odometry(0.1 * i, {0.1 * i, 0, 0}));
  track.add(estimate(1.0, {1, 0, 0}));
  track.add(odometry(0.55, {100, 0, 0}));
  EXPECT_EQ(track.add(estimate(0.9, {50, 0, 0})), PoseTrack::Correction::ignored);
  PoseEstimate late = estimate(1.05, {50, 0, 0});
  late.causal = false;
  EXPECT_EQ(track.add(late), PoseTrack::Correction::ignored);
  EXPECT_EQ(track.rejected(), 3U);
  EXPECT_NEAR(track.at(at_seconds(0.55))->T_map_base.translation().x(), 0.55, 1e-6);
}

TEST(PoseTrack, RestartsWhenTheSensorClockRestarts) {
  PoseTrack track(robot(), {});
  track.add(odometry(3600, {0, 0, 0}));
  track.add(estimate(3600, {1, 1, 0}));
  for (int i = 0; i <= 10; ++i) track.add(odometry(0.1 * i, {0.1 * i, 0, 0}));
  NoPose why{};
  EXPECT_FALSE(track.at(at_seconds(0.9), &why));
  EXPECT_EQ(why, NoPose::no_slam);
  EXPECT_EQ(track.add(estimate(1.0, {9, 0, 0})), PoseTrack::Correction::first);
  EXPECT_NEAR(track.at(at_seconds(0.9))->T_map_base.translation().x(), 8.9, 1e-6);
}

TEST(PoseTrack, HasNoPoseInTheMiddleOfAGap) {
  PoseTrack track(robot(), {});
  track.add(odometry(0, {}));
  track.add(odometry(0.1, {0.1, 0, 0}));
  track.add(odometry(1.9, {1.9, 0, 0}));
  track.add(estimate(1.9, {1.9, 0, 0}));
  NoPose why{};
  EXPECT_FALSE(track.at(at_seconds(1.0), &why));
  EXPECT_EQ(why, NoPose::no_odometry);
  EXPECT_TRUE(track.at(at_seconds(1.5)));
}

TEST(PoseTrack, UsesEstimatesAloneWithoutOdometry) {
  PoseTrack track(robot(), {});
  NoPose why{};
  track.add(estimate(0, {0, 0, 0}));
  track.add(estimate(0.1, {0.1, 0, 0}));
  EXPECT_NEAR(track.at(at_seconds(0.05))->T_map_base.translation().x(), 0.05, 1e-9);
  EXPECT_NEAR(track.at(at_seconds(0.1))->T_map_base.translation().x(), 0.1, 1e-12);
  const auto ahead = track.at(at_seconds(0.3));
  ASSERT_TRUE(ahead);
  EXPECT_NEAR(ahead->T_map_base.translation().x(), 0.3, 1e-9);
  EXPECT_GT(ahead->covariance(0, 0), track.at(at_seconds(0.2))->covariance(0, 0));
  EXPECT_GT(track.at(at_seconds(0.2))->covariance(0, 0), 1e-4);
  EXPECT_FALSE(track.at(at_seconds(0.7), &why));
  EXPECT_EQ(why, NoPose::too_far_ahead);
  EXPECT_FALSE(track.has_odometry());
}

TEST(PoseTrack, LateOdometryTakesOverWithoutARelocalization) {
  PoseTrack track(robot(), {});
  track.add(estimate(0, {0, 0, 0}));
  track.add(estimate(0.1, {0.1, 0, 0}));
  track.add(odometry(0.1, {50, 0, 0}));
  track.add(odometry(0.2, {50.1, 0, 0}));
  EXPECT_EQ(track.add(estimate(0.2, {0.2, 0, 0})), PoseTrack::Correction::small);
  EXPECT_NEAR(track.at(at_seconds(0.15))->T_map_base.translation().x(), 0.15, 1e-9);
}

TEST(PoseTrack, AllocatesNothingAfterConstruction) {
  PoseTrack track(robot(), {});
  const PoseEstimate word = estimate(0, {});
  const test::AllocationWatch watch;
  for (int i = 0; i < 6000; ++i) {
    const double t = 0.01 * i;
    track.add(odometry(t, on_circle(t)));
    if (i % 10 == 5) {
      PoseEstimate e;
      e.stamp = at_seconds(t);
      e.T_map_base = transform<Map, Base>(on_circle(t));
      e.state = SlamState::tracking;
      track.add(e);
    }
    track.at(at_seconds(t + 0.02));
  }
  EXPECT_EQ(watch.count(), 0U);
}

TEST(PredictedError, HasTheLeverArmOfYaw) {
  PoseAtInstant pose;
  pose.covariance(0, 0) = pose.covariance(1, 1) = 0.0004;
  pose.covariance(5, 5) = 0.0001;
  EXPECT_NEAR(predicted_error(pose, {0, 0, 0}), 0.02, 1e-12);
  EXPECT_NEAR(predicted_error(pose, {10, 0, 0}), std::sqrt(0.0004 + 0.01), 1e-12);
  EXPECT_NEAR(predicted_error(pose, {0, -10, 1}), std::sqrt(0.0004 + 0.01), 1e-12);
}

}  // namespace
}  // namespace parhelion::pose
