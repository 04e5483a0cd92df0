#include "fusion/scan/laser_learning.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "fusion/scan/range_noise.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::scan {
namespace {

constexpr std::size_t kMinWindows = 200, kMaxWindows = 6000;
constexpr std::size_t kMinInBin = 25;  ///< windows, for a sigma of their own
constexpr double kSteep = 1;           ///< tangent of incidence between the two classes

/// The window's beams as a scan of its own, measured again with `laser`.
std::optional<FlatWindow> simulated(const FlatWindow& window, const Scan& angles,
                                    const LaserDescription& laser, NoiseKey key) {
  Scan scan;
  scan.angle_min = static_cast<float>(angles.angle(window.first));
  scan.angle_increment = angles.angle_increment;
  for (std::size_t k = 0; k < FlatWindow::kBeams; ++k) {
    scan.ranges.push_back(measure_surface(laser, key, window.first + k,
                                          static_cast<float>(window.range.at(k)), window.tan_incidence)
                              .range);
  }
  return fit_window(scan, laser, 0);
}

/// What is matched between real and simulated windows.
struct Statistics {
  std::array<double, RangeNoise::kRanges> sigma{};  ///< median by range, 0: too few
  double spread = 0;                                ///< of log sigma about that of its range
  double steep = 1;                                 ///< median sigma of steep windows over that of others
  double correlation = 0;
  double median_sigma = 0;
};

Statistics statistics(const std::vector<FlatWindow>& windows) {
  std::array<std::vector<double>, RangeNoise::kRanges> bins;
  std::vector<double> all, ratio, steep, flat, deviation;
  Statistics result;
  for (const FlatWindow& w : windows) {
    bins.at(range_bin(w.middle_range())).push_back(w.sigma);
    all.push_back(w.sigma);
    result.correlation += w.correlation / static_cast<double>(windows.size());
  }
  if (all.empty()) return result;
  result.median_sigma = median(all);
  for (std::size_t b = 0; b < bins.size(); ++b)
    result.sigma.at(b) = bins.at(b).size() >= kMinInBin ? median(bins.at(b)) : 0;
  for (const FlatWindow& w : windows) {
    const double usual = result.sigma.at(range_bin(w.middle_range()));
    if (usual <= 0) continue;
    deviation.push_back(std::abs(std::log(std::max(w.sigma, 0.02 * usual) / usual)));
    (w.tan_incidence > kSteep ? steep : flat).push_back(w.sigma / usual);
  }
  if (!deviation.empty()) result.spread = 1.4826 * median(deviation);
  if (steep.size() >= kMinInBin && flat.size() >= kMinInBin) result.steep = median(steep) / median(flat);
  return result;
}

/// The step of a laser that rounds: the largest of which nearly all ranges are multiples.
double quantization_of(std::span<const Scan> scans, const RangeConvention& convention) {
  std::vector<double> ranges;
  for (const Scan& scan : scans) {
    for (const float range : scan.ranges) {
      if (convention.classify(range) == BeamKind::hit) ranges.push_back(range);
    }
    if (ranges.size() > 20000) break;
  }
  for (const double step : {0.1, 0.05, 0.04, 0.02, 0.01, 0.005, 0.004, 0.002, 0.001, 0.00025}) {
    const auto on_step = std::count_if(ranges.begin(), ranges.end(), [step](double range) {
      // A float of a range has an error of its own.
      return std::abs(std::remainder(range, step)) < 0.02 * step + 1e-7 * range;
    });
    if (!ranges.empty() && static_cast<double>(on_step) > 0.98 * static_cast<double>(ranges.size()))
      return step;
  }
  return 0;
}

void learn_intensities(std::span<const Scan> scans, const std::vector<std::vector<FlatWindow>>& windows,
                       LearnedLaser& learned) {
  std::map<float, double> count;
  std::vector<float> all;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    if (scans[s].intensities.size() != scans[s].ranges.size()) continue;
    for (const FlatWindow& w : windows[s]) {
      for (std::size_t k = 0; k < FlatWindow::kBeams; ++k) all.push_back(scans[s].intensities[w.first + k]);
    }
  }
  std::erase_if(all, [](float v) { return !std::isfinite(v); });
  for (const float value : all) count[value] += 1.0 / static_cast<double>(all.size());
  constexpr std::size_t kCodes = 32;
  if (count.size() <= kCodes) {
    for (const auto& [value, fraction] : count) {
      learned.intensity_codes.push_back(value);
      learned.intensity_fractions.push_back(static_cast<float>(fraction));
    }
    return;
  }
  for (std::size_t i = 0; i < kCodes; ++i) {
    learned.intensity_codes.push_back(quantile(all, (static_cast<double>(i) + 0.5) / kCodes));
    learned.intensity_fractions.push_back(1.0F / kCodes);
  }
}

/// Beams without a return on what would be flat: of nine beams, the middle one is judged where six of the
/// others have a return, and the nearest on both sides are on one surface. Whether the middle one has a
/// return does not decide which beams are judged, so that also one that fails each time among its neighbours
/// counts as often as it does.
double dropouts(std::span<const Scan> scans, const RangeConvention& convention) {
  constexpr std::size_t kSide = 4, kMinHits = 6;
  double missing = 0, there = 0;
  for (const Scan& scan : scans) {
    const auto hit = [&](std::size_t k) { return convention.classify(scan.ranges[k]) == BeamKind::hit; };
    for (std::size_t i = kSide; i + kSide < scan.ranges.size(); ++i) {
      std::size_t hits = 0;
      double before = 0, after = 0;
      for (std::size_t d = kSide; d > 0; --d) {
        if (hit(i - d)) ++hits, before = scan.ranges[i - d];
        if (hit(i + d)) ++hits, after = scan.ranges[i + d];
      }
      if (hits < kMinHits || std::abs(before - after) > 0.05 * (before + after) / 2) continue;
      (hit(i) ? there : missing) += 1;
    }
  }
  return there > 0 ? missing / (missing + there) : 0;
}

