#include "fusion/pose/calibration/turn_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "protocols/frames.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::pose {
namespace {

constexpr double kShortestWindow = 2, kLongestWindow = 3;  ///< s
constexpr std::size_t kMinPoses = 5;                       ///< of a window
constexpr double kKnee = 9;  ///< of the robust weight (Geman-McClure), squared sigmas
/// 1 sigma of what is thought possible around the start: keeps what a drive does not show from running away.
const TurnSigmas kPrior(0.5, 0.3, 0.2);
constexpr double kFixed = 1e-9;
constexpr double kMinNoise = 1e-4;  ///< rad

/// One heading of a window: what is observed, and the derivatives by the parameters.
struct Row {
  double residual = 0;
  Eigen::Vector3d J = Eigen::Vector3d::Zero();
  double rate = 0;    ///< rad/s
  double weight = 1;  ///< 1 / variance
  double trust = 1;   ///< the robust part of the weight
};
using Rows = std::vector<std::vector<Row>>;

Rows rows_at(const std::vector<TurnWindow>& windows, const TurnValues& values) {
  // Long, as over a short step the derivative is the noise of the sensor, which would look like a turn that
  // shows the offset. (As an instrument it need not be exact.)
  constexpr double h = 0.05;  // s
  const auto turned = [](const TurnWindow& window, std::size_t k, double offset) {
    const Duration o = seconds(offset);
    return window.sensor->between(window.stamp.front() - o, window.stamp[k] - o);
  };
  Rows all;
  for (const TurnWindow& window : windows) {
    std::vector<Row> rows;
    for (std::size_t k = 0; k < window.stamp.size(); ++k) {
      const auto angle = turned(window, k, values[0]), later = turned(window, k, values[0] + h),
                 earlier = turned(window, k, values[0] - h);
      if (!angle || !later || !earlier) continue;
      const double dt = (window.stamp[k] - window.stamp.front()).seconds();
      const double unbiased = *angle - values[2] * dt;
      rows.push_back({window.heading[k] - values[1] * unbiased,
                      {-values[1] * (*later - *earlier) / (2 * h), -unbiased, values[1] * dt},
                      (*later - *earlier) / (2 * h)});
    }
    all.push_back(std::move(rows));
  }
  return all;
}

/// Takes the window's own heading out, by the weights.
void centre(Rows& all) {
  for (std::vector<Row>& rows : all) {
    double weights = 0, mean = 0;
    Eigen::Vector3d J = Eigen::Vector3d::Zero();
    for (const Row& row : rows)
      weights += row.weight, mean += row.weight * row.residual, J += row.weight * row.J;
    if (!(weights > 0)) continue;
    for (Row& row : rows) row.residual -= mean / weights, row.J -= J / weights;
  }
}

/// Of a heading, rad; and of the stamps, s, which a turn makes an error of the heading.
TurnNoise noise_of(const Rows& all) {
  constexpr double slow = 0.15;  // rad/s
  constexpr std::size_t enough = 20;
  const auto variance = [](const Row& row) { return std::pow(1.4826 * row.residual, 2); };
  std::vector<double> still, any, jitter;
  for (const std::vector<Row>& rows : all) {
    for (const Row& row : rows) {
      any.push_back(variance(row));
      if (std::abs(row.rate) < slow) still.push_back(any.back());
    }
  }
  if (any.empty()) return {kMinNoise, 0};
  TurnNoise noise;
  noise.heading = std::max(std::sqrt(median(still.size() >= enough ? still : any)), kMinNoise);
  for (const std::vector<Row>& rows : all) {
    for (const Row& row : rows) {
      if (std::abs(row.rate) >= slow)
        jitter.push_back((variance(row) - std::pow(noise.heading, 2)) / std::pow(row.rate, 2));
    }
  }
  if (jitter.size() >= enough) noise.jitter = std::sqrt(std::max(median(jitter), 0.0));
  return noise;
}

void weigh(Rows& all, const TurnNoise& noise) {
  for (std::vector<Row>& rows : all) {
    for (Row& row : rows) {
      const double variance = std::pow(noise.heading, 2) + std::pow(noise.jitter * row.rate, 2);
      row.trust = std::pow(kKnee / (kKnee + row.residual * row.residual / variance), 2);
      row.weight = row.trust / variance;
    }
  }
}

/// Rows with their weights, each window's own heading taken out.
Rows weighted(const std::vector<TurnWindow>& windows, const TurnValues& values, TurnNoise& noise) {
  const Rows raw = rows_at(windows, values);
  Rows rows = raw;
  centre(rows);
  noise = noise_of(rows);
  weigh(rows, noise);
  // Again, as an outlier has moved the window's heading.
  for (std::size_t w = 0; w < rows.size(); ++w) {
    for (std::size_t k = 0; k < rows[w].size(); ++k)
      rows[w][k].residual = raw[w][k].residual, rows[w][k].J = raw[w][k].J;
  }
  centre(rows);
  return rows;
}

}  // namespace

