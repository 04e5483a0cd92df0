#include "tests/bench/reference_trajectory.hpp"

#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/poses/CPose3DPDF.h>
#include <mrpt/poses/CPosePDF.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/slam/CICP.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace parhelion::bench {
namespace {

constexpr double kExcluded = 2;    ///< s around a stamp
constexpr double kBlock = 2;       ///< s of scans that share a map
constexpr double kCell = 0.03;     ///< m, the map's points are averaged in cells
constexpr double kGoodness = 0.5;  ///< least fraction of paired returns
constexpr int kRounds = 2;         ///< the second corrects for motion within sweeps by the first's result

struct MapScan {
  double seconds;
  std::vector<Eigen::Vector2d> points;  ///< m, map
};

std::vector<Eigen::Vector2d> points_in_map(const mrpt::obs::CObservation2DRangeScan& scan,
                                           const mrpt::poses::CPose3D& T_map_base) {
  mrpt::maps::CSimplePointsMap points;
  points.insertionOptions.minDistBetweenLaserPoints = 0;
  points.insertionOptions.also_interpolate = false;
  points.insertObservation(scan, T_map_base);
  std::vector<Eigen::Vector2d> all;
  for (std::size_t i = 0; i < points.size(); ++i) {
    float x = 0, y = 0;
    points.getPoint(i, x, y);
    all.emplace_back(x, y);
  }
  return all;
}

Result<std::vector<MapScan>> load_map(const std::string& path) {
  mrpt::maps::CSimpleMap map;
  if (!map.loadFromFile(path)) return Error{path + ": is not a readable .simplemap"};
  std::vector<MapScan> scans;
  for (std::size_t i = 0; i < map.size(); ++i) {
    mrpt::poses::CPose3DPDF::ConstPtr pose;
    mrpt::obs::CSensoryFrame::ConstPtr frame;
    map.get(i, pose, frame);
    mrpt::poses::CPose3D mean;
    pose->getMean(mean);
    for (const auto& observation : *frame) {
      const auto scan = std::dynamic_pointer_cast<mrpt::obs::CObservation2DRangeScan>(observation);
      if (scan) scans.push_back({mrpt::Clock::toDouble(scan->timestamp), points_in_map(*scan, mean)});
    }
  }
  if (scans.empty()) return Error{path + ": contains no 2D range scan"};
  return scans;
}

/// Averaged in cells, so that a wall that many scans saw is one line.
mrpt::maps::CSimplePointsMap map_without(const std::vector<MapScan>& scans, double from, double to) {
  std::map<std::pair<long, long>, std::pair<Eigen::Vector2d, int>> cells;
  for (const MapScan& scan : scans) {
    if (scan.seconds > from && scan.seconds < to) continue;
    for (const Eigen::Vector2d& p : scan.points) {
      auto& cell =
          cells
              .try_emplace({std::lround(p.x() / kCell), std::lround(p.y() / kCell)}, Eigen::Vector2d(0, 0), 0)
              .first->second;
      cell.first += p;
      ++cell.second;
    }
  }
  mrpt::maps::CSimplePointsMap points;
  for (const auto& [index, cell] : cells) {
    const Eigen::Vector2d mean = cell.first / cell.second;
    points.insertPoint(static_cast<float>(mean.x()), static_cast<float>(mean.y()));
  }
  return points;
}

/// In the base's frame at the stamp.
mrpt::maps::CSimplePointsMap points_at_stamp(const Scan& scan, const LaserDescription& laser,
                                             const Twist2& twist) {
  mrpt::maps::CSimplePointsMap points;
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    if (laser.convention.classify(scan.ranges[i]) != BeamKind::hit) continue;
    const double angle = static_cast<double>(scan.angle_min) +
                         static_cast<double>(i) * static_cast<double>(scan.angle_increment);
    const auto range = static_cast<double>(scan.ranges[i]);
    const Eigen::Vector3d p_laser(range * std::cos(angle), range * std::sin(angle), 0);
    const Eigen::Vector2d p_base = (laser.T_base_laser * p_laser).head<2>();
    const double dt = laser.beam_time(i, scan.ranges.size()).seconds();
    const Eigen::Vector2d p = moved(twist, dt) * p_base;
    points.insertPoint(static_cast<float>(p.x()), static_cast<float>(p.y()));
  }
  return points;
}

