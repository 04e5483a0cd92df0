// Percentiles of a positive quantity without keeping the samples: log-linear buckets, 0.8 % wide, no
// allocation.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

namespace parhelion::tick {

/// HdrHistogram's bucket layout (Tene): 128 linear sub-buckets per power of two.
class Percentiles {
 public:
  void add(double value) {
    const auto v = value <= 0 ? std::uint64_t{0} : static_cast<std::uint64_t>(value);
    ++counts_[bucket(v)];
    ++count_;
    if (value > max_) max_ = value;
  }
  void add(const Percentiles& others) {
    for (std::size_t i = 0; i < counts_.size(); ++i) counts_[i] += others.counts_[i];
    count_ += others.count_;
    max_ = std::max(max_, others.max_);
  }
  std::uint64_t count() const { return count_; }
  double max() const { return max_; }
  /// The value at quantile `q` (0..1) of the samples; 0 without samples.
  double at(double q) const {
    if (count_ == 0) return 0;
    const double wanted = q * static_cast<double>(count_);
    std::uint64_t seen = 0;
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      seen += counts_[i];
      if (static_cast<double>(seen) >= wanted && seen > 0) return std::min(upper(i), max_);
    }
    return max_;
  }

 private:
  static constexpr int kSubBits = 7;
  static constexpr std::size_t kSub = 1U << kSubBits;
  static constexpr std::size_t kOctaves = 40;

  static std::size_t bucket(std::uint64_t v) {
    if (v < kSub) return v;
    const int shift = std::bit_width(v) - 1 - kSubBits;
    const std::size_t index = kSub + static_cast<std::size_t>(shift) * kSub + ((v >> shift) - kSub);
    return std::min(index, kSub * (kOctaves + 1) - 1);
  }
  static double upper(std::size_t i) {
    if (i < kSub) return static_cast<double>(i);
    const std::size_t shift = (i - kSub) / kSub;
    const std::uint64_t base = kSub + (i - kSub) % kSub;
    return static_cast<double>(((base + 1) << shift) - 1);
  }

  std::array<std::uint64_t, kSub*(kOctaves + 1)> counts_{};
  std::uint64_t count_ = 0;
  double max_ = 0;
};

}  // namespace parhelion::tick
