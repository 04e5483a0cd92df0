#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tools/robot/log_survey.hpp"

namespace parhelion::tools {
namespace {

constexpr double kMinTurn = 0.05, kMaxTurn = 0.5;  // rad between two scans that are compared
constexpr double kMinTotal = 0.5;                  // rad, over all of them
constexpr int kMinPairs = 5;

/// Yaw of odometry nearest to a stamp, rad; nullopt: none within 0.2 s.
std::optional<double> yaw_at(const OdometrySurvey& odometry, SensorTime stamp) {
  const auto& all = odometry.samples;
  auto next = std::lower_bound(all.begin(), all.end(), stamp,
                               [](const Odometry& sample, SensorTime t) { return sample.stamp < t; });
  if (next == all.end() || (next != all.begin() && stamp - std::prev(next)->stamp < next->stamp - stamp)) {
    if (next == all.begin()) return std::nullopt;
    --next;
  }
  if (std::abs((next->stamp - stamp).seconds()) > 0.2) return std::nullopt;
  const Eigen::Matrix3d R = next->T_odom_base.rotation();
  return std::atan2(R(1, 0), R(0, 0));
}

/// Median difference of two scans' ranges, m, where beam i + shift of `before` is compared with beam i of
/// `after`; infinity: too few beams overlap.
double difference(const Scan& before, const Scan& after, int shift) {
  std::vector<float> all;
  const int n = static_cast<int>(before.ranges.size());
  for (int i = std::max(0, -shift); i < std::min(n, n - shift); ++i) {
    const float a = before.ranges[static_cast<std::size_t>(i + shift)],
                b = after.ranges[static_cast<std::size_t>(i)];
    if (std::isfinite(a) && std::isfinite(b) && a > 0 && b > 0) all.push_back(std::abs(a - b));
  }
  if (all.size() < 30) return std::numeric_limits<double>::infinity();
  std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), all.end());
  return all[all.size() / 2];
}

}  // namespace

int turn_agreement(const LaserSurvey& laser, const OdometrySurvey& odometry,
                   const Transform<Base, Laser>& T_base_laser) {
  const double up = T_base_laser.rotation()(2, 2);  // of the laser's z axis
  if (std::abs(up) < std::numbers::sqrt2 / 2) return 0;
  double total = 0;
  int pairs = 0, agree = 0;
  for (std::size_t i = 0, k = 1; k < laser.scans.size(); ++k) {
    const auto from = yaw_at(odometry, laser.scans[i].stamp), to = yaw_at(odometry, laser.scans[k].stamp);
    if (!from || !to) {
      i = k;
      continue;
    }
    const double turn = std::remainder(*to - *from, 2 * std::numbers::pi);
    if (std::abs(turn) < kMinTurn) continue;
    const Scan &before = laser.scans[i], &after = laser.scans[k];
    i = k;
    if (std::abs(turn) > kMaxTurn) continue;
    // A robot that turns left sees at bearing b what it saw at bearing b + turn. Bearings of a laser that is
    // mounted upside down grow clockwise.
    const double turn_in_scan = up > 0 ? turn : -turn;
    const int shift = static_cast<int>(std::lround(turn_in_scan / double{laser.angle_increment}));
    const double as_odometry = difference(before, after, shift), reversed = difference(before, after, -shift);
    if (!std::isfinite(as_odometry) || !std::isfinite(reversed)) continue;
    total += std::abs(turn);
    ++pairs;
    agree += as_odometry < reversed ? 1 : -1;
  }
  if (pairs < kMinPairs || total < kMinTotal || 2 * std::abs(agree) < pairs) return 0;
  return agree > 0 ? 1 : -1;
}

}  // namespace parhelion::tools
