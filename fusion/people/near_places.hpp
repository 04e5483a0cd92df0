// Which of many places are near one: four distances at a time in single precision pass over most of those
// that are not.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace parhelion::people {

/// Memory is reused from scan to scan.
class NearPlaces {
 public:
  void reserve(std::size_t places) { blocks_.reserve(places / kFour + 1); }
  void clear() {
    blocks_.clear();
    size_ = 0;
    first_.setZero();
    has_first_ = false;
    extent_ = 0;
  }
  /// m. Coordinates are kept from the first finite place on, where single precision is 4 micrometres within
  /// 60 m.
  void add(const Eigen::Vector2d& place) {
    if (!has_first_ && place.allFinite()) {
      first_ = place;
      has_first_ = true;
    }
    if (size_ % kFour == 0) blocks_.emplace_back();
    const Eigen::Vector2f from_first = (place - first_).cast<float>();
    if (from_first.allFinite()) extent_ = std::max(extent_, from_first.cwiseAbs().maxCoeff());
    blocks_.back().x[size_ % kFour] = from_first.x();
    blocks_.back().y[size_ % kFour] = from_first.y();
    ++size_;
  }
  /// Calls `near(i)` in ascending order for all places within `reach` m of `place`, and for some that are a
  /// few millimetres farther away or not finite. Goes on while it returns true.
  template <class Near>
  void each(const Eigen::Vector2d& place, double reach, Near&& near) const {
    const Eigen::Vector2f p = (place - first_).cast<float>();
    const float rounding = kRounding * (extent_ + p.cwiseAbs().maxCoeff());
    const float sure = static_cast<float>(reach) + kSlack + rounding, limit = sure * sure;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      const Four dx = blocks_[b].x - p.x(), dy = blocks_[b].y - p.y();
      const FourBits far = dx * dx + dy * dy > limit;
      const auto pairs = std::bit_cast<std::array<std::uint64_t, 2>>(far);
      if ((pairs[0] & pairs[1]) == ~std::uint64_t{0}) continue;
      for (std::size_t k = 0; k < kFour && b * kFour + k < size_; ++k)
        if (far[k] == 0 && !near(b * kFour + k)) return;
    }
  }

 private:
  static constexpr std::size_t kFour = 4;
  static constexpr float kSlack = 1e-3F;     // m
  static constexpr float kRounding = 1e-6F;  // of a coordinate, several times what single precision has
  // Vectors of GCC and Clang.
  using Four = float __attribute__((vector_size(4 * sizeof(float))));
  using FourBits = std::int32_t __attribute__((vector_size(4 * sizeof(std::int32_t))));
  struct Block {
    Four x{}, y{};
  };

  Eigen::Vector2d first_ = Eigen::Vector2d::Zero();
  std::vector<Block> blocks_;
  std::size_t size_ = 0;
  bool has_first_ = false;  // a finite place
  float extent_ = 0;        // m, largest finite coordinate from the first place on
};

}  // namespace parhelion::people
