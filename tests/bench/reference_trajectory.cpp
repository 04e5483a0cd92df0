#include "tests/bench/reference_trajectory.hpp"

#include <mrpt/io/CFileGZInputStream.h>
#include <mrpt/maps/CSimpleMap.h>
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/poses/CPose3DPDF.h>
#include <mrpt/poses/CPosePDF.h>
#include <mrpt/serialization/CArchive.h>
#include <mrpt/slam/CICP.h>

#include <Eigen/LU>
#include <algorithm>
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
  ReferencePose result{scan.scan.stamp, scan.guess, scan.guess, 0};
  if (points.size() < 10) return result;
  mrpt::slam::CICP::TReturnInfo report;
  const auto pdf =
      icp.Align(&map, &points, mrpt::poses::CPose2D(scan.guess.x, scan.guess.y, scan.guess.yaw), report);
  const mrpt::poses::CPose2D mean = pdf->getMeanVal();
  result.T_map_base = result.T_map_base_icp = {mean.x(), mean.y(), mean.phi()};
  result.goodness = report.goodness;
  return result;
}

/// Kalman filter and Rauch-Tung-Striebel smoother of one coordinate: white noise on the acceleration.
/// `density`: per s^3, of its spectrum.
void smooth(const std::vector<ReferencePose>& poses, double sigma, double density,
            std::vector<double>& values) {
  struct Step {
    Eigen::Vector2d predicted, filtered;
    Eigen::Matrix2d P_predicted, P_filtered, F;
  };
  std::vector<Step> steps(poses.size());
  Eigen::Vector2d x(values.front(), 0);
  Eigen::Matrix2d P = Eigen::Vector2d(1, 1).asDiagonal();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double dt = i == 0 ? 0 : (poses[i].stamp - poses[i - 1].stamp).seconds();
    Step& step = steps[i];
    Eigen::Matrix2d Q;
    Q << dt * dt * dt / 3, dt * dt / 2, dt * dt / 2, dt;
    step.F << 1, dt, 0, 1;
    step.predicted = step.F * x;
    step.P_predicted = step.F * P * step.F.transpose() + density * Q;
    x = step.predicted;
    P = step.P_predicted;
    if (poses[i].goodness >= kGoodness) {
      const Eigen::Vector2d gain = P.col(0) / (P(0, 0) + sigma * sigma);
      x += gain * (values[i] - x[0]);
      P -= gain * P.row(0).eval();
    }
    step.filtered = x;
    step.P_filtered = P;
  }
  for (std::size_t i = poses.size(); i-- > 0;) {
    if (i + 1 < poses.size()) {
      const Step& next = steps[i + 1];
      const Eigen::Matrix2d G = steps[i].P_filtered * next.F.transpose() * next.P_predicted.inverse();
      x = steps[i].filtered + G * (x - next.predicted);
    }
    values[i] = x[0];
  }
}

void smooth(std::vector<ReferencePose>& poses) {
  std::vector<double> x, y, yaw;
  for (const ReferencePose& pose : poses) {
    x.push_back(pose.T_map_base.x);
    y.push_back(pose.T_map_base.y);
    yaw.push_back(yaw.empty() ? pose.T_map_base.yaw
                              : yaw.back() + wrap_angle(pose.T_map_base.yaw - yaw.back()));
  }
  // What ICP leaves on scans with 1 cm of noise, and what a robot's wheels accelerate: 0.5 m/s^2 and
  // 1.5 rad/s^2 over a second.
  smooth(poses, 0.01, 0.25, x);
  smooth(poses, 0.01, 0.25, y);
  smooth(poses, 0.0035, 2.25, yaw);
  for (std::size_t i = 0; i < poses.size(); ++i) poses[i].T_map_base = {x[i], y[i], wrap_angle(yaw[i])};
}

/// Body frame, from the neighbours of pose i.
Twist2 twist_at(const std::vector<ReferencePose>& poses, std::size_t i) {
  const ReferencePose& before = poses[i == 0 ? 0 : i - 1];
  const ReferencePose& after = poses[std::min(i + 1, poses.size() - 1)];
  const double dt = (after.stamp - before.stamp).seconds();
  if (dt <= 0 || dt > 1) return {};
  return twist_between(before.T_map_base, after.T_map_base, dt);
}

}  // namespace

Result<std::vector<ReferencePose>> reference_trajectory(const std::vector<ReferenceScan>& scans,
                                                        const LaserDescription& laser,
                                                        const std::string& simplemap,
                                                        const std::function<void(double)>& progress) {
  const auto map = load_map(simplemap);
  if (!map) return map.error();
  std::vector<ReferencePose> poses;
  for (const ReferenceScan& scan : scans) poses.push_back({scan.scan.stamp, scan.guess, scan.guess, 1});
  if (poses.empty()) return poses;
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
      poses[i] = aligned(points, scan, laser, twist_at(before, i));
      if (progress) progress((round + static_cast<double>(i) / static_cast<double>(scans.size())) / kRounds);
    }
    smooth(poses);
  }
  return poses;
}

}  // namespace parhelion::bench