mrpt::slam::CICP make_icp() {
  mrpt::slam::CICP icp;
  icp.options.ICP_algorithm = mrpt::slam::icpClassic;
  icp.options.maxIterations = 200;
  icp.options.thresholdDist = 0.3;
  icp.options.smallestThresholdDist = 0.05;
  icp.options.corresponding_points_decimation = 1;
  icp.options.skip_cov_calculation = true;
  return icp;
}

ReferencePose aligned(const mrpt::maps::CSimplePointsMap& map, const ReferenceScan& scan,
                      const LaserDescription& laser, const Twist2& twist) {
  mrpt::slam::CICP icp = make_icp();
  const auto points = points_at_stamp(scan.scan, laser, twist);
  ReferencePose result{scan.scan.stamp, scan.guess, scan.guess, {}, 0};
  if (points.size() < 10) return result;
  mrpt::slam::CICP::TReturnInfo report;
  const auto pdf =
      icp.Align(&map, &points, mrpt::poses::CPose2D(scan.guess.x, scan.guess.y, scan.guess.yaw), report);
  const mrpt::poses::CPose2D mean = pdf->getMeanVal();
  result.T_map_base = result.T_map_base_icp = {mean.x(), mean.y(), mean.phi()};
  result.goodness = report.goodness;
  return result;
}

using State = Eigen::Vector<double, 7>;
using StateCovariance = Eigen::Matrix<double, 7, 7>;
using Block = Eigen::Matrix2d;
constexpr int kStampError = 6;  ///< index in State: s; before it come x, vx, y, vy, yaw, wz, each in the map

/// What ICP leaves on scans with 1 cm of noise, and what a robot's wheels accelerate: 0.5 m/s^2 and
/// 1.5 rad/s^2 over a second.
struct Coordinate {
  double sigma;    ///< m or rad
  double density;  ///< per s^3, of the spectrum of the acceleration
};
constexpr std::array<Coordinate, 3> kCoordinates = {Coordinate{0.01, 0.25}, {0.01, 0.25}, {0.0035, 2.25}};

Eigen::Vector3d unwrapped(const Pose2& pose, double yaw_near) {
  return {pose.x, pose.y, yaw_near + wrap_angle(pose.yaw - yaw_near)};
}

struct Smoothed {
  std::vector<Eigen::Vector3d> poses;       ///< x, y, yaw in the map, at the instants of the scans
  std::vector<Eigen::Vector3d> velocities;  ///< per s
  double stamp_sigma = 0;                   ///< s, root mean square of the stamps' errors
};

