#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "fusion/scan/laser_learning.hpp"
#include "fusion/scan/range_noise.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::scan {
namespace {

constexpr double kGrazing = 4;  ///< tangent of the angle of incidence
/// No planar laser has noise of more than a fifth of this; what is rougher is a hedge.
constexpr double kMaxGate = 0.1;  ///< m
constexpr std::size_t kBeams = FlatWindow::kBeams;
constexpr std::size_t kMinInBin = 25;  ///< windows, for a gate of their own

struct Beams {
  std::array<Eigen::Vector2d, kBeams> direction;
  std::array<double, kBeams> range{};
};

/// 1 / r = line . direction, for the line's normal divided by its distance.
std::optional<Eigen::Vector2d> fit_line(const Beams& beams) {
  std::array<double, kBeams> scale = beams.range;  // an error of 1 / r counts r^2 times as much in r
  Eigen::Vector2d line(0, 0);
  for (int i = 0; i < 2; ++i) {
    Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
    Eigen::Vector2d b(0, 0);
    for (std::size_t k = 0; k < kBeams; ++k) {
      const double w = std::pow(scale.at(k), 4);
      A += w * beams.direction.at(k) * beams.direction.at(k).transpose();
      b += w / beams.range.at(k) * beams.direction.at(k);
    }
    line = A.ldlt().solve(b);
    for (std::size_t k = 0; k < kBeams; ++k) {
      const double inverse = line.dot(beams.direction.at(k));
      if (!(inverse > 1e-4)) return std::nullopt;
      scale.at(k) = 1 / inverse;
    }
  }
  return line;
}

/// The line, and the distance between it and each pass. Passes hardly depend on the line, so that they are
/// fitted in turns.
std::optional<std::array<double, kBeams>> fit_surface(const Beams& beams, std::size_t passes) {
  constexpr int kTurns = 3;
  std::array<double, kBeams> surface{};
  std::vector<double> offset(passes, 0.0);
  for (int i = 0; i < (passes > 1 ? kTurns : 1); ++i) {
    Beams shifted = beams;
    for (std::size_t k = 0; k < kBeams; ++k) shifted.range.at(k) -= offset[k % passes];
    const auto line = fit_line(shifted);
    if (!line) return std::nullopt;
    for (std::size_t k = 0; k < kBeams; ++k) surface.at(k) = 1 / line->dot(beams.direction.at(k));
    if (passes == 1) break;
    for (std::size_t pass = 0; pass < passes; ++pass) {
      double sum = 0, count = 0;
      for (std::size_t k = pass; k < kBeams; k += passes)
        sum += beams.range.at(k) - surface.at(k), count += 1;
      offset[pass] = sum / count;
    }
  }
  for (std::size_t k = 0; k < kBeams; ++k) surface.at(k) += offset[k % passes];
  return surface;
}

void add_statistics(FlatWindow& window, std::size_t passes) {
  double squares = 0, products = 0;
  for (std::size_t k = 0; k < kBeams; ++k) {
    squares += window.residual.at(k) * window.residual.at(k);
    if (k > 0) products += window.residual.at(k) * window.residual.at(k - 1);
  }
  window.sigma = std::sqrt(squares / static_cast<double>(kBeams - 1 - passes));
  window.correlation = squares > 0 ? products / squares : 0;
}

}  // namespace

std::optional<FlatWindow> fit_window(const Scan& scan, const LaserDescription& laser, std::size_t first) {
  if (first + kBeams > scan.ranges.size()) return std::nullopt;
  Beams beams;
  for (std::size_t k = 0; k < kBeams; ++k) {
    const float range = scan.ranges[first + k];
    if (laser.convention.classify(range) != BeamKind::hit) return std::nullopt;
    const double angle = scan.angle(first + k);
    beams.direction.at(k) = {std::cos(angle), std::sin(angle)};
    beams.range.at(k) = range;
  }
  // More passes than this leave too few beams for each.
  constexpr int kMaxPasses = 4;
  const auto passes = static_cast<std::size_t>(std::clamp(laser.passes, 1, kMaxPasses));
  const auto surface = fit_surface(beams, passes);
  const auto line = fit_line(beams);
  if (!surface || !line) return std::nullopt;
  FlatWindow window;
  window.first = first;
  window.range = *surface;
  for (std::size_t k = 0; k < kBeams; ++k) window.residual.at(k) = beams.range.at(k) - surface->at(k);
  const Eigen::Vector2d middle = beams.direction.at(kBeams / 2);
  const double cosine = line->dot(middle) / line->norm();
  window.tan_incidence = std::sqrt(std::max(0.0, 1 - cosine * cosine)) / std::max(cosine, 1e-6);
  if (window.tan_incidence > kGrazing) return std::nullopt;
  add_statistics(window, passes);
  return window;
}

std::vector<FlatWindow> flat_windows(const Scan& scan, const LaserDescription& laser,
                                     const FlatnessGate& gate) {
  std::vector<FlatWindow> windows;
  for (std::size_t first = 0; first + kBeams <= scan.ranges.size();) {
    const auto window = fit_window(scan, laser, first);
    const bool flat = window && gate.passes(*window);
    if (flat) windows.push_back(*window);
    first += flat ? kBeams : 3;
  }
  return windows;
}

FlatnessGate::FlatnessGate(std::span<const Scan> scans, const LaserDescription& laser) {
  std::array<std::vector<double>, RangeNoise::kRanges> sigmas;
  std::vector<double> all;
  const std::size_t stride = std::max<std::size_t>(1, scans.size() / 200);
  for (std::size_t i = 0; i < scans.size(); i += stride) {
    for (std::size_t first = 0; first + kBeams <= scans[i].ranges.size(); first += kBeams) {
      const auto window = fit_window(scans[i], laser, first);
      if (!window) continue;
      sigmas.at(range_bin(window->middle_range())).push_back(window->sigma);
      all.push_back(window->sigma);
    }
  }
  if (all.empty()) return;
  // In a cluttered place every other window lies across an edge: the median would be one of those.
  const auto gate = [](std::vector<double>& near) {
    return std::clamp(5.5 * quantile(near, 0.15), 5e-4, kMaxGate);
  };
  largest_.fill(gate(all));
  // No laser measures worse nearby than farther out: what is rougher there is not flat.
  std::optional<double> farther;
  for (std::size_t b = largest_.size(); b-- > 0;) {
    if (sigmas.at(b).size() >= kMinInBin) farther = std::min(gate(sigmas.at(b)), farther.value_or(kMaxGate));
    if (farther) largest_.at(b) = *farther;
  }
}

bool FlatnessGate::passes(const FlatWindow& window) const {
  const double largest = largest_.at(range_bin(window.middle_range()));
  return std::all_of(window.residual.begin(), window.residual.end(),
                     [largest](double e) { return std::abs(e) <= largest; });
}

}  // namespace parhelion::scan
