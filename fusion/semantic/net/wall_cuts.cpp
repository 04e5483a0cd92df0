#include "fusion/semantic/net/wall_cuts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace parhelion::semantic {
namespace {

constexpr double kAcross = 0.26;  ///< sine of 15 degrees: a wall along the risers
constexpr double kEdge = 0.05;    ///< m, from a riser to a wall in its plane
constexpr double kReaches = 0.4;  ///< m below the ceiling: a wall that ends there is extended to it
constexpr double kEnd = 0.30;     ///< m, from a wall's end: flights are estimated a little too narrow

/// The part of the line start + t along over which low <= its coordinate <= high.
WallStretch within(double start, double along, double low, double high) {
  constexpr double all = std::numeric_limits<double>::infinity();
  if (std::abs(along) < 1e-9) return start >= low && start <= high ? WallStretch{-all, all} : WallStretch{};
  const auto [from, to] = std::minmax({(low - start) / along, (high - start) / along});
  return {from, to};
}

/// The part of the wall's line that lies on the flight's steps.
WallStretch on_steps(const WallCandidate& wall, const Flight& flight) {
  const Eigen::Vector2d across(-flight.direction.y(), flight.direction.x());
  const Eigen::Vector2d along = (wall.end - wall.start).normalized();
  double left = flight.steps[1].left, right = flight.steps[1].right;
  for (std::size_t i = 2; i < flight.steps.size(); ++i) {
    left = std::min(left, flight.steps[i].left);
    right = std::max(right, flight.steps[i].right);
  }
  // The last level is the landing: only its edge is a step.
  const WallStretch a = within(flight.direction.dot(wall.start), flight.direction.dot(along),
                               flight.steps[1].near - kEdge, flight.steps.back().near + kEdge);
  const WallStretch b = within(across.dot(wall.start), across.dot(along), left, right);
  return {std::max({a.from, b.from, 0.0}), std::min({a.to, b.to, wall.length()})};
}

/// Whether the same hole is a door in the wall's other face.
bool leads_to_door(const NetCandidates& candidates, const Labelling& labelling, std::size_t o) {
  const WallCandidates& all = candidates.walls;
  const Opening& opening = all.openings[o];
  for (std::size_t other = 0; other < all.openings.size(); ++other) {
    const std::size_t wall = all.openings[other].wall;
    if (wall != opening.wall && labelling.openings[other].label == EntityLabel::door &&
        labelling.walls[wall].label == EntityLabel::wall &&
        same_hole(opening, all.walls[opening.wall], all.openings[other], all.walls[wall]))
      return true;
  }
  return false;
}

}  // namespace

WallStretch without_risers(const WallCandidate& wall, const std::vector<const Flight*>& flights) {
  WallStretch rest{0, wall.length()};
  const Eigen::Vector2d along = (wall.end - wall.start).normalized();
  for (const Flight* flight : flights) {
    if (flight->steps.size() < 2 || std::abs(along.dot(flight->direction)) > kAcross) continue;
    const WallStretch riser = on_steps(wall, *flight);
    if (riser.to <= riser.from) continue;
    const bool at_start = riser.from - rest.from < kEnd, at_end = rest.to - riser.to < kEnd;
    if (at_start && !at_end) rest.from = std::max(rest.from, riser.to);
    if (at_end && !at_start) rest.to = std::min(rest.to, riser.from);
  }
  return rest;
}

std::vector<std::size_t> openings_that_cut(const NetCandidates& candidates, const Labelling& labelling,
                                           std::size_t wall, const WallStretch& stretch) {
  std::vector<std::size_t> cuts;
  for (std::size_t o = 0; o < candidates.walls.openings.size(); ++o) {
    const Opening& opening = candidates.walls.openings[o];
    if (opening.wall != wall || opening.from < stretch.from || opening.to > stretch.to) continue;
    if (labelling.openings[o].label != EntityLabel::unknown ||
        ((opening.seen_through || opening.walked_through) && opening.width() > 0.3) ||
        leads_to_door(candidates, labelling, o))
      cuts.push_back(o);
  }
  return cuts;
}

double top_of(const NetCandidates& candidates, const Labelling& labelling, std::size_t wall) {
  const std::vector<WallCandidate>& walls = candidates.walls.walls;
  const auto own = [](const WallCandidate& w) {
    return w.ceiling - w.z_high < kReaches ? w.ceiling : w.z_high;
  };
  if (walls[wall].curve == kNoCurve) return own(walls[wall]);
  std::vector<std::pair<double, double>> tops;  // height, length
  double all = 0;
  for (std::size_t w = 0; w < walls.size(); ++w) {
    if (walls[w].curve != walls[wall].curve || labelling.walls[w].label != EntityLabel::wall) continue;
    tops.emplace_back(own(walls[w]), walls[w].length());
    all += walls[w].length();
  }
  std::sort(tops.begin(), tops.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  double sum = 0;
  for (const auto& [height, length] : tops) {
    sum += length;
    if (4 * sum >= all) return height;
  }
  return own(walls[wall]);
}

}  // namespace parhelion::semantic
