// Finds discs near a position: a hashed planar grid, rebuilt at each step.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace parhelion::simulation {

class Neighbours {
 public:
  /// `count` discs; `disc(i)` returns a pair of centre and radius (m).
  template <class Disc>
  void place(std::size_t count, Disc disc) {
    start(count);
    for (std::size_t i = 0; i < count; ++i) {
      const auto& [center, radius] = disc(i);
      add(static_cast<std::uint32_t>(i), center, radius);
    }
    finish();
  }

  /// Sets `found` to the ascending indices of a superset of the discs within `range` of p.
  void near(const Eigen::Vector2d& p, double range, std::vector<std::uint32_t>& found) const;

 private:
  static constexpr double kCell = 2.0;   // m
  static constexpr double kLarge = 1.0;  // m: discs with a larger radius are always found
  static constexpr int kMaxCells = 400;  // of a query; a larger one finds all

  void start(std::size_t count);
  void add(std::uint32_t index, const Eigen::Vector2d& center, double radius);
  void finish();
  std::uint32_t bucket(std::int64_t column, std::int64_t row) const;

  std::vector<std::uint32_t> bucket_of_;  // by index; kNowhere: large
  std::vector<std::uint32_t> first_;      // start of each bucket, and the end of the last
  std::vector<std::uint32_t> members_;
  std::vector<std::uint32_t> large_;
  std::uint32_t mask_ = 0;
};

}  // namespace parhelion::simulation
