#include "protocols/scan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace parhelion {
namespace {

float sentinel(RangeConvention::Sentinel kind, float value, float infinity) {
  switch (kind) {
    case RangeConvention::Sentinel::value:
      return value;
    case RangeConvention::Sentinel::infinity:
      return infinity;
    case RangeConvention::Sentinel::nan:
      return std::numeric_limits<float>::quiet_NaN();
  }
  return value;
}

bool is_value(RangeConvention::Sentinel kind, float value, float range) {
  return kind == RangeConvention::Sentinel::value && range == value;
}

constexpr double kFullTurn = 2 * std::numbers::pi;

/// Distance of two directions, rad, 0..pi.
double apart(double a, double b) { return std::abs(std::remainder(a - b, kFullTurn)); }

/// Index of a direction among the evenly spaced beams, not rounded; may lie outside of them. Counted from the
/// middle of the scan, so that a full turn is cut behind it.
double even_index(const Scan& scan, double direction) {
  const double half = static_cast<double>(scan.ranges.size() - 1) / 2;
  const double middle = double{scan.angle_min} + half * double{scan.angle_increment};
  return half + std::remainder(direction - middle, kFullTurn) / double{scan.angle_increment};
}

bool has_step(const Scan& scan) { return !scan.ranges.empty() && std::abs(scan.angle_increment) > 0; }

}  // namespace

std::optional<std::size_t> Scan::beam_at(double direction) const {
  if (!has_step(*this) || !std::isfinite(direction) || !std::isfinite(angle_min)) return std::nullopt;
  std::size_t nearest = 0;
  if (angles.empty()) {
    const double last = static_cast<double>(ranges.size() - 1);
    nearest = static_cast<std::size_t>(std::lround(std::clamp(even_index(*this, direction), 0.0, last)));
  } else {
    const auto closest = std::min_element(angles.begin(), angles.end(), [&](float a, float b) {
      return apart(double{a}, direction) < apart(double{b}, direction);
    });
    nearest = static_cast<std::size_t>(closest - angles.begin());
  }
  if (apart(angle(nearest), direction) > std::abs(double{angle_increment})) return std::nullopt;
  return nearest;
}

std::vector<std::optional<std::size_t>> nearest_beams(const Scan& scan) {
  std::vector<std::optional<std::size_t>> nearest(scan.ranges.size());
  if (scan.angles.empty() || !has_step(scan)) {
    for (std::size_t i = 0; i < nearest.size(); ++i) nearest[i] = i;
    return nearest;
  }
  std::vector<double> distance(nearest.size(), 1);  // steps
  for (std::size_t beam = 0; beam < nearest.size(); ++beam) {
    const double index = even_index(scan, double{scan.angles[beam]});
    for (const double place : {std::floor(index), std::ceil(index)}) {
      if (place < 0 || place >= static_cast<double>(nearest.size())) continue;
      const auto i = static_cast<std::size_t>(place);
      if (std::abs(index - place) >= distance[i]) continue;
      distance[i] = std::abs(index - place);
      nearest[i] = beam;
    }
  }
  return nearest;
}

Scan evenly_spaced(const Scan& scan) {
  Scan even{scan.stamp, scan.ranges, scan.intensities, scan.angle_min, scan.angle_increment, {}, {}};
  if (scan.angles.empty()) return even;
  const auto nearest = nearest_beams(scan);
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    even.ranges[i] = nearest[i] ? scan.ranges[*nearest[i]] : std::numeric_limits<float>::quiet_NaN();
    if (!even.intensities.empty()) even.intensities[i] = nearest[i] ? scan.intensities[*nearest[i]] : 0;
  }
  return even;
}

BeamKind RangeConvention::classify(float range) const {
  // Sentinels first: a sensor that writes 0 for "no return" has a no-return value below its minimum range.
  // Where both sentinels are equal, too close is assumed: such a beam is passed on unchanged, so nothing real
  // can be hidden.
  if (is_value(too_close, too_close_value, range)) return BeamKind::too_close;
  if (is_value(no_return, no_return_value, range)) return BeamKind::no_return;
  if (std::isnan(range)) {
    if (too_close == Sentinel::nan) return BeamKind::too_close;
    return no_return == Sentinel::nan ? BeamKind::no_return : BeamKind::invalid;
  }
  if (range < 0 && std::isfinite(range)) return BeamKind::invalid;
  if (range >= range_max) return BeamKind::no_return;
  return range < range_min ? BeamKind::too_close : BeamKind::hit;
}

float RangeConvention::no_return_sentinel() const {
  return sentinel(no_return, no_return_value, std::numeric_limits<float>::infinity());
}

float RangeConvention::too_close_sentinel() const {
  return sentinel(too_close, too_close_value, -std::numeric_limits<float>::infinity());
}

Duration LaserDescription::beam_time(std::size_t i, std::size_t n) const {
  const auto since_start = [this](std::size_t beam) {
    const auto interlaced = static_cast<std::size_t>(std::max(passes, 1));
    return static_cast<double>(beam % interlaced) * pass_period +
           static_cast<double>(beam / interlaced) * std::abs(beam_interval);
  };
  const double at_beam = since_start(beam_interval < 0 ? n - 1 - i : i);
  // The last beam in time, not in index: in an interlaced scan it belongs to the last pass.
  double end = 0;
  for (std::size_t back = 1; back <= static_cast<std::size_t>(std::max(passes, 1)) && back <= n; ++back) {
    end = std::max(end, since_start(n - back));
  }
  switch (stamp_beam) {
    case StampBeam::first:
      return seconds(at_beam);
    case StampBeam::middle:
      return seconds(at_beam - end / 2);
    case StampBeam::last:
      return seconds(at_beam - end);
  }
  return seconds(at_beam);
}

Duration LaserDescription::beam_time(std::size_t i, const Scan& scan) const {
  if (!scan.is_timed()) return beam_time(i, scan.ranges.size());
  return microseconds(scan.times[i] - scan.stamp.utime());
}

}  // namespace parhelion
