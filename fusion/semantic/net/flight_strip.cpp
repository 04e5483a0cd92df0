#include "fusion/semantic/net/flight_strip.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "fusion/cloud/floor_index.hpp"

namespace parhelion::semantic {

StripPoints::StripPoints(std::span<const Eigen::Vector3f> points)
    : blocks_(points, kAcross * kSquare),
      begin_(blocks_.blocks().size() * kSquares + 1, 0),
      by_square_(blocks_.sorted().size()) {
  const auto square_of = [&](std::size_t b, const Eigen::Vector3f& p) {
    const auto along = [](float at, int block) {
      return std::clamp(cloud::floor_index(at / kSquare) - block * kAcross, 0, kAcross - 1);
    };
    const PlanBlocks::Block& block = blocks_.blocks()[b];
    return b * kSquares + static_cast<std::size_t>(along(p.y(), block.y) * kAcross + along(p.x(), block.x));
  };
  const auto for_each_point = [&](auto&& visit) {
    for (std::size_t b = 0; b < blocks_.blocks().size(); ++b) {
      const PlanBlocks::Block& block = blocks_.blocks()[b];
      for (std::uint32_t i = block.begin; i < block.end; ++i)
        visit(square_of(b, blocks_.sorted()[i]), i - block.begin);
    }
  };
  for_each_point([&](std::size_t square, std::uint32_t) { ++begin_[square + 1]; });
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
  for_each_point([&](std::size_t square, std::uint32_t point) { by_square_[next[square]++] = point; });
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