std::vector<TurnWindow> turn_windows(const std::vector<LaserPose>& laser, const TurnPath& sensor) {
  std::vector<TurnWindow> windows;
  if (laser.empty()) return windows;
  const double length =
      std::clamp((laser.back().stamp - laser.front().stamp).seconds() / 20, kShortestWindow, kLongestWindow);
  TurnWindow open{&sensor, {}, {}};
  const auto close = [&] {
    if (open.stamp.size() >= kMinPoses) windows.push_back(std::move(open));
    open = {&sensor, {}, {}};
  };
  double last = 0;
  for (const LaserPose& pose : laser) {
    if (!pose.T_map_laser.finite()) continue;
    if (!open.stamp.empty() && pose.stamp <= open.stamp.back()) continue;
    const bool full = !open.stamp.empty() && (pose.stamp - open.stamp.front()).seconds() > length;
    if (full || !pose.linked) close();
    // As far as the offset is not known, the sensor need not be on at the very instant.
    const double before = open.heading.empty() ? 0 : open.heading.back();
    open.heading.push_back(open.heading.empty() ? 0 : before + wrap_angle(pose.T_map_laser.yaw - last));
    open.stamp.push_back(pose.stamp);
    last = pose.T_map_laser.yaw;
  }
  close();
  std::erase_if(windows, [&sensor](const TurnWindow& window) {
    return !sensor.between(window.stamp.front(), window.stamp.back());
  });
  return windows;
}

std::optional<TurnFit> fit_turns(const std::vector<TurnWindow>& windows, const TurnValues& start,
                                 const TurnFree& free) {
  constexpr int kIterations = 8;
  TurnFit fit{start, {}, {}, 0};
  Eigen::Matrix3d information;
  for (int i = 0; i < kIterations; ++i) {
    const Rows rows = weighted(windows, fit.values, fit.noise);
    information.setZero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    fit.outliers = 0;
    for (const std::vector<Row>& each : rows) {
      for (const Row& row : each) {
        information += row.weight * row.J * row.J.transpose();
        gradient += row.weight * row.J * row.residual;
        if (row.trust < 0.04) ++fit.outliers;
      }
    }
    for (int k = 0; k < 3; ++k) {
      const double prior = free[static_cast<std::size_t>(k)] ? kPrior[k] : kFixed;
      information(k, k) += 1 / (prior * prior);
      gradient[k] += (fit.values[k] - start[k]) / (prior * prior);
    }
    const Eigen::Vector3d step = information.ldlt().solve(-gradient);
    if (!step.allFinite()) return std::nullopt;
    for (int k = 0; k < 3; ++k) {
      if (free[static_cast<std::size_t>(k)]) fit.values[k] += std::clamp(step[k], -0.1, 0.1);
    }
  }
  fit.sigmas = information.inverse().diagonal().cwiseMax(0).cwiseSqrt();
  return fit;
}

namespace {

struct Agreement {
  double ratio = 0;    ///< of the sensor's turns to those of the scans
  double apart = 1e9;  ///< mean of bounded squares, at a scale of one
};

/// A bias makes a slope of each window; the median counts.
void remove_bias(Rows& rows) {
  std::vector<double> slopes;
  for (const std::vector<Row>& each : rows) {
    double rise = 0, run = 0;
    for (const Row& row : each) rise += row.residual * row.J[2], run += row.J[2] * row.J[2];
    if (run > 0) slopes.push_back(rise / run);
  }
  if (slopes.empty()) return;
  const double slope = median(slopes);
  for (std::vector<Row>& each : rows) {
    for (Row& row : each) {
      row.residual -= slope * row.J[2];
      row.J[1] -= slope * row.J[2];
    }
  }
}

Agreement agreement(const std::vector<TurnWindow>& windows, double offset) {
  constexpr double kGood = 0.01, kBad = 25;  // rad, squared sigmas
  Rows rows = rows_at(windows, {offset, 1, 0});
  centre(rows);
  remove_bias(rows);
  double sum = 0, hh = 0, hs = 0;
  std::size_t count = 0, all = 0;
  for (std::size_t w = 0; w < rows.size(); ++w) {
    all += windows[w].stamp.size();
    for (const Row& row : rows[w]) {
      // The derivative by the scale is the sensor's own turn, the residual what the scans turn beyond that.
      const double sensor = -row.J[1], scans = row.residual + sensor;
      hh += scans * scans, hs += scans * sensor;
      sum += std::min(kBad, std::pow(row.residual / kGood, 2));
      ++count;
    }
  }
  if (2 * count < all) return {};
  return {hh > 0 ? hs / hh : 0, sum / static_cast<double>(std::max<std::size_t>(count, 1))};
}

/// At most so many windows decide about the rough offset.
std::vector<TurnWindow> some_of(const std::vector<TurnWindow>& windows) {
  constexpr std::size_t kMaxWindows = 60;
  if (windows.size() <= kMaxWindows) return windows;
  std::vector<TurnWindow> some;
  for (std::size_t i = 0; i < kMaxWindows; ++i) some.push_back(windows[i * windows.size() / kMaxWindows]);
  return some;
}

}  // namespace

double rough_offset(const std::vector<TurnWindow>& windows, double start) {
  const std::vector<TurnWindow> some = some_of(windows);
  double best = start, lowest = 0.95 * agreement(some, start).apart;
  for (int i = -50; i <= 50; ++i) {
    const double apart = agreement(some, start + 0.02 * i).apart;
    if (apart < lowest) lowest = apart, best = start + 0.02 * i;
  }
  return best;
}

double turn_ratio(const std::vector<TurnWindow>& windows, double offset) {
  return agreement(windows, offset).ratio;
}

}  // namespace parhelion::pose
