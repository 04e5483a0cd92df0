// Sparse binary images, and the paper's operations between projection and Hough transform (section 2.2,
// figure 3). The cost of work and of clearing is proportional to the number of set pixels. Internal to this
// module.
#pragma once

#include <cstdint>
#include <vector>

namespace parhelion::semantic {

/// A binary image with an ascending list of its set pixels. Pixels of its border are never set, so every set
/// pixel has eight neighbours.
class PixelSet {
 public:
  /// Empty, `width` x `height`; reuses its memory where possible.
  void reset(int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t pixels() const { return on_.size(); }
  bool at(int x, int y) const { return on_[index(x, y)] != 0; }
  bool at(std::size_t i) const { return on_[i] != 0; }
  std::uint32_t index(int x, int y) const { return static_cast<std::uint32_t>(y * width_ + x); }
  bool inside(int x, int y) const { return x > 0 && y > 0 && x < width_ - 1 && y < height_ - 1; }

  /// The set pixels; ascending after sort().
  const std::vector<std::uint32_t>& set() const { return set_; }
  void add(std::uint32_t i) {
    if (on_[i]) return;
    on_[i] = 1;
    set_.push_back(i);
  }
  void sort();
  /// Clears a pixel, which stays in `set()` until the call below.
  void clear(std::size_t i) { on_[i] = 0; }
  void leave_out_cleared();

  /// A bit for each pixel of the square of 3 x 3 around a set one, row by row.
  unsigned square(std::size_t i) const {
    const auto w = static_cast<std::size_t>(width_);
    const auto row = [&](std::size_t at) { return on_[at - 1] | on_[at] << 1 | on_[at + 1] << 2; };
    return static_cast<unsigned>(row(i - w) | row(i) << 3 | row(i + w) << 6);
  }

  /// Offsets of the eight neighbours: north, then clockwise (rows grow southwards).
  void neighbours(int (&offsets)[8]) const;

 private:
  int width_ = 0, height_ = 0;
  std::vector<std::uint8_t> on_;
  std::vector<std::uint32_t> set_;
};

/// Counts per pixel that are independent of point density: the number of occupied layers, of 64 across the
/// picture.
class LayerImage {
 public:
  void reset(int width, int height);
  int width() const { return width_; }
  int height() const { return height_; }
  bool inside(int x, int y) const { return x > 0 && y > 0 && x < width_ - 1 && y < height_ - 1; }
  void add(int x, int y, int layer) {
    const auto i = static_cast<std::uint32_t>(y * width_ + x);
    if (layers_[i] == 0) touched_.push_back(i);
    layers_[i] |= std::uint64_t{1} << (layer & 63);
  }
  const std::vector<std::uint32_t>& touched() const { return touched_; }  ///< unordered
  std::uint64_t layers(std::size_t i) const { return layers_[i]; }
  /// Number of distinct layers in the pixel and its eight neighbours.
  int count_around(std::size_t i) const;
  /// The same with its two neighbours in the row.
  int count_along(std::size_t i) const;

 private:
  int width_ = 0, height_ = 0;
  std::vector<std::uint64_t> layers_;
  std::vector<std::uint32_t> touched_;
};

/// Non-empty pixels with at least `layers` distinct layers around them.
void threshold(const LayerImage& image, int layers, PixelSet& result);

/// The same for pictures from the side, adapted to the local density: of the pixels in one column within
/// `reach` rows, only those with at least the given `fraction` of the largest layer count (of a pixel with
/// its two neighbours in the row) are kept. A level surface is a ridge there, whatever its number of points.
void threshold_ridges(const LayerImage& image, int layers, int reach, double fraction, PixelSet& result);

/// Equation 3: keeps a set pixel where some neighbour is set.
void filter_isolated(const PixelSet& image, PixelSet& result);

/// Maximum over a square of 3 x 3; border pixels stay unset.
void dilate(const PixelSet& image, PixelSet& result);

/// Lines of one pixel's width (Guo and Hall, CACM 32(3), 1989), instead of the paper's Pavlidis.
void thin(PixelSet& image);

}  // namespace parhelion::semantic
