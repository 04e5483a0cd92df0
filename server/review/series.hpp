// What was measured over time, thinned so that no peak is lost.
#pragma once

#include <cstddef>
#include <vector>

namespace parhelion::review {

/// At most `most` windows of one width, aligned to multiples of it, of each the smallest and the largest
/// sample with their instants. The width doubles as the time grows: memory does not.
class Series {
 public:
  explicit Series(std::size_t most = 600, double width = 0.02);

  /// t: s, not before 0 (what is, counts for 0), not before the one before it by more than a window (else it
  /// is left out). A value that is not finite is left out, too.
  void add(double t, double value);

  struct Sample {
    double t, value;
  };
  /// In the order of time; one or two of each window.
  std::vector<Sample> samples() const;
  /// s, of the windows now.
  double width() const { return width_; }

 private:
  struct Window {
    long long index;
    Sample least, greatest;
  };
  static void join(Window& window, const Window& next);
  void widen();

  std::size_t most_;
  double width_;
  std::vector<Window> windows_;
};

}  // namespace parhelion::review
