#include "fusion/scan/lidar_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "fusion/scan/philox.hpp"
#include "fusion/scan/range_noise.hpp"

namespace parhelion::scan {
namespace {

std::uint32_t low(std::uint64_t word) { return static_cast<std::uint32_t>(word); }
std::uint32_t high(std::uint64_t word) { return static_cast<std::uint32_t>(word >> 32); }

/// In (0, 1): 52 bits of two words, centred in their steps.
double uniform(std::uint32_t a, std::uint32_t b) {
  const std::uint64_t bits = (std::uint64_t{a} << 32 | b) >> 12;
  return (static_cast<double>(bits) + 0.5) * 0x1p-52;
}

template <std::size_t N>
double polynomial(const std::array<double, N>& coefficients, double x) {
  double sum = 0;
  for (const double c : coefficients) sum = sum * x + c;
  return sum;
}

constexpr std::array kCentreTop{2509.0809287301226727, 33430.575583588128105, 67265.770927008700853,
                                45921.953931549871457, 13731.693765509461125, 1971.5909503065514427,
                                133.14166789178437745, 3.387132872796366608};
constexpr std::array kCentreBottom{
    5226.495278852854561,  28729.085735721942674, 39307.89580009271061,  21213.794301586595867,
    5394.1960214247511077, 687.1870074920579083,  42.313330701600911252, 1.0};
constexpr std::array kTailTop{7.7454501427834140764e-4, 0.0227238449892691845833, 0.24178072517745061177,
                              1.27045825245236838258,   3.64784832476320460504,   5.7694972214606914055,
                              4.6303378461565452959,    1.42343711074968357734};
constexpr std::array kTailBottom{
    1.05075007164441684324e-9, 5.475938084995344946e-4, 0.0151986665636164571966, 0.14810397642748007459,
    0.68976733498510000455,    1.6763848301838038494,   2.05319162663775882187,   1.0};
constexpr std::array kFarTop{2.01033439929228813265e-7, 2.71155556874348757815e-5, 0.0012426609473880784386,
                             0.026532189526576123093,   0.29656057182850489123,    1.7848265399172913358,
                             5.4637849111641143699,     6.6579046435011037772};
constexpr std::array kFarBottom{
    2.04426310338993978564e-15, 1.4215117583164458887e-7, 1.8463183175100546818e-5, 7.868691311456132591e-4,
    0.0148753612908506148525,   0.13692988092273580531,   0.59983220655588793769,   1.0};

/// Quantile of the standard normal distribution: Wichura, algorithm AS 241 (PPND16), Applied Statistics 37
/// (1988).
double normal_quantile(double p) {
  const double q = p - 0.5;
  if (std::abs(q) <= 0.425) {
    const double r = 0.180625 - q * q;
    return q * polynomial(kCentreTop, r) / polynomial(kCentreBottom, r);
  }
  const double r = std::sqrt(-std::log(q < 0 ? p : 1 - p));
  const double x = r <= 5 ? polynomial(kTailTop, r - 1.6) / polynomial(kTailBottom, r - 1.6)
                          : polynomial(kFarTop, r - 5) / polynomial(kFarBottom, r - 5);
  return q < 0 ? -x : x;
}

}  // namespace

double standard_normal(NoiseKey key, std::size_t beam) {
  const PhiloxCounter word =
      philox4x32({low(beam), high(beam), low(key.scan_sequence), high(key.scan_sequence)},
                 {low(key.seed), high(key.seed)});
  return normal_quantile(uniform(word[0], word[1]));
}

Measurement measure(const LaserDescription& laser, NoiseKey key, std::size_t beam, float true_range) {
  return measure_surface(laser, key, beam, true_range, 0);
}

float measure_range(const LaserDescription& laser, NoiseKey key, std::size_t beam, float true_range) {
  return measure(laser, key, beam, true_range).range;
}

namespace {

/// `instant_of(i)`: of beam i, relative to the scan's stamp.
template <class InstantOf>
Sweep normalize_times(std::size_t beams, InstantOf instant_of, std::vector<float>& time) {
  time.resize(beams);
  if (beams == 0) return {};
  Sweep sweep{instant_of(0), instant_of(0)};
  for (std::size_t i = 1; i < beams; ++i) {
    const Duration t = instant_of(i);
    sweep.start = std::min(sweep.start, t);
    sweep.end = std::max(sweep.end, t);
  }
  const auto span = static_cast<double>((sweep.end - sweep.start).ns);
  for (std::size_t i = 0; i < beams; ++i) {
    const auto since = static_cast<double>((instant_of(i) - sweep.start).ns);
    time[i] = span > 0 ? static_cast<float>(since / span) : 0.0F;
  }
  return sweep;
}

}  // namespace

Sweep beam_times(const LaserDescription& laser, std::size_t beams, std::vector<float>& time) {
  return normalize_times(
      beams, [&](std::size_t i) { return laser.beam_time(i, beams); }, time);
}

Sweep beam_times(const LaserDescription& laser, const Scan& scan, std::vector<float>& time) {
  return normalize_times(
      scan.ranges.size(), [&](std::size_t i) { return laser.beam_time(i, scan); }, time);
}

BeamSet beam_set(const Scan& scan, std::span<const float> time) {
  return {scan.angle_min, scan.angle_increment, time, scan.angles};
}

}  // namespace parhelion::scan
