// Points along a flight of stairs. Internal to the semantic net.
#pragma once

#include <vector>

#include "fusion/semantic/net/find_stairs.hpp"

namespace parhelion::semantic {

/// A rectangle of the plan along a flight's direction, m.
struct Strip {
  double from, to, left, right;
};

/// Calls visit(index in `sorted`) for the points of all blocks that may intersect the strip, grown by 5 cm.
template <class Visit>
void for_each_on_strip(const PlanBlocks& points, const Eigen::Vector2d& direction, const Strip& strip,
                       Visit&& visit) {
  constexpr double kMargin = 0.05;  // m
  const Eigen::Vector2d across(-direction.y(), direction.x());
  Eigen::AlignedBox2d box;
  for (const double s : {strip.from, strip.to}) {
    for (const double t : {strip.left, strip.right}) box.extend((s * direction + t * across).eval());
  }
  points.for_each_in(points.coordinate(box.min().x() - kMargin), points.coordinate(box.min().y() - kMargin),
                     points.coordinate(box.max().x() + kMargin), points.coordinate(box.max().y() + kMargin),
                     [&](const PlanBlocks::Block& block, std::size_t) {
                       for (std::uint32_t i = block.begin; i < block.end; ++i) visit(i);
                     });
}

/// Per step the points of its tread, without those of the adjacent risers: distance along the flight's
/// direction and height, m. `band`: m around the step's own height.
std::vector<std::vector<Eigen::Vector2d>> points_on_steps(const PlanBlocks& points, const Flight& flight,
                                                          double band);

}  // namespace parhelion::semantic
