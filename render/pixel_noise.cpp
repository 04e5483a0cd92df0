#include "render/pixel_noise.hpp"

#include <algorithm>
#include <cmath>

#include "protocols/splitmix64.hpp"

namespace parhelion::render {
namespace {

constexpr std::size_t kDraws = 1 << 16;
constexpr std::size_t kInWord = 4;  ///< draws of 16 bits in a word

std::uint64_t stream(std::uint64_t seed, std::uint64_t image) {
  return splitmix64(splitmix64(seed + kSplitMix64Increment) + image);
}

std::uint64_t word(std::uint64_t stream, std::size_t index) {
  return splitmix64(stream + (index + 1) * kSplitMix64Increment);
}

}  // namespace

PixelNoise::PixelNoise(double sigma) : sigma_(sigma), quantiles_(kDraws) {
  int step = -256;
  for (std::size_t i = 0; i < kDraws; ++i) {
    const double fraction = (static_cast<double>(i) + 0.5) / static_cast<double>(kDraws);
    // The smallest whole step whose upper edge is at or above this fraction of all draws.
    while (step < 256 && 0.5 * std::erfc(-(step + 0.5) / (sigma * std::sqrt(2.0))) < fraction) ++step;
    quantiles_[i] = static_cast<std::int16_t>(step);
  }
}

int PixelNoise::at(std::uint64_t seed, std::uint64_t image, std::size_t place) const {
  const std::uint64_t draws = word(stream(seed, image), place / kInWord);
  return quantiles_[draws >> (16 * (place % kInWord)) & 0xFFFF];
}

void PixelNoise::add(std::uint64_t seed, std::uint64_t image, std::span<std::uint8_t> values) const {
  const std::uint64_t key = stream(seed, image);
  for (std::size_t i = 0; i < values.size(); i += kInWord) {
    std::uint64_t draws = word(key, i / kInWord);
    for (std::size_t k = i; k < std::min(i + kInWord, values.size()); ++k, draws >>= 16)
      values[k] = static_cast<std::uint8_t>(std::clamp(values[k] + quantiles_[draws & 0xFFFF], 0, 255));
  }
}

}  // namespace parhelion::render
