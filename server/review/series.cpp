#include "server/review/series.hpp"

#include <algorithm>
#include <cmath>

namespace parhelion::review {

Series::Series(std::size_t max_windows, double width)
    : max_windows_(std::max<std::size_t>(max_windows, 1)), width_(width) {}

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
  while (windows_.size() > max_windows_) widen();
}

void Series::join(Window& window, const Window& next) {
  if (next.smallest.value < window.smallest.value) window.smallest = next.smallest;
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
    const bool rises = window.smallest.t <= window.greatest.t;
    all.push_back(rises ? window.smallest : window.greatest);
    if (window.smallest.value != window.greatest.value)
      all.push_back(rises ? window.greatest : window.smallest);
  }
  return all;
}

}  // namespace parhelion::review
