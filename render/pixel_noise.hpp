// The noise of an image sensor. Private to this room.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace parhelion::render {

/// White, Gaussian, of each value its own: what read-out and shot noise of a camera come to once its gamma
/// has evened them out over the brightness (EMVA 1288 calls it temporal noise). A value depends on (seed,
/// image, its place) alone: SplitMix64 (Steele, Lea, Flood, OOPSLA 2014) of them, through the quantiles of
/// the normal distribution rounded to whole steps.
class PixelNoise {
 public:
  explicit PixelNoise(double sigma);
  double sigma() const { return sigma_; }
  /// Adds to 8-bit values, which stay within 0 to 255.
  void add(std::uint64_t seed, std::uint64_t image, std::span<std::uint8_t> values) const;
  /// What is added at a place, before it is held within 0 to 255: the slow twin of add().
  int at(std::uint64_t seed, std::uint64_t image, std::size_t place) const;

 private:
  double sigma_;
  std::vector<std::int16_t> quantiles_;  ///< by the 16 bits of a draw
};

}  // namespace parhelion::render
