// The noise of an image sensor. Private to this module.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace parhelion::render {

/// White, Gaussian, independent per value: the approximate sum of a camera's read-out and shot noise after
/// gamma has equalised it over brightness (EMVA 1288: temporal noise). A value depends only on (seed, image,
/// its position): SplitMix64 (Steele, Lea, Flood, OOPSLA 2014) of them, through the quantiles of the normal
/// distribution rounded to whole steps.
class PixelNoise {
 public:
  explicit PixelNoise(double sigma);
  double sigma() const { return sigma_; }
  /// Adds to 8-bit values, clamped to 0..255.
  void add(std::uint64_t seed, std::uint64_t image, std::span<std::uint8_t> values) const;
  /// The noise added at a position before clamping: reference implementation of add().
  int at(std::uint64_t seed, std::uint64_t image, std::size_t place) const;

 private:
  double sigma_;
  std::vector<std::int16_t> quantiles_;  ///< by the 16 bits of a draw
};

}  // namespace parhelion::render
