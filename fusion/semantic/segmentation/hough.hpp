// The progressive probabilistic Hough transform (Matas, Galambos, Kittler, CVIU 78, 2000): the paper's
// CV_HOUGH_PROBABILISTIC, with its own seeded random generator. Internal to this module.
#pragma once

#include <cstdint>
#include <vector>

#include "fusion/semantic/segmentation/pixel_set.hpp"

namespace parhelion::semantic {

/// In pixels; the ends are pixels of the image.
struct PixelSegment {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  bool operator==(const PixelSegment&) const = default;
};

struct HoughOptions {
  int votes = 10;       ///< minimum votes of a line before it is followed
  int min_length = 20;  ///< pixels
  int max_gap = 10;     ///< pixels
  int max_rise = 90;    ///< degrees, maximum angle between a line and the rows
  std::uint64_t seed = 1;
};

/// Segments in the order in which they were found. A pixel belongs to at most one.
std::vector<PixelSegment> hough_segments(const PixelSet& image, const HoughOptions& options);

}  // namespace parhelion::semantic
