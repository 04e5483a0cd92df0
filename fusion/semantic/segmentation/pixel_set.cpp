#include "fusion/semantic/segmentation/pixel_set.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace parhelion::semantic {

void PixelSet::reset(int width, int height) {
  for (const std::uint32_t i : set_) on_[i] = 0;
  set_.clear();
  if (width == width_ && height == height_) return;
  width_ = width;
  height_ = height;
  on_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0);
}

void PixelSet::sort() {
  constexpr std::size_t kBatch = 8, kDense = 16;
  if (set_.size() * kBatch * kDense < on_.size()) {
    std::sort(set_.begin(), set_.end());
    return;
  }
  // Where many are set, to read the picture is faster.
  std::size_t kept = 0;
  const auto read = [&](std::size_t i) {
    if (on_[i]) set_[kept++] = static_cast<std::uint32_t>(i);
  };
  std::size_t i = 0;
  for (; i + kBatch <= on_.size(); i += kBatch) {
    std::uint64_t batch = 0;
    std::memcpy(&batch, on_.data() + i, kBatch);
    for (std::size_t k = i; batch != 0 && k < i + kBatch; ++k) read(k);
  }
  for (; i < on_.size(); ++i) read(i);
}

void PixelSet::leave_out_cleared() {
  std::erase_if(set_, [&](std::uint32_t i) { return on_[i] == 0; });
}

void PixelSet::neighbours(int (&offsets)[8]) const {
  const int w = width_;
  const int clockwise[8] = {-w, -w + 1, 1, w + 1, w, w - 1, -1, -w - 1};
  std::copy(std::begin(clockwise), std::end(clockwise), offsets);
}

void LayerImage::reset(int width, int height) {
  for (const std::uint32_t i : touched_) layers_[i] = 0;
  touched_.clear();
  if (width == width_ && height == height_) return;
  width_ = width;
  height_ = height;
  layers_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), 0);
}

int LayerImage::count_around(std::size_t i) const {
  const std::uint64_t* at = layers_.data() + i;
  const std::ptrdiff_t w = width_;
  return std::popcount(at[-w - 1] | at[-w] | at[-w + 1] | at[-1] | at[0] | at[1] | at[w - 1] | at[w] |
                       at[w + 1]);
}

int LayerImage::count_along(std::size_t i) const {
  const std::uint64_t* at = layers_.data() + i;
  return std::popcount(at[-1] | at[0] | at[1]);
}

void threshold_ridges(const LayerImage& image, int layers, int reach, double fraction, PixelSet& result) {
  result.reset(image.width(), image.height());
  const auto width = static_cast<std::size_t>(image.width());
  // Each count is needed for all pixels in reach; those of empty pixels stay 0.
  static thread_local std::vector<std::uint8_t> counts;
  counts.resize(std::max(counts.size(), width * static_cast<std::size_t>(image.height())));
  for (const std::uint32_t i : image.touched()) counts[i] = static_cast<std::uint8_t>(image.count_along(i));
  for (const std::uint32_t i : image.touched()) {
    const int count = counts[i];
    if (count < layers) continue;
    const int row = static_cast<int>(i / width);
    const int first = std::max(1, row - reach), last = std::min(image.height() - 2, row + reach);
    int max_layers = 0;
    const std::uint8_t* at = counts.data() + i - static_cast<std::size_t>(row - first) * width;
    for (int y = first; y <= last; ++y, at += width) max_layers = std::max<int>(max_layers, *at);
    if (count >= fraction * max_layers) result.add(i);
  }
  for (const std::uint32_t i : image.touched()) counts[i] = 0;
  result.sort();
}

void threshold(const LayerImage& image, int layers, PixelSet& result) {
  result.reset(image.width(), image.height());
  for (const std::uint32_t i : image.touched()) {
    if (image.count_around(i) >= layers) result.add(i);
  }
  result.sort();
}

