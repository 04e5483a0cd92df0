// A sampled signal, thinned so that no peak is lost.
#pragma once

#include <cstddef>
#include <vector>

namespace parhelion::review {

/// At most `max_windows` windows of equal width, aligned to multiples of it. Each keeps its smallest and
/// largest sample with their instants. The width doubles as the time grows, so memory stays bounded.
class Series {
 public:
  explicit Series(std::size_t max_windows = 600, double width = 0.02);

  /// t: s; negative values count as 0. A sample more than a window older than the one before it is left out,
  /// and so is a value that is not finite.
  void add(double t, double value);

  struct Sample {
    double t, value;
  };
  /// In the order of time; one or two for each window.
  std::vector<Sample> samples() const;
  /// s, current width of a window.
  double width() const { return width_; }

 private:
  struct Window {
    long long index;
    Sample smallest, greatest;
  };
  static void join(Window& window, const Window& next);
  void widen();

  std::size_t max_windows_;
  double width_;
  std::vector<Window> windows_;
};

}  // namespace parhelion::review
