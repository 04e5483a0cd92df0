// A true drive as the server follows it: odometry and late SLAM estimates into a pose track, scans matched to
// the map.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "fusion/pose/matching/scan_points.hpp"
#include "fusion/pose/pose_track.hpp"
#include "fusion/pose/scan_refinement.hpp"
#include "tests/fusion/pose/true_drive.hpp"

namespace parhelion::test {

/// As the building was mapped, from true poses.
inline std::shared_ptr<const pose::MatchingMap> matching_map(const TrueBuilding& building,
                                                             const RobotDescription& robot,
                                                             double range_sigma = 0.01) {
  RobotDescription frozen = robot;
  frozen.laser->beam_interval = frozen.laser->pass_period = 0;
  auto map = std::make_shared<pose::MatchingMap>();
  for (const pose::MappedScan& scan : true_map(building, robot, range_sigma)) {
    const auto points = pose::deskewed(scan.scan, *frozen.laser, {}).points;
    map->fine.add(points, scan.T_map_base);
    map->coarse.add(points, scan.T_map_base);
  }
  map->fine.finish();
  map->coarse.finish();
  return map;
}

/// Seconds to add to odometry's stamps at t, s since the start.
using StampShift = std::function<double(double t)>;

/// Each stamp shifted; they stay in order.
inline void shift_odometry(const StampShift& shift, double period, TrueDrive& drive) {
  SensorTime last{};
  for (std::size_t i = 0; i < drive.odometry.size(); ++i) {
    SensorTime& stamp = drive.odometry[i].stamp;
    stamp = std::max(stamp + seconds(shift(period * static_cast<double>(i))), last + milliseconds(1));
    last = stamp;
  }
}

/// Wheels that slip: for the last `slip` of each `period` seconds they turn by half as much again as the
/// robot moves.
inline void let_slip(double slip, double period, double odometry_period, TrueDrive& drive) {
  Pose2 before = planar(drive.odometry.front().T_odom_base), sum = before;
  for (std::size_t i = 1; i < drive.odometry.size(); ++i) {
    const Pose2 now = planar(drive.odometry[i].T_odom_base);
    const double t = odometry_period * static_cast<double>(i);
    const bool slips = std::fmod(t, period) > period - slip;
    sum = sum * moved(twist_to(before.inverse() * now), slips ? 1.5 : 1.0);
    drive.odometry[i].T_odom_base = transform<Odom, Base>(sum);
    before = now;
  }
}

/// One scan with a pose.
struct FollowedScan {
  double t = 0;  ///< s since the start
  Pose2 truth;   ///< T_map_base at the stamp
  Twist2 true_twist;
  Pose2 predicted;  ///< before the match
  pose::RefinedPose refined;
  pose::PoseAtInstant used;  ///< after the match
  OdometryCorrection calibration;
};

/// SLAM's estimate of each fifth scan (1 cm and 3 mrad, 1 sigma) arrives with the next one. Odometry arrives
/// at its stamp, or when it holds, whichever is later; a scan 30 ms after its stamp.
inline std::vector<FollowedScan> followed(const TrueDrive& drive,
                                          std::shared_ptr<const pose::MatchingMap> map,
                                          double odometry_period,
                                          const pose::PoseTrackOptions& options = {}) {
  const SensorTime start{TrueDrive::kStart};
  std::mt19937 random(41);
  std::normal_distribution<double> noise;
  pose::PoseTrack track(drive.robot, options);
  pose::ScanRefiner refiner(*drive.robot.laser, std::move(map));
  std::vector<FollowedScan> scans;
  std::optional<PoseEstimate> slam;
  std::size_t next = 0;
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    const TrueScan& at = drive.scans[i];
    const double t = (at.scan.stamp - start).seconds();
    for (; next < drive.odometry.size(); ++next) {
      const double holds = odometry_period * static_cast<double>(next);
      if (std::max(holds, (drive.odometry[next].stamp - start).seconds()) > t + 0.03) break;
      track.add(drive.odometry[next]);
    }
    if (slam) track.add(*slam);
    slam.reset();
    const Pose2 off{0.01 * noise(random), 0.01 * noise(random), 0.003 * noise(random)};
    if (i % 5 == 0) {
      slam.emplace();
      slam->stamp = at.scan.stamp;
      slam->T_map_base = transform<Map, Base>(at.T_map_base * off);
      slam->covariance.diagonal() << 1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 9e-6;
      slam->state = SlamState::tracking;
    }
    const auto prior = track.match_prior(at.scan.stamp);
    if (!prior) continue;
    FollowedScan scan{t, at.T_map_base, at.twist, prior->T_map_base, refiner.refine(at.scan, *prior), {}, {}};
    if (scan.refined.match == pose::ScanMatch::matched)
      track.refine(at.scan.stamp, scan.refined.T_map_base, scan.refined.covariance, scan.refined.twist);
    const auto used = track.at(at.scan.stamp);
    if (!used) continue;
    scan.used = *used;
    scan.calibration = track.calibration().estimate();
    scans.push_back(std::move(scan));
  }
  return scans;
}

/// m, largest over phantoms 8 m before and beside the robot.
inline double phantom_error(const Pose2& used, const Pose2& truth) {
  double worst = 0;
  for (const double angle : {-1.2, 0.0, 1.2}) {
    const Eigen::Vector2d phantom = truth * Eigen::Vector2d(8 * std::cos(angle), 8 * std::sin(angle));
    worst = std::max(worst, (used.inverse() * phantom - truth.inverse() * phantom).norm());
  }
  return worst;
}

}  // namespace parhelion::test
