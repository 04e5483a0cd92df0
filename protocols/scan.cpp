#include "protocols/scan.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

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

}  // namespace

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
           static_cast<double>(beam / interlaced) * beam_interval;
  };
  const double at_beam = since_start(i);
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

}  // namespace parhelion