/// Kalman filter and Rauch-Tung-Striebel smoother: white noise on the accelerations, and on each stamp an
/// error of its own with `stamp_sigma` (s), so that a match shows where the robot was at another instant.
/// `velocities`: about which that is linear. The result's stamp_sigma is the next guess of it (expectation
/// maximization, Shumway and Stoffer 1982).
Smoothed smoothed(const std::vector<ReferencePose>& poses, const std::vector<Eigen::Vector3d>& velocities,
                  double stamp_sigma) {
  struct Step {
    State predicted, filtered;
    StateCovariance P_predicted, P_filtered, F;
  };
  std::vector<Step> steps(poses.size());
  State x = State::Zero();
  const Eigen::Vector3d start = unwrapped(poses.front().T_map_base, 0);
  for (int c = 0; c < 3; ++c) x[2 * c] = start[c];
  StateCovariance P = StateCovariance::Identity();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double dt = i == 0 ? 0 : (poses[i].stamp - poses[i - 1].stamp).seconds();
    Step& step = steps[i];
    step.F.setZero();
    StateCovariance Q = StateCovariance::Zero();
    for (int c = 0; c < 3; ++c) {
      step.F.block<2, 2>(2 * c, 2 * c) << 1, dt, 0, 1;
      Q.block<2, 2>(2 * c, 2 * c) = kCoordinates[static_cast<std::size_t>(c)].density *
                                    (Block() << dt * dt * dt / 3, dt * dt / 2, dt * dt / 2, dt).finished();
    }
    Q(kStampError, kStampError) = stamp_sigma * stamp_sigma;
    step.predicted = step.F * x;
    step.P_predicted = step.F * P * step.F.transpose() + Q;
    x = step.predicted;
    P = step.P_predicted;
    if (poses[i].goodness >= kGoodness) {
      Eigen::Matrix<double, 3, 7> H = Eigen::Matrix<double, 3, 7>::Zero();
      Eigen::Matrix3d R = Eigen::Matrix3d::Zero();
      for (int c = 0; c < 3; ++c) {
        H(c, 2 * c) = 1;
        H(c, kStampError) = velocities[i][c];
        R(c, c) = std::pow(kCoordinates[static_cast<std::size_t>(c)].sigma, 2);
      }
      const Eigen::Vector3d innovation = unwrapped(poses[i].T_map_base, x[4]) - H * x;
      const Eigen::Matrix<double, 7, 3> gain = P * H.transpose() * (H * P * H.transpose() + R).inverse();
      x += gain * innovation;
      P = (P - gain * H * P).eval();
    }
    step.filtered = x;
    step.P_filtered = P;
  }
  Smoothed result{std::vector<Eigen::Vector3d>(poses.size()), std::vector<Eigen::Vector3d>(poses.size())};
  double sum = 0, count = 0;
  for (std::size_t i = poses.size(); i-- > 0;) {
    if (i + 1 < poses.size()) {
      const Step& next = steps[i + 1];
      const StateCovariance G = steps[i].P_filtered * next.F.transpose() * next.P_predicted.inverse();
      x = steps[i].filtered + G * (x - next.predicted);
      P = steps[i].P_filtered + G * (P - next.P_predicted) * G.transpose();
    }
    if (poses[i].goodness >= kGoodness) {
      sum += x[kStampError] * x[kStampError] + P(kStampError, kStampError);
      ++count;
    }
    result.poses[i] = Eigen::Vector3d(x[0], x[2], x[4]) + x[kStampError] * velocities[i];
    result.velocities[i] = {x[1], x[3], x[5]};
  }
  if (count > 0) result.stamp_sigma = std::sqrt(sum / count);
  return result;
}

/// Returns the root mean square of the stamps' errors, s.
double smooth(std::vector<ReferencePose>& poses) {
  constexpr int passes = 30;
  constexpr double none = 1e-4, start = 0.01;  // s
  Smoothed result =
      smoothed(poses, std::vector<Eigen::Vector3d>(poses.size(), Eigen::Vector3d::Zero()), none);
  result.stamp_sigma = start;
  for (int pass = 0; pass < passes; ++pass)
    result = smoothed(poses, result.velocities, std::max(none, result.stamp_sigma));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Eigen::Vector3d& at = result.poses[i];
    const Eigen::Vector3d& v = result.velocities[i];
    poses[i].T_map_base = {at.x(), at.y(), wrap_angle(at.z())};
    const Eigen::Vector2d v_base = Eigen::Rotation2Dd(-at.z()) * v.head<2>();
    poses[i].twist = {v_base.x(), v_base.y(), v.z()};
  }
  return result.stamp_sigma;
}

}  // namespace

Result<ReferenceTrajectory> reference_trajectory(const std::vector<ReferenceScan>& scans,
                                                 const LaserDescription& laser, const std::string& simplemap,
                                                 const std::function<void(double)>& progress) {
  const auto map = load_map(simplemap);
  if (!map) return map.error();
  ReferenceTrajectory trajectory;
  std::vector<ReferencePose>& poses = trajectory.poses;
  for (const ReferenceScan& scan : scans) poses.push_back({scan.scan.stamp, scan.guess, scan.guess, {}, 1});
  if (poses.empty()) return trajectory;
  smooth(poses);
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<ReferencePose> before = poses;
    mrpt::maps::CSimplePointsMap points;
    double block_end = -1;
    for (std::size_t i = 0; i < scans.size(); ++i) {
      const double t = (scans[i].scan.stamp - SensorTime{}).seconds();
      if (t > block_end) {
        block_end = t + kBlock;
        points = map_without(*map, t - kExcluded, block_end + kExcluded);
      }
      ReferenceScan scan = scans[i];
      scan.guess = before[i].T_map_base;
      poses[i] = aligned(points, scan, laser, before[i].twist);
      if (progress) progress((round + static_cast<double>(i) / static_cast<double>(scans.size())) / kRounds);
    }
    trajectory.stamp_sigma = smooth(poses);
  }
  return trajectory;
}

}  // namespace parhelion::bench
