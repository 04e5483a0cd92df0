#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "fusion/pose/calibration/motion_chain.hpp"
#include "protocols/angle_units.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::pose {
namespace {

double rms(const std::vector<double>& values) {
  double squares = 0;
  for (const double value : values) squares += value * value;
  return std::sqrt(squares / static_cast<double>(values.size()));
}

std::vector<double> column(const std::vector<WindowError>& errors, double WindowError::*member) {
  std::vector<double> values;
  values.reserve(errors.size());
  for (const WindowError& error : errors) values.push_back(error.*member);
  return values;
}

/// m^2
double combined(const WindowError& error) {
  return std::pow(error.position, 2) + std::pow(MotionCheck::kArm * error.yaw, 2);
}

struct BlockSum {
  double after = 0, before = 0, count = 0;
};

/// Windows that both have, summed over blocks of time. Those of 5 s are longer than a window, so that errors
/// of one hardly depend on those of another; a short part has shorter ones, and a wide margin instead.
std::vector<BlockSum> block_sums(const MotionCheck& before, const MotionCheck& after) {
  std::vector<BlockSum> blocks;
  if (after.errors.empty()) return blocks;
  const double whole = (after.errors.back().begin - after.errors.front().begin).seconds();
  const double length = std::clamp(whole / 4, 1.0, 5.0);  // s
  SensorTime begin;
  auto old = before.errors.begin();
  for (const WindowError& now : after.errors) {
    while (old != before.errors.end() && old->begin < now.begin) ++old;
    if (old == before.errors.end() || old->begin != now.begin) continue;
    if (blocks.empty() || (now.begin - begin).seconds() > length) {
      blocks.emplace_back();
      begin = now.begin;
    }
    blocks.back().after += combined(now);
    blocks.back().before += combined(*old);
    blocks.back().count += 1;
  }
  return blocks;
}

BlockSum total(const std::vector<BlockSum>& blocks) {
  BlockSum sum;
  for (const BlockSum& block : blocks)
    sum.after += block.after, sum.before += block.before, sum.count += block.count;
  return sum;
}

/// m^2: what cannot be told from the errors of the scans' poses.
constexpr double kSmall = 0.002 * 0.002;

/// By how much errors differ, as logarithms of the ratios of the blocks: one block in which the robot drives
/// far then has no more weight than the others.
struct Ratio {
  double mean = 0, margin = 0;  ///< margin: for chance, wider where blocks are few
  double largest = 0;           ///< of all blocks
};

Ratio ratio_of(const std::vector<BlockSum>& blocks) {
  const auto count = static_cast<double>(blocks.size());
  std::vector<double> logs;
  for (const BlockSum& block : blocks)
    logs.push_back(std::log((block.after / block.count + kSmall) / (block.before / block.count + kSmall)));
  Ratio ratio;
  for (const double log : logs) ratio.mean += log / count;
  ratio.largest = *std::max_element(logs.begin(), logs.end());
  double squares = 0;
  for (const double log : logs) squares += std::pow(log - ratio.mean, 2);
  ratio.margin = 2 * (1 + 2 / (count - 1)) * std::sqrt(squares / (count - 1) / count);
  return ratio;
}

}  // namespace

MotionCheck check_motion(const DriveMotion& drive, const MotionParameters& parameters,
                         double window_seconds) {
  const MotionChain chain = motion_chain(drive);
  MotionCheck check;
  for (std::size_t first = 0; first + 1 < chain.laser.size(); ++first) {
    Pose2 by_odometry, by_laser;
    std::size_t i = first;
    const SensorTime end = chain.laser[first].stamp + seconds(window_seconds);
    bool known = true;
    for (; known && i + 1 < chain.laser.size() && chain.laser[i + 1].stamp <= end; ++i) {
      const auto step = chain.step(i, parameters);
      known = step.has_value();
      if (!known) break;
      by_odometry = by_odometry * *step;
      by_laser = by_laser * chain.laser_step(i, parameters);
    }
    // Windows that a stop or the end of the drive cuts short compare too little.
    if (!known || (chain.laser[i].stamp - chain.laser[first].stamp).seconds() < 0.7 * window_seconds)
      continue;
    const Pose2 error = by_odometry.inverse() * by_laser;
    check.errors.push_back({chain.laser[first].stamp, error.position().norm(), std::abs(error.yaw),
                            std::max(by_odometry.position().norm(), by_laser.position().norm()),
                            std::max(std::abs(by_odometry.yaw), std::abs(by_laser.yaw))});
  }
  check.windows = check.errors.size();
  if (check.errors.empty()) return check;
  auto position = column(check.errors, &WindowError::position), yaw = column(check.errors, &WindowError::yaw);
  check.position_rms = rms(position);
  check.position_p95 = quantile(position, 0.95);
  check.yaw_rms = rms(yaw);
  check.yaw_p95 = quantile(yaw, 0.95);
  check.moved_rms = rms(column(check.errors, &WindowError::moved));
  check.turned_rms = rms(column(check.errors, &WindowError::turned));
  return check;
}

