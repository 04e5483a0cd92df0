#include "fusion/semantic/net/flight_strip.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "fusion/cloud/floor_index.hpp"

namespace parhelion::semantic {

StripPoints::StripPoints(std::span<const Eigen::Vector3f> points)
    : blocks_(points, kAcross * kSquare),
      begin_(blocks_.blocks().size() * kSquares + 1, 0),
      by_square_(blocks_.sorted().size()) {
  tbb::parallel_for(std::size_t{0}, blocks_.blocks().size(), [&](std::size_t b) {
    const PlanBlocks::Block& block = blocks_.blocks()[b];
    const auto along = [](float at, int of_block) {
      return std::clamp(cloud::floor_index(at / kSquare) - of_block * kAcross, 0, kAcross - 1);
    };
    std::vector<std::uint8_t> square(block.end - block.begin);
    std::array<std::uint32_t, kSquares + 1> next{};
    for (std::uint32_t k = 0; k < square.size(); ++k) {
      const Eigen::Vector3f& p = blocks_.sorted()[block.begin + k];
      square[k] = static_cast<std::uint8_t>(along(p.y(), block.y) * kAcross + along(p.x(), block.x));
      ++next[square[k] + 1U];
    }
    next[0] = block.begin;
    std::partial_sum(next.begin(), next.end(), next.begin());
    std::copy(next.begin(), next.end() - 1, begin_.begin() + static_cast<std::ptrdiff_t>(b * kSquares));
    for (std::uint32_t k = 0; k < square.size(); ++k) by_square_[next[square[k]]++] = k;
  });
  begin_.back() = static_cast<std::uint32_t>(by_square_.size());
}

void StripPoints::mark(std::size_t block, const Eigen::Vector2d& direction, const Strip& strip,
                       std::vector<std::uint64_t>& marked) const {
  const PlanBlocks::Block& place = blocks_.blocks()[block];
  marked.assign((place.end - place.begin + 63) / 64, 0);
  const double reach = 0.71 * kSquare + kMargin;  // from a square's centre
  const auto [from, to] = std::minmax(strip.from, strip.to);
  for (std::size_t k = 0; k < kSquares; ++k) {
    const auto x = static_cast<int>(k % kAcross), y = static_cast<int>(k / kAcross);
    const Eigen::Vector2d centre =
        kSquare * Eigen::Vector2d(place.x * kAcross + x + 0.5, place.y * kAcross + y + 0.5);
    const double s = direction.dot(centre), t = direction.x() * centre.y() - direction.y() * centre.x();
    if (s < from - reach || s > to + reach || t < strip.left - reach || t > strip.right + reach) continue;
    const std::size_t square = block * kSquares + k;
    for (std::uint32_t i = begin_[square]; i < begin_[square + 1]; ++i)
      marked[by_square_[i] / 64] |= std::uint64_t{1} << (by_square_[i] % 64);
  }
}

}  // namespace parhelion::semantic
