// Points along a flight of stairs. Internal to the semantic net.
#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/semantic/net/find_stairs.hpp"
#include "fusion/semantic/segmentation/plan_blocks.hpp"

namespace parhelion::semantic {

/// A rectangle of the plan along a flight's direction, m.
struct Strip {
  double from, to, left, right;
};

/// The points of a site by blocks of the plan, and by squares within these: a flight uses only its
/// surroundings. Immutable after construction.
class StripPoints {
 public:
  explicit StripPoints(std::span<const Eigen::Vector3f> points);

  const std::vector<Eigen::Vector3f>& sorted() const { return blocks_.sorted(); }
  const std::vector<std::uint32_t>& order() const { return blocks_.order(); }  ///< as in PlanBlocks

  /// Calls visit(index in `sorted`), ascending, for the points of all squares that may intersect the strip,
  /// grown by 5 cm.
  template <class Visit>
  void for_each_on(const Eigen::Vector2d& direction, const Strip& strip, Visit&& visit) const {
    const Eigen::Vector2d across(-direction.y(), direction.x());
    Eigen::AlignedBox2d box;
    for (const double s : {strip.from, strip.to}) {
      for (const double t : {strip.left, strip.right}) box.extend((s * direction + t * across).eval());
    }
    const Eigen::Vector2d low = box.min().array() - kMargin, high = box.max().array() + kMargin;
    std::vector<std::uint64_t> marked;
    blocks_.for_each_in(blocks_.coordinate(low.x()), blocks_.coordinate(low.y()),
                        blocks_.coordinate(high.x()), blocks_.coordinate(high.y()),
                        [&](const PlanBlocks::Block& block, std::size_t b) {
                          mark(b, direction, strip, marked);
                          // The bits give the points back in their own order.
                          for (std::size_t word = 0; word < marked.size(); ++word) {
                            for (std::uint64_t bits = marked[word]; bits != 0; bits &= bits - 1)
                              visit(block.begin + static_cast<std::uint32_t>(64 * word) +
                                    static_cast<std::uint32_t>(std::countr_zero(bits)));
                          }
                        });
  }

 private:
  static constexpr double kMargin = 0.05;  ///< m
  static constexpr int kAcross = 8;        ///< squares along the side of a block
  static constexpr std::size_t kSquares = std::size_t{kAcross} * kAcross;
  static constexpr double kSquare = 0.25;  ///< m
  /// One bit per point of the block: set for those of squares that may intersect the strip.
  void mark(std::size_t block, const Eigen::Vector2d& direction, const Strip& strip,
            std::vector<std::uint64_t>& marked) const;

  PlanBlocks blocks_;
  std::vector<std::uint32_t> begin_;  ///< per block, its squares by y, then x, and one more: into by_square_
  std::vector<std::uint32_t> by_square_;  ///< points, counted from the begin of their block
};

/// Per step the points of its tread, without those of the adjacent risers: distance along the flight's
/// direction and height, m. `band`: m around the step's own height.
std::vector<std::vector<Eigen::Vector2d>> points_on_steps(const StripPoints& points, const Flight& flight,
                                                          double band);

}  // namespace parhelion::semantic
