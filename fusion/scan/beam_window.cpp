#include "fusion/scan/beam_window.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace parhelion::scan {
namespace {

constexpr double kFullTurn = 2 * std::numbers::pi;
constexpr double kSlack = 1e-4;  // rad; larger than coarse_bearing's error, far less than a beam

/// atan2 to 2e-5 rad (Abramowitz and Stegun 4.4.49), 0 at the origin.
double coarse_bearing(double y, double x) {
  const double ax = std::abs(x), ay = std::abs(y);
  const double larger = std::max(ax, ay);
  const double q = larger > 0 ? std::min(ax, ay) / larger : 0;
  const double z = q * q;
  double a = q * (0.9998660 + z * (-0.3302995 + z * (0.1801410 + z * (-0.0851330 + z * 0.0208351))));
  if (ay > ax) a = std::numbers::pi / 2 - a;
  if (x < 0) a = std::numbers::pi - a;
  return y < 0 ? -a : a;
}

/// Floor to an integer; faster than std::floor where the CPU's baseline has no rounding instruction.
long floor_of(double x) {
  const auto whole = static_cast<long>(x);
  return whole - (static_cast<double>(whole) > x ? 1 : 0);
}

}  // namespace

void BeamRanges::add(BeamRange r) {
  if (r.empty()) return;
  if (count > 0 && (r.first <= range[count - 1].last || count == static_cast<int>(range.size()))) {
    range[count - 1].last = std::max(range[count - 1].last, r.last);
    return;
  }
  range[count++] = r;
}

BeamWindow::BeamWindow(const BeamSet& beams, double half_turn, double half_tilt, double max_range)
    : angle_min_(beams.angle_min),
      beams_per_radian_(1 / double{beams.angle_increment}),
      beams_per_turn_(kFullTurn * std::abs(beams_per_radian_)),
      beams_(beams.time.size()),
      turns_per_beam_(1 / beams_per_turn_),
      half_tilt_(half_tilt),
      max_range_(max_range),
      plane_slack_((half_tilt > 0 ? half_tilt * max_range : 0) + kSlack),
      sin_turn_(std::sin(half_turn)),
      cos_turn_(std::cos(half_turn)) {
  // For sweeps of many turns, of zero angle, or with beams that are not evenly spaced, every beam is a
  // candidate.
  const double turns = static_cast<double>(beams_) / beams_per_turn_;
  const bool is_usable = beams.angles.empty() && beams.angle_increment != 0 &&
                         turns < static_cast<double>(BeamRanges{}.range.size()) - 1;
  if (!is_usable || std::abs(angle_min_) > 1e3 || beams_per_turn_ > 1e9) beams_per_turn_ = 0;
}

BeamRanges BeamWindow::all() const {
  BeamRanges ranges;
  ranges.add({0, beams_});
  return ranges;
}

BeamRanges BeamWindow::meet(const Eigen::Vector3d& center, double radius) const {
  // A point P of a beam is off the middle plane by at most tilt * |P|. The sum of absolute values is an upper
  // bound of |center|.
  const double off_plane = std::abs(center.z()) - radius;
  if (off_plane > half_tilt_ * (center.lpNorm<1>() + radius) + kSlack) return {};
  const double distance_squared = center.squaredNorm();
  const double reach = max_range_ + radius;
  if (distance_squared > reach * reach) return {};
  const double distance = std::sqrt(distance_squared);
  if (distance <= radius) return all();
  // The sphere covers a cap of angular radius beta; the laser's rotation widens it. Beams lie on the equator,
  // where the cap at elevation e reaches cos(bearing) >= cos(beta) / cos(e) (spherical law of cosines).
  const double sin_cap = radius / distance;
  const double cos_cap = std::sqrt(1 - sin_cap * sin_cap);
  const double c = (cos_cap * cos_turn_ - sin_cap * sin_turn_) * distance;  // cos(beta) * distance
  const double in_plane = std::sqrt(center.x() * center.x() + center.y() * center.y());
  if (c <= -in_plane) return all();
  if (c > in_plane) return {};
  // acos(c / in_plane) by atan2.
  const double width = coarse_bearing(std::sqrt(std::max(in_plane * in_plane - c * c, 0.0)), c);
  return about(coarse_bearing(center.y(), center.x()), width + kSlack);
}

BeamRanges BeamWindow::about(double bearing, double width) const {
  const double half = width * std::abs(beams_per_radian_);
  if (beams_per_turn_ == 0 || 2 * half >= beams_per_turn_) return all();
  // In beam numbers: [middle - half, middle + half], and the same a turn later and earlier.
  const auto n = static_cast<long>(beams_);
  double middle = (bearing - angle_min_) * beams_per_radian_;
  middle -= static_cast<double>(floor_of((middle + half) * turns_per_beam_)) * beams_per_turn_;
  BeamRanges ranges;
  for (; middle - half < static_cast<double>(n); middle += beams_per_turn_) {
    const long first = std::max(floor_of(middle - half) + 1, 0L),
               last = std::min(floor_of(middle + half) + 1, n);
    if (first < last) ranges.add({static_cast<std::size_t>(first), static_cast<std::size_t>(last)});
  }
  return ranges;
}

}  // namespace parhelion::scan
