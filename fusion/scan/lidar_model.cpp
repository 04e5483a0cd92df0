#include "fusion/scan/lidar_model.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "fusion/scan/philox.hpp"

namespace parhelion {
namespace {

std::uint32_t low(std::uint64_t word) { return static_cast<std::uint32_t>(word); }
std::uint32_t high(std::uint64_t word) { return static_cast<std::uint32_t>(word >> 32); }

/// In (0, 1]: 53 bits of two words, shifted by half a step so that the logarithm is finite.
double uniform(std::uint32_t a, std::uint32_t b) {
  const std::uint64_t bits = (std::uint64_t{a} << 32 | b) >> 11;
  return (static_cast<double>(bits) + 0.5) * 0x1p-53;
}

}  // namespace

double standard_normal(NoiseKey key, std::size_t beam) {
  const PhiloxCounter word =
      philox4x32({low(beam), high(beam), low(key.scan_sequence), high(key.scan_sequence)},
                 {low(key.seed), high(key.seed)});
  return std::sqrt(-2 * std::log(uniform(word[0], word[1]))) *
         std::cos(2 * std::numbers::pi * uniform(word[2], word[3]));
}

Measurement measure(const LaserDescription& laser, NoiseKey key, std::size_t beam, float true_range) {
  const RangeConvention& convention = laser.convention;
  const Measurement too_close{BeamKind::too_close, convention.too_close_sentinel()};
  const Measurement no_return{BeamKind::no_return, convention.no_return_sentinel()};
  if (std::isnan(true_range)) return {BeamKind::invalid, true_range};
  if (true_range < convention.range_min) return too_close;
  if (std::isinf(true_range)) return no_return;

  double range = true_range;
  if (laser.noise_sigma > 0) range += laser.noise_sigma * standard_normal(key, beam);
  const double step = laser.quantization;
  if (step > 0) range = step * std::round(range / step);
  auto written = static_cast<float>(range);
  if (!(written < convention.range_max)) return no_return;

  // At most two sentinels can be in the way.
  for (int i = 0; i < 2 && written > 0 && convention.classify(written) == BeamKind::no_return; ++i) {
    range -= step;
    written = step > 0 ? static_cast<float>(range) : std::nextafter(written, 0.0F);
  }
  if (!(written > 0) || convention.classify(written) != BeamKind::hit) return too_close;
  return {BeamKind::hit, written};
}

float measure_range(const LaserDescription& laser, NoiseKey key, std::size_t beam, float true_range) {
  return measure(laser, key, beam, true_range).range;
}

Sweep beam_times(const LaserDescription& laser, std::size_t beams, std::vector<float>& time) {
  time.resize(beams);
  if (beams == 0) return {};
  Sweep sweep{laser.beam_time(0, beams), laser.beam_time(0, beams)};
  for (std::size_t i = 1; i < beams; ++i) {
    const Duration t = laser.beam_time(i, beams);
    sweep.start = std::min(sweep.start, t);
    sweep.end = std::max(sweep.end, t);
  }
  const auto span = static_cast<double>((sweep.end - sweep.start).ns);
  for (std::size_t i = 0; i < beams; ++i) {
    const auto since = static_cast<double>((laser.beam_time(i, beams) - sweep.start).ns);
    time[i] = span > 0 ? static_cast<float>(since / span) : 0.0F;
  }
  return sweep;
}

}  // namespace parhelion
