#include "fusion/pose/calibration/turn_path.hpp"

#include <algorithm>
#include <cmath>

#include "protocols/frames.hpp"

namespace parhelion::pose {
namespace {

constexpr Duration kMaxGap = milliseconds(500);

bool gives_rates(const std::vector<ImuSample>& samples) {
  return std::any_of(samples.begin(), samples.end(),
                     [](const ImuSample& sample) { return !sample.rotation_rate.isZero(0); });
}

/// Heading of the base in the sensor's own vertical frame.
double heading(const ImuSample& sample, const ImuDescription& imu) {
  const Eigen::Matrix3d R =
      (*sample.orientation * imu.T_base_imu.quaternion().conjugate()).toRotationMatrix();
  return std::atan2(R(1, 0), R(0, 0));
}

}  // namespace

TurnPath::TurnPath(const std::vector<ImuSample>& samples, const ImuDescription& imu) {
  const bool by_rates = gives_rates(samples);
  double last_heading = 0;
  for (const ImuSample& sample : samples) {
    if (!knots_.empty() && sample.stamp <= knots_.back().stamp) continue;
    if (by_rates) {
      const double rate = (imu.T_base_imu.quaternion() * sample.rotation_rate).z();
      if (!std::isfinite(rate)) continue;
      const double dt = knots_.empty() ? 0 : (sample.stamp - knots_.back().stamp).seconds();
      const double before = knots_.empty() ? 0 : knots_.back().rate;
      add({sample.stamp, 0, rate, 0}, dt * (before + rate) / 2);
    } else if (sample.orientation && sample.orientation->coeffs().allFinite()) {
      const double now = heading(sample, imu);
      add({sample.stamp, 0, 0, 0}, wrap_angle(now - last_heading));
      last_heading = now;
    }
  }
  if (!by_rates) add_rates_of_angles();
}

TurnPath::TurnPath(const std::vector<Turn>& turns) {
  for (const Turn& turn : turns) {
    if (!std::isfinite(turn.angle) || turn.to <= turn.from) continue;
    if (knots_.empty() || knots_.back().stamp != turn.from) {
      if (!knots_.empty() && turn.from < knots_.back().stamp) continue;
      add({turn.from, 0, 0, knots_.empty() ? 0 : knots_.back().part + 1}, 0);
    }
    add({turn.to, 0, 0, knots_.back().part}, turn.angle);
  }
  add_rates_of_angles();
}

void TurnPath::add(Knot knot, double turned) {
  if (!knots_.empty()) {
    const Knot& last = knots_.back();
    knot.part = std::max(knot.part, last.part + (knot.stamp - last.stamp > kMaxGap ? 1 : 0));
    knot.angle = last.angle + turned;
  }
  knots_.push_back(knot);
}

/// By parabolas through three samples, within parts.
void TurnPath::add_rates_of_angles() {
  const auto slope = [this](std::size_t a, std::size_t b) {
    return (knots_[b].angle - knots_[a].angle) / (knots_[b].stamp - knots_[a].stamp).seconds();
  };
  for (std::size_t i = 0; i < knots_.size(); ++i) {
    const bool before = i > 0 && knots_[i - 1].part == knots_[i].part;
    const bool after = i + 1 < knots_.size() && knots_[i + 1].part == knots_[i].part;
    if (before && after) {
      const double h = (knots_[i].stamp - knots_[i - 1].stamp).seconds();
      const double k = (knots_[i + 1].stamp - knots_[i].stamp).seconds();
      knots_[i].rate = (k * slope(i - 1, i) + h * slope(i, i + 1)) / (h + k);
    } else if (before || after) {
      knots_[i].rate = before ? slope(i - 1, i) : slope(i, i + 1);
    }
  }
}

std::optional<TurnPath::Place> TurnPath::at(SensorTime t) const {
  const auto after = std::lower_bound(knots_.begin(), knots_.end(), t,
                                      [](const Knot& knot, SensorTime s) { return knot.stamp < s; });
  if (after == knots_.end()) return std::nullopt;
  if (after->stamp == t) return Place{after->angle, after->part};
  if (after == knots_.begin() || (after - 1)->part != after->part) return std::nullopt;
  const Knot& before = *(after - 1);
  const double h = (after->stamp - before.stamp).seconds(), s = (t - before.stamp).seconds() / h;
  const double rise = after->angle - before.angle;
  const double a = h * before.rate - rise, b = rise - h * after->rate;
  return Place{before.angle + s * rise + s * (1 - s) * ((1 - s) * a + s * b), after->part};
}

std::optional<double> TurnPath::between(SensorTime from, SensorTime to) const {
  const auto a = at(from), b = at(to);
  if (!a || !b || a->part != b->part) return std::nullopt;
  return b->angle - a->angle;
}

}  // namespace parhelion::pose