double MotionCheck::combined_rms() const { return std::hypot(position_rms, kArm * yaw_rms); }

double MotionCheck::combined_rms_but_worst() const {
  constexpr double kWorst = 0.15;
  std::vector<double> squares;
  for (const WindowError& error : errors) squares.push_back(combined(error));
  std::sort(squares.begin(), squares.end());
  const auto kept = static_cast<std::size_t>(std::ceil((1 - kWorst) * static_cast<double>(squares.size())));
  if (kept == 0) return 0;
  squares.resize(kept);
  return std::sqrt(std::accumulate(squares.begin(), squares.end(), 0.0) / static_cast<double>(kept));
}

MotionChange change_between(const MotionCheck& before, const MotionCheck& after) {
  constexpr double kWorse = 1.2 * 1.2;
  const std::vector<BlockSum> blocks = block_sums(before, after);
  if (blocks.size() < 3) return MotionChange::as_good;
  const BlockSum all = total(blocks);
  const double now = all.after / all.count, then = all.before / all.count;
  const Ratio ratio = ratio_of(blocks);
  // Where blocks differ much, as turns and straight drives do with a wrong mounting, their scatter is no
  // chance.
  const bool plain = now < then / 4 && ratio.largest < std::log(kWorse);
  if (now < then && (plain || ratio.mean < -ratio.margin)) return MotionChange::better;
  return now > kWorse * then && now > kSmall && ratio.mean > ratio.margin ? MotionChange::worse
                                                                          : MotionChange::as_good;
}

std::string unexplained_error(const MotionCheck& fitted, const MotionCheck& after) {
  // Odometry with noise of 30 % has 0.16; wrong signs, slip and jumping clocks have 0.4 to 2 in one of both.
  constexpr double kFraction = 0.5;
  constexpr double kMoved = 0.1, kTurned = 0.1;  // m, rad: less motion says nothing
  constexpr double kGrown = 5, kSmall = 0.01;    // times, m
  char text[300];
  text[0] = 0;
  const bool no_distance = after.moved_rms > kMoved && after.position_rms > kFraction * after.moved_rms;
  const bool no_turn = after.turned_rms > kTurned && after.yaw_rms > kFraction * after.turned_rms;
  if (no_distance || no_turn) {
    std::snprintf(text, sizeof text,
                  "odometry and scans differ by %.0f mm and %.1f deg over windows in which the robot moves "
                  "%.0f mm and turns %.1f deg: no scale, mounting or time offset explains that",
                  1e3 * after.position_rms, kDegreesPerRadian * after.yaw_rms, 1e3 * after.moved_rms,
                  kDegreesPerRadian * after.turned_rms);
  } else if (fitted.windows > 0 &&
             after.combined_rms_but_worst() > std::max(kGrown * fitted.combined_rms_but_worst(), kSmall)) {
    std::snprintf(
        text, sizeof text,
        "odometry and scans differ by %.0f mm on the validation part, but by %.0f mm on the part that the "
        "result was fitted to (yaw counts at %.1f m, and the worst 15 %% of each part are left out): "
        "something changed between the two",
        1e3 * after.combined_rms_but_worst(), 1e3 * fitted.combined_rms_but_worst(), MotionCheck::kArm);
  }
  return text;
}

ReckonedPath reckoned_path(const DriveMotion& drive, const MotionParameters& parameters) {
  const MotionChain chain = motion_chain(drive);
  ReckonedPath path;
  for (std::size_t i = 0; i < chain.laser.size(); ++i) {
    path.by_laser.push_back(chain.laser[i].T_map_laser * parameters.T_base_laser.inverse());
    const auto step = i > 0 ? chain.step(i - 1, parameters) : std::nullopt;
    // Where odometry is unknown the path goes on from the laser's pose.
    path.by_odometry.push_back(step ? path.by_odometry.back() * *step : path.by_laser.back());
  }
  return path;
}

}  // namespace parhelion::pose
