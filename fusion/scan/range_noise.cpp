#include "fusion/scan/range_noise.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::scan {
namespace {

/// Beams over which roughness and material of a surface change.
constexpr std::size_t kPatch = 24;
constexpr int kNeighbours = 8;  ///< correlation beyond them is left out

/// Keys of samples that are not those of the ranges, so that one does not show the other.
NoiseKey keyed(NoiseKey key, std::uint64_t what) { return {key.seed ^ what, key.scan_sequence}; }
constexpr std::uint64_t kRoughness = 0x526f756768ULL, kMaterial = 0x4d617465ULL, kDropout = 0x44726f70ULL;

/// Standard normal, the same for all beams near the middle of a patch, blended between two.
double patch_sample(NoiseKey key, std::size_t beam) {
  const double s = static_cast<double>(beam % kPatch) / kPatch;
  const double a = standard_normal(key, beam / kPatch), b = standard_normal(key, beam / kPatch + 1);
  return ((1 - s) * a + s * b) / std::hypot(1 - s, s);
}

/// Standard normal, with geometric correlation between neighbours.
double correlated_sample(NoiseKey key, std::size_t beam, double correlation) {
  if (correlation == 0) return standard_normal(key, beam);
  double sum = 0, squares = 0, weight = 1;
  for (int k = 0; k < kNeighbours; ++k, weight *= correlation) {
    sum += weight * standard_normal(key, beam + static_cast<std::size_t>(k));
    squares += weight * weight;
  }
  return sum / std::sqrt(squares);
}

double normal_probability(double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); }

}  // namespace

double sigma_at(const RangeNoise& noise, double range) {
  const double at = std::clamp(std::log2(std::max(range, 1e-3)), 0.0, double{RangeNoise::kRanges - 1});
  const auto i = std::min(static_cast<std::size_t>(at), RangeNoise::kRanges - 2);
  const double s = at - static_cast<double>(i);
  return (1 - s) * noise.sigma.at(i) + s * noise.sigma.at(i + 1);
}

std::size_t range_bin(double range) {
  return static_cast<std::size_t>(
      std::clamp(std::lround(std::log2(std::max(range, 0.1))), 0L, long{RangeNoise::kRanges - 1}));
}

double sample_noise(const LaserDescription& laser, NoiseKey key, std::size_t beam, double range,
                    double tan_incidence) {
  const RangeNoise& noise = laser.range_noise;
  if (!noise.learned()) return laser.noise_sigma > 0 ? laser.noise_sigma * standard_normal(key, beam) : 0.0;
  double sigma = std::hypot(sigma_at(noise, range), noise.incidence * tan_incidence);
  if (noise.spread > 0) sigma *= std::exp(noise.spread * patch_sample(keyed(key, kRoughness), beam));
  return sigma * correlated_sample(key, beam, noise.correlation);
}

Measurement measure_surface(const LaserDescription& laser, NoiseKey key, std::size_t beam, float true_range,
                            double tan_incidence) {
  const RangeConvention& convention = laser.convention;
  const Measurement too_close{BeamKind::too_close, convention.too_close_sentinel()};
  const Measurement no_return{BeamKind::no_return, convention.no_return_sentinel()};
  if (std::isnan(true_range)) return {BeamKind::invalid, true_range};
  if (true_range < convention.range_min) return too_close;
  if (std::isinf(true_range)) return no_return;
  const double dropout = laser.range_noise.dropout;
  if (dropout > 0 && normal_probability(standard_normal(keyed(key, kDropout), beam)) < dropout)
    return no_return;

  double range = true_range + sample_noise(laser, key, beam, true_range, tan_incidence);
  const double step = laser.quantization;
  if (step > 0) range = step * std::round(range / step);
  auto written = static_cast<float>(range);
  if (!(written < convention.range_max)) return no_return;

  // At most two sentinels can be skipped.
  for (int i = 0; i < 2 && written > 0 && convention.classify(written) == BeamKind::no_return; ++i) {
    range -= step;
    written = step > 0 ? static_cast<float>(range) : std::nextafter(written, 0.0F);
  }
  if (!(written > 0) || convention.classify(written) != BeamKind::hit) return too_close;
  return {BeamKind::hit, written};
}

float sample_intensity(const LaserDescription& laser, NoiseKey key, std::size_t beam) {
  // Neighbours mostly agree: 0.1 of the variance is a beam's own.
  const NoiseKey material = keyed(key, kMaterial);
  const double own = standard_normal(keyed(material, kDropout), beam);
  double left = normal_probability(std::sqrt(0.9) * patch_sample(material, beam) + std::sqrt(0.1) * own);
  for (std::size_t i = 0; i + 1 < laser.intensity_codes.size(); ++i) {
    left -= double{laser.intensity_fractions.at(i)};
    if (left < 0) return laser.intensity_codes[i];
  }
  return laser.intensity_codes.back();
}

}  // namespace parhelion::scan
