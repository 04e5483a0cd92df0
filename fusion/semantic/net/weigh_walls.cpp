#include "fusion/semantic/net/weigh_walls.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "fusion/semantic/net/wall_storeys.hpp"
#include "fusion/semantic/net/wall_support.hpp"
#include "protocols/nearest_on_segment.hpp"

namespace parhelion::semantic {
namespace {

double distance(const Eigen::Vector2d& p, const WallCandidate& wall) {
  return (nearest_on_segment(p, wall.start, wall.end) - p).norm();
}

/// m, of a round wall that lies along one straight wall: things before a wall bend it.
double length_along_straight(const std::vector<WallCandidate>& walls,
                             const std::vector<const WallCandidate*>& facets) {
  constexpr double kAlong = 0.15;  // m
  double longest = 0;
  for (const WallCandidate& straight : walls) {
    if (straight.curve != kNoCurve || straight.score <= 0) continue;
    double length = 0;
    for (const WallCandidate* facet : facets) {
      if (distance(0.5 * (facet->start + facet->end), straight) < kAlong) length += facet->length();
    }
    longest = std::max(longest, length);
  }
  return longest;
}

/// Whether the facets of a round wall go around what is seen from outside and no larger than a tank.
bool is_round_body(const std::vector<const WallCandidate*>& facets) {
  constexpr double kRadius = 1.4, kTurn = 3.2, kMinOutside = 0.5;  // m, rad, of its length
  double length = 0, outside = 0;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  for (const WallCandidate* facet : facets) {
    length += facet->length();
    centre += 0.5 * (facet->start + facet->end) * facet->length();
  }
  centre /= length;
  double turn = 0;
  for (std::size_t f = 0; f < facets.size(); ++f) {
    const WallCandidate& facet = *facets[f];
    if (f > 0) turn += std::abs(std::remainder(facet.yaw() - facets[f - 1]->yaw(), 2 * EIGEN_PI));
    const Eigen::Vector2d inwards = centre - 0.5 * (facet.start + facet.end);
    outside += facet.raster.away.dot(inwards) > 0 ? facet.length() : 0;
  }
  return turn > kTurn && length < kRadius * turn && outside > kMinOutside * length;
}

/// Where the segments a + s (b - a) and c + t (d - c) cross: s and t; nullopt where they do not.
std::optional<Eigen::Vector2d> crossing(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                        const Eigen::Vector2d& c, const Eigen::Vector2d& d) {
  const auto cross = [](const Eigen::Vector2d& u, const Eigen::Vector2d& v) {
    return u.x() * v.y() - u.y() * v.x();
  };
  const Eigen::Vector2d u = b - a, v = d - c;
  const double det = cross(u, v);
  if (std::abs(det) < 1e-9) return std::nullopt;
  const Eigen::Vector2d at(cross(c - a, v) / det, cross(c - a, u) / det);
  if ((at.array() < 0).any() || (at.array() > 1).any()) return std::nullopt;
  return at;
}

/// Whether a straight wall was measured on both sides of a place along it (m).
bool goes_on(const WallCandidate& wall, double at) {
  constexpr double kFrom = 0.2, kTo = 0.5, kMeasured = 0.5;  // m, m, of the cells
  const auto measured = [&](double from, double to) {
    const double column = wall.raster.column;
    return wall.raster
               .fractions(static_cast<int>(from / column), static_cast<int>(to / column), wall.floor + 0.2,
                          wall.ceiling - 0.1)
               .measured > kMeasured;
  };
  return at > kTo && at < wall.length() - kTo && measured(at - kTo, at - kFrom) &&
         measured(at + kFrom, at + kTo);
}

/// Whether the facets of an arc, in sequence, pass through a straight wall: round walls end at others.
bool passes_through(const std::vector<WallCandidate>& walls,
                    const std::vector<const WallCandidate*>& facets) {
  constexpr double kEnd = 0.5, kAlike = 0.35;  // m, from the arc's ends; rad
  double length = 0;
  for (const WallCandidate* facet : facets) length += facet->length();
  double before = 0;
  for (const WallCandidate* facet : facets) {
    for (const WallCandidate& straight : walls) {
      if (straight.curve != kNoCurve || straight.score <= 0) continue;
      if (std::abs(std::remainder(straight.yaw() - facet->yaw(), EIGEN_PI)) < kAlike) continue;
      const auto at = crossing(facet->start, facet->end, straight.start, straight.end);
      if (!at) continue;
      const double along = before + at->x() * facet->length();
      if (along > kEnd && along < length - kEnd && goes_on(straight, at->y() * straight.length()))
        return true;
    }
    before += facet->length();
  }
  return false;
}

/// A round wall exists where its facets are measured over their height, and no straight one says the same: an
/// arc may fit the ends of many things and cross the room between them. Without viewpoints gaps between them
/// count against it.
void weigh_curves(std::vector<WallCandidate>& walls) {
  constexpr double kSupported = 0.6, kStraight = 0.6, kUnsupported = 20;  // of its length; of the score
  std::map<std::uint32_t, double> supported, straight;
  std::map<std::uint32_t, std::vector<const WallCandidate*>> facets;
  for (const WallCandidate& wall : walls) {
    if (wall.curve == kNoCurve) continue;
    if (wall.raster.viewpoints_known) {
      for (const WallStretch& stretch : supported_stretches(wall, {}))
        supported[wall.curve] += stretch.to - stretch.from;
    } else {
      supported[wall.curve] += measured_length(wall);
    }
    facets[wall.curve].push_back(&wall);
  }
  std::map<std::uint32_t, bool> none;
  for (const auto& [curve, of_curve] : facets) {
    straight[curve] = length_along_straight(walls, of_curve);
    none[curve] = is_round_body(of_curve) || passes_through(walls, of_curve);
  }
  for (WallCandidate& wall : walls) {
    if (wall.curve != kNoCurve && (supported[wall.curve] < kSupported * wall.round_length ||
                                   straight[wall.curve] > kStraight * wall.round_length || none[wall.curve]))
      wall.score -= kUnsupported;
  }
}

/// m, from the ends of either to the other.
double apart(const WallCandidate& a, const WallCandidate& b) {
  return std::min({distance(a.start, b), distance(a.end, b), distance(b.start, a), distance(b.end, a)});
}

/// Walls join walls. A short piece that meets no longer one at either end is more likely an object; as short
/// as the face of a pillar, it is one, and so are the other faces.
void weigh_loners(std::vector<WallCandidate>& walls) {
  constexpr double kShort = 2.0, kFace = 0.9, kJoin = 0.35, kAlike = 0.3;  // m, m, m, rad
  constexpr double kOfPillar = 6;                                          // of the score
  std::vector<double> penalty;
  for (const WallCandidate& wall : walls) {
    const double longer = std::max(wall.whole_length(), kFace);
    const bool joins = std::any_of(walls.begin(), walls.end(), [&](const WallCandidate& other) {
      return other.whole_length() > longer && other.score > 0 &&
             std::min(distance(wall.start, other), distance(wall.end, other)) < kJoin &&
             !(std::abs(std::remainder(other.yaw() - wall.yaw(), EIGEN_PI)) < kAlike);
    });
    penalty.push_back(joins || wall.whole_length() > kShort ? 0
                      : wall.whole_length() < kFace         ? kOfPillar
                      : wall.open > 0.2                     ? 4.5
                                                            : 3);
  }
  for (std::size_t w = 0; w < walls.size(); ++w) {
    walls[w].score -= penalty[w];
    walls[w].of_pillar = penalty[w] == kOfPillar;
  }
}

/// Whether `wall` is close behind `front` over most of its length, seen from the same side: between them is
/// no room to stand, so that the front is a cupboard's, a shelf's or a counter's.
bool stands_behind(const WallCandidate& wall, const WallCandidate& front) {
  constexpr double kDepthMin = 0.12, kDepthMax = 0.8, kAlike = 0.12;  // m, m, rad
  if (std::abs(std::remainder(wall.yaw() - front.yaw(), EIGEN_PI)) > kAlike) return false;
  if (!on_same_storey(wall, front)) return false;
  if (wall.raster.away.dot(front.raster.away) < 0) return false;
  const Eigen::Vector2d along = (wall.end - wall.start).normalized();
  const double depth = front.raster.away.dot(0.5 * (wall.start + wall.end) - 0.5 * (front.start + front.end));
  if (depth < kDepthMin || depth > kDepthMax) return false;
  const auto [from, to] =
      std::minmax({along.dot(front.start - wall.start), along.dot(front.end - wall.start)});
  return std::min(to, wall.length()) - std::max(from, 0.0) > 0.7 * front.length();
}

/// Cells of its own plane that hold points.
std::size_t measured_cells(const WallCandidate& wall) {
  const auto& measured = wall.raster.measured;
  return static_cast<std::size_t>(
      std::count_if(measured.begin(), measured.end(), [](std::uint16_t points) { return points > 0; }));
}

/// The front of what stands before a wall is shorter, or a wall as long is seen past it far better.
void weigh_fronts(std::vector<WallCandidate>& walls) {
  constexpr double kFront = 12, kLongest = 0.8, kAlike = 1.25;  // of the score; of the wall's length
  constexpr std::size_t kBetter = 2;                            // times the cells
  const auto is_front = [&](const WallCandidate& front, const WallCandidate& wall) {
    const double length = front.length() / wall.length();
    return length < kLongest || (length < kAlike && measured_cells(wall) > kBetter * measured_cells(front));
  };
  std::vector<bool> front(walls.size());
  for (std::size_t f = 0; f < walls.size(); ++f) {
    front[f] =
        walls[f].curve == kNoCurve && std::any_of(walls.begin(), walls.end(), [&](const WallCandidate& wall) {
          return &wall != &walls[f] && wall.score > 0 && wall.curve == kNoCurve && is_front(walls[f], wall) &&
                 stands_behind(wall, walls[f]);
        });
  }
  for (std::size_t f = 0; f < walls.size(); ++f) walls[f].score -= front[f] ? kFront : 0;
}

/// A stub that meets walls at one end only is more likely the side of a cupboard.
void weigh_stubs(std::vector<WallCandidate>& walls) {
  constexpr double kShort = 0.95, kJoin = 0.3, kAlike = 0.3, kStub = 3;  // m, m, rad, of the score
  const auto joins = [&](const WallCandidate& wall, const Eigen::Vector2d& end) {
    return std::any_of(walls.begin(), walls.end(), [&](const WallCandidate& other) {
      return &other != &wall && other.score > 0 && other.whole_length() > wall.length() &&
             std::abs(std::remainder(other.yaw() - wall.yaw(), EIGEN_PI)) > kAlike &&
             distance(end, other) < kJoin;
    });
  };
  std::vector<std::size_t> stubs;
  for (std::size_t w = 0; w < walls.size(); ++w) {
    const bool stub = walls[w].whole_length() < kShort &&
                      !(joins(walls[w], walls[w].start) && joins(walls[w], walls[w].end));
    if (stub) stubs.push_back(w);
  }
  for (const std::size_t w : stubs) walls[w].score -= kStub;
}

/// Two low surfaces that meet at a corner which points to the scanner are sides of one thing, as of a car or
/// a counter: of a room's low part, corners point away.
void weigh_blocks(std::vector<WallCandidate>& walls) {
  constexpr double kLow = 1.6, kJoin = 0.35, kLong = 5.5, kWide = 2.5;  // m
  constexpr double kSquare = 1.0, kOfBlock = 12;                        // rad; of the score
  const auto is_low = [](const WallCandidate& wall) {
    return wall.curve == kNoCurve && wall.score > 0 && wall.z_high - wall.floor < kLow;
  };
  const auto behind = [](const WallCandidate& front, const WallCandidate& other) {
    return front.raster.away.dot(0.5 * (other.start + other.end) - front.start) > 0;
  };
  std::vector<std::size_t> sides;
  for (std::size_t w = 0; w < walls.size(); ++w) {
    const bool side =
        is_low(walls[w]) && std::any_of(walls.begin(), walls.end(), [&](const WallCandidate& other) {
          const auto [narrow, broad] = std::minmax({walls[w].length(), other.length()});
          return &other != &walls[w] && is_low(other) && narrow < kWide && broad < kLong &&
                 std::abs(std::remainder(other.yaw() - walls[w].yaw(), EIGEN_PI)) > kSquare &&
                 apart(walls[w], other) < kJoin && behind(walls[w], other) && behind(other, walls[w]);
        });
    if (side) sides.push_back(w);
  }
  for (const std::size_t w : sides) walls[w].score -= kOfBlock;
}

}  // namespace

void weigh_walls(std::vector<WallCandidate>& walls) {
  weigh_curves(walls);
  weigh_blocks(walls);
  weigh_loners(walls);
  weigh_fronts(walls);
  weigh_stubs(walls);
}

}  // namespace parhelion::semantic
