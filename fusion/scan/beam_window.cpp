#include "fusion/scan/beam_window.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace parhelion {
namespace {

constexpr double kFullTurn = 2 * std::numbers::pi;
constexpr double kSlack = 1e-6;  // rad; far more than rounding, far less than a beam

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
    : angle_first_(beams.angle_first),
      angle_step_(beams.angle_step),
      beams_(beams.time.size()),
      half_turn_(half_turn),
      half_tilt_(half_tilt),
      max_range_(max_range),
      sin_turn_(std::sin(half_turn)),
      cos_turn_(std::cos(half_turn)) {}

BeamRanges BeamWindow::all() const {
  BeamRanges ranges;
  ranges.add({0, beams_});
  return ranges;
}

BeamRanges BeamWindow::meet(const Eigen::Vector3d& center, double radius) const {
  const double distance_squared = center.squaredNorm();
  const double reach = max_range_ + radius;
  if (distance_squared > reach * reach) return {};
  const double distance = std::sqrt(distance_squared);
  // A point P of a beam is off the middle plane by at most tilt * |P|.
  if (std::abs(center.z()) - radius > half_tilt_ * (distance + radius) + kSlack) return {};
  if (distance <= radius) return all();
  // The sphere is a cap of the sky of angular radius beta; the laser's turning widens it. Beams lie on the
  // sky's equator, where the cap about elevation e reaches cos(bearing) >= cos(beta) / cos(e) (spherical law
  // of cosines).
  const double sin_cap = radius / distance;
  const double cos_cap = std::sqrt(1 - sin_cap * sin_cap);
  const double c = (cos_cap * cos_turn_ - sin_cap * sin_turn_) * distance;  // cos(beta) * distance
  const double in_plane = std::hypot(center.x(), center.y());
  if (c <= -in_plane) return all();
  if (c > in_plane * (1 + kSlack)) return {};
  const double bearing = std::atan2(center.y(), center.x());
  const double width = std::acos(std::min(c / in_plane, 1.0)) + kSlack;
  return between(bearing - width, bearing + width);
}

BeamRanges BeamWindow::between(double low, double high) const {
  if (angle_step_ == 0 || high - low >= kFullTurn) return all();
  BeamRanges ranges;
  // Beam index where the bearing is passed, for each turn that the sweep covers.
  const double last_angle = angle_first_ + static_cast<double>(beams_) * angle_step_;
  const double least = std::min(angle_first_, last_angle), most = std::max(angle_first_, last_angle);
  const double first_turn = std::ceil((least - high) / kFullTurn);
  const double turns = std::floor((most - low) / kFullTurn) - first_turn;
  if (turns >= static_cast<double>(ranges.range.size())) return all();
  const auto n = static_cast<double>(beams_);
  for (double k = 0; k <= turns; ++k) {
    // In the order of the beams.
    const double offset = kFullTurn * (first_turn + (angle_step_ > 0 ? k : turns - k));
    const double a = (low + offset - angle_first_) / angle_step_,
                 b = (high + offset - angle_first_) / angle_step_;
    const double from = std::ceil(std::min(a, b)), to = std::floor(std::max(a, b)) + 1;
    ranges.add({static_cast<std::size_t>(std::clamp(from, 0.0, n)),
                static_cast<std::size_t>(std::clamp(to, 0.0, n))});
  }
  return ranges;
}

}  // namespace parhelion