/// One round of indirect inference.
void update(RangeNoise& noise, const Statistics& real, const Statistics& made, double step) {
  for (std::size_t b = 0; b < RangeNoise::kRanges; ++b) {
    if (real.sigma.at(b) <= 0 || made.sigma.at(b) <= 0) continue;
    // Damped, as a range between two of these depends on both.
    const double ratio = std::sqrt(std::clamp(real.sigma.at(b) / made.sigma.at(b), 0.5, 2.0));
    noise.sigma.at(b) = std::max(noise.sigma.at(b) * ratio, std::max(1e-5, 0.02 * step));
  }
  noise.spread = std::clamp(noise.spread + (real.spread - made.spread), 0.0, 1.5);
  noise.correlation = std::clamp(noise.correlation + (real.correlation - made.correlation), -0.5, 0.95);
  noise.incidence = std::clamp(noise.incidence + 0.5 * (real.steep - made.steep) * real.median_sigma, 0.0,
                               4 * real.median_sigma);
}

/// Bins with too few windows get the sigma of the nearest one that has enough.
void fill_gaps(const Statistics& real, RangeNoise& noise) {
  for (int b = 0; b < static_cast<int>(RangeNoise::kRanges); ++b) {
    for (int apart = 0; apart < static_cast<int>(RangeNoise::kRanges); ++apart) {
      const auto has = [&](int i) {
        return i >= 0 && i < static_cast<int>(RangeNoise::kRanges) &&
               real.sigma.at(static_cast<std::size_t>(i)) > 0;
      };
      if (!has(b - apart) && !has(b + apart)) continue;
      noise.sigma.at(static_cast<std::size_t>(b)) =
          noise.sigma.at(static_cast<std::size_t>(has(b - apart) ? b - apart : b + apart));
      break;
    }
  }
}

RangeNoise inferred(const std::vector<std::vector<FlatWindow>>& windows, std::span<const Scan> scans,
                    LaserDescription laser, std::size_t stride) {
  std::vector<FlatWindow> flat;
  for (std::size_t s = 0; s < scans.size(); s += stride)
    flat.insert(flat.end(), windows[s].begin(), windows[s].end());
  const Statistics real = statistics(flat);
  RangeNoise& noise = laser.range_noise;
  const double rounding = laser.quantization * laser.quantization / 12;
  for (std::size_t b = 0; b < RangeNoise::kRanges; ++b) {
    const double total = real.sigma.at(b) > 0 ? real.sigma.at(b) : real.median_sigma;
    noise.sigma.at(b) = std::sqrt(std::max(total * total - rounding, 0.01 * total * total));
  }
  noise.correlation = real.correlation + 0.1;
  fill_gaps(real, noise);
  for (std::uint64_t round = 0; round < 12; ++round) {
    std::vector<FlatWindow> made;
    for (std::size_t s = 0; s < scans.size(); s += stride) {
      for (const FlatWindow& w : windows[s]) {
        if (auto again = simulated(w, scans[s], laser, {round, s})) made.push_back(*again);
      }
    }
    update(noise, real, statistics(made), laser.quantization);
    fill_gaps(real, noise);
  }
  return noise;
}

}  // namespace

Result<LearnedLaser> learn_laser(std::span<const Scan> scans, const LaserDescription& laser) {
  LearnedLaser learned;
  const FlatnessGate gate(scans, laser);
  std::vector<std::vector<FlatWindow>> windows;
  std::vector<double> sigmas;
  for (const Scan& scan : scans) {
    windows.push_back(flat_windows(scan, laser, gate));
    learned.windows += windows.back().size();
    for (const FlatWindow& w : windows.back()) sigmas.push_back(w.sigma);
  }
  if (learned.windows < kMinWindows) {
    return Error{std::to_string(learned.windows) + " flat pieces of walls in " +
                 std::to_string(scans.size()) + " scans; " + std::to_string(kMinWindows) +
                 " are needed to learn the laser's noise"};
  }
  LaserDescription model = laser;
  learned.quantization = model.quantization = quantization_of(scans, laser.convention);
  model.range_noise = {};
  learned.noise = inferred(windows, scans, model, std::max<std::size_t>(1, learned.windows / kMaxWindows));
  learned.noise.dropout = dropouts(scans, laser.convention);
  const double s = median(sigmas);
  learned.sigma = std::sqrt(std::max(s * s - learned.quantization * learned.quantization / 12, 0.0));
  learn_intensities(scans, windows, learned);
  return learned;
}

LaserDescription with_learned(LaserDescription laser, const LearnedLaser& learned) {
  laser.quantization = learned.quantization;
  laser.noise_sigma = learned.sigma;
  laser.range_noise = learned.noise;
  laser.intensity_codes = learned.intensity_codes;
  laser.intensity_fractions = learned.intensity_fractions;
  return laser;
}

}  // namespace parhelion::scan
