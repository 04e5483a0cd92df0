#include "server/review/series.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::review {

Series::Series(std::size_t most, double width) : most_(std::max<std::size_t>(most, 1)), width_(width) {}

void Series::add(double t, double value) {
  if (!std::isfinite(value) || !std::isfinite(t)) return;
  t = std::max(t, 0.0);
  const Sample sample{t, value};
  Window window{static_cast<long long>(std::floor(t / width_)), sample, sample};
  if (!windows_.empty() && window.index <= windows_.back().index) {
    if (window.index + 1 < windows_.back().index) return;
    join(windows_.back(), window);
    return;
  }
  windows_.push_back(window);
  while (windows_.size() > most_) widen();
}

void Series::join(Window& window, const Window& next) {
  if (next.least.value < window.least.value) window.least = next.least;
  if (next.greatest.value > window.greatest.value) window.greatest = next.greatest;
}

void Series::widen() {
  width_ *= 2;
  std::vector<Window> wider;
  wider.reserve(windows_.size());
  for (Window& window : windows_) {
    window.index /= 2;
    if (!wider.empty() && wider.back().index == window.index)
      join(wider.back(), window);
    else
      wider.push_back(window);
  }
  windows_ = std::move(wider);
}

std::vector<Series::Sample> Series::samples() const {
  std::vector<Sample> all;
  all.reserve(2 * windows_.size());
  for (const Window& window : windows_) {
    const bool rises = window.least.t <= window.greatest.t;
    all.push_back(rises ? window.least : window.greatest);
    if (window.least.value != window.greatest.value) all.push_back(rises ? window.greatest : window.least);
  }
  return all;
}

}  // namespace parhelion::review
