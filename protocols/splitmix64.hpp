// SplitMix64 (Steele, Lea, Flood 2014): random numbers as a function of a key and a counter, without state.
#pragma once

#include <cstdint>

namespace parhelion {

/// Increment of SplitMix64's state: 2^64 over the golden ratio.
inline constexpr std::uint64_t kSplitMix64Increment = 0x9E3779B97F4A7C15ULL;

/// SplitMix64's output function: each bit of the result depends on every bit of `z`.
constexpr std::uint64_t splitmix64(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

/// Uniform in [0, 1), from the upper 53 bits.
constexpr double unit_interval(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1.0p-53; }

}  // namespace parhelion