void filter_isolated(const PixelSet& image, PixelSet& result) {
  result.reset(image.width(), image.height());
  int around[8];
  image.neighbours(around);
  for (const std::uint32_t i : image.set()) {
    // The sum of equation 3 is positive exactly where one of the eight is set.
    if (std::any_of(std::begin(around), std::end(around),
                    [&](int offset) { return image.at(i + static_cast<std::size_t>(offset)); })) {
      result.add(i);
    }
  }
}

void dilate(const PixelSet& image, PixelSet& result) {
  result.reset(image.width(), image.height());
  for (const std::uint32_t i : image.set()) {
    const int x = static_cast<int>(i) % image.width(), y = static_cast<int>(i) / image.width();
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (result.inside(x + dx, y + dy)) result.add(result.index(x + dx, y + dy));
      }
    }
  }
  result.sort();
}

namespace {

/// The conditions of Guo and Hall for one of the two half passes; a bit for each pixel of the square of 3 x 3
/// around one, row by row.
bool may_go(unsigned square, bool second_half) {
  constexpr std::array<unsigned, 8> clockwise = {1, 2, 5, 8, 7, 6, 3, 0};  // neighbours, north first
  bool p[8];
  for (unsigned n = 0; n < 8; ++n) p[n] = (square >> clockwise[n] & 1) != 0;
  const int connected = (!p[0] && (p[1] || p[2])) + (!p[2] && (p[3] || p[4])) + (!p[4] && (p[5] || p[6])) +
                        (!p[6] && (p[7] || p[0]));
  if (connected != 1) return false;
  const int n1 = (p[7] || p[0]) + (p[1] || p[2]) + (p[3] || p[4]) + (p[5] || p[6]);
  const int n2 = (p[0] || p[1]) + (p[2] || p[3]) + (p[4] || p[5]) + (p[6] || p[7]);
  const int n = std::min(n1, n2);
  if (n < 2 || n > 3) return false;
  return second_half ? !((p[0] || p[1] || !p[3]) && p[2]) : !((p[4] || p[5] || !p[7]) && p[6]);
}

using ThinningTable = std::array<std::array<bool, 512>, 2>;

ThinningTable thinning_table() {
  ThinningTable table;
  for (unsigned square = 0; square < 512; ++square) {
    for (const bool second_half : {false, true}) table[second_half][square] = may_go(square, second_half);
  }
  return table;
}

/// The pixels that are set beside one of those in either list, each once.
std::vector<std::uint32_t> beside(const PixelSet& image, const std::vector<std::uint32_t>& some,
                                  const std::vector<std::uint32_t>& others) {
  static thread_local std::vector<std::uint32_t> found_in;  // per pixel: the last call that found it
  static thread_local std::uint32_t call = 0;
  found_in.resize(std::max(found_in.size(), image.pixels()));
  if (++call == 0) {  // after 2^32 calls
    std::fill(found_in.begin(), found_in.end(), 0);
    call = 1;
  }
  int around[8];
  image.neighbours(around);
  std::vector<std::uint32_t> found;
  for (const auto* pixels : {&some, &others}) {
    for (const std::uint32_t i : *pixels) {
      for (const int offset : around) {
        const std::uint32_t next = i + static_cast<std::uint32_t>(offset);
        if (!image.at(next) || found_in[next] == call) continue;
        found_in[next] = call;
        found.push_back(next);
      }
    }
  }
  return found;
}

}  // namespace

void thin(PixelSet& image) {
  static const ThinningTable table = thinning_table();
  // First all are asked in both halves, later those beside one that went since they were asked in the same
  // half: the others' answer is as before.
  std::vector<std::uint32_t> ask = image.set(), gone, gone_before;
  for (int half = 0; !ask.empty(); ++half) {
    gone.swap(gone_before);
    gone.clear();
    for (const std::uint32_t i : ask) {
      if (image.at(i) && table[half % 2][image.square(i)]) gone.push_back(i);
    }
    for (const std::uint32_t i : gone) image.clear(i);
    if (half > 0) ask = beside(image, gone_before, gone);
  }
  image.leave_out_cleared();
}

}  // namespace parhelion::semantic
