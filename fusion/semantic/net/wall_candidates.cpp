#include "fusion/semantic/net/wall_candidates.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "fusion/semantic/net/free_standing.hpp"
#include "fusion/semantic/net/hanging_wall.hpp"
#include "fusion/semantic/net/judged_top.hpp"
#include "fusion/semantic/net/mirrored_walls.hpp"
#include "fusion/semantic/net/wall_storeys.hpp"
#include "fusion/semantic/net/weigh_walls.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kParallel = 0.07;   ///< rad (4 degrees): surfaces of one wall
constexpr double kOffset = 0.08;     ///< m, from one wall's line
constexpr double kGap = 3.0;         ///< m, between surfaces of one wall: a double door, a cupboard
constexpr double kMinLength = 0.5;   ///< m, of a wall
constexpr double kNear = 0.045;      ///< m, on the plane: smaller than a shallow recess
constexpr double kMinWallTop = 1.6;  ///< m over the floor; lower ends are furniture or railings
constexpr double kBody = 1.8;        ///< m over the floor: objects in front of a wall are rarely higher

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

WallCandidate merged(const Segmentation& segmentation, std::size_t base, std::vector<bool>& used) {
  const VerticalSurface& seed = segmentation.verticals[base];
  const Eigen::Vector2d along = (seed.end - seed.start).normalized();
  WallCandidate wall;
  double from = 0, to = (seed.end - seed.start).norm();
  wall.z_low = seed.z_low, wall.z_high = seed.z_high, wall.thickness = seed.thickness;
  wall.surfaces = {static_cast<std::uint32_t>(base)};
  wall.curve = seed.curve;
  used[base] = true;
  for (bool grown = seed.curve == kNoCurve; grown;) {
    grown = false;
    for (std::size_t i = 0; i < segmentation.verticals.size(); ++i) {
      if (used[i] || segmentation.verticals[i].curve != kNoCurve) continue;
      const VerticalSurface& other = segmentation.verticals[i];
      const Eigen::Vector2d a = other.start - seed.start, b = other.end - seed.start;
      if (std::abs(cross(along, (b - a).normalized())) > kParallel) continue;
      if (std::max(std::abs(cross(along, a)), std::abs(cross(along, b))) > kOffset) continue;
      const double low = std::min(along.dot(a), along.dot(b)), high = std::max(along.dot(a), along.dot(b));
      if (low > to + kGap || high < from - kGap) continue;
      from = std::min(from, low), to = std::max(to, high);
      wall.z_low = std::min(wall.z_low, other.z_low), wall.z_high = std::max(wall.z_high, other.z_high);
      wall.surfaces.push_back(static_cast<std::uint32_t>(i));
      used[i] = grown = true;
    }
  }
  wall.start = seed.start + from * along;
  wall.end = seed.start + to * along;
  return wall;
}

/// Height above which a wall is visible: over the counter or the table along it.
double visible_from(const Segmentation& segmentation, const WallCandidate& wall) {
  constexpr double kHighest = 1.2, kBeside = 0.4, kLeft = 0.4;  // m; at least that much of the wall remains
  constexpr double kMinArea = 0.2;                              // m^2
  double from = wall.floor + 0.2;
  for (const HorizontalSurface& h : segmentation.horizontals) {
    const Eigen::AlignedBox2d plan((h.low.array() - kBeside).matrix(), (h.high.array() + kBeside).matrix());
    const bool along = plan.contains(0.5 * (wall.start + wall.end));
    if (along && !h.faces_down && h.area > kMinArea && h.z < wall.floor + kHighest &&
        h.z < wall.z_high - kLeft)
      from = std::max(from, h.z);
  }
  return from;
}

/// m, the height at which the wall is measured no further along its whole length; its `z_high` if there is
/// none. Points of the ceiling that lie in the wall's plane, as a person's who walked there while a scanner
/// turned, do not make it higher; nor does, where no rays tell, a pillar in line with low things.
double top_of_support(const WallCandidate& wall) {
  constexpr double kBand = 0.1, kUnderCeiling = 0.2;                // m
  constexpr double kSome = 0.5, kNone = 0.15, kNoneUnplaced = 0.3;  // of a band's cells
  constexpr int kFewest = 3;                                        // bands without support
  const double max_none = wall.raster.viewpoints_known ? kNone : kNoneUnplaced;
  int none = 0;
  for (double z = wall.ceiling - kUnderCeiling - kBand; z > wall.floor; z -= kBand) {
    const double measured = wall.raster.fractions(0, wall.raster.columns, z, z + kBand).measured;
    if (measured > kSome) return none >= kFewest ? std::min(wall.z_high, z + kBand) : wall.z_high;
    none += measured < max_none ? 1 : 0;
  }
  return wall.z_high;
}

void measure_coverage(WallCandidate& wall, const std::vector<Opening>& openings) {
  const WallRaster& raster = wall.raster;
  double covered = 0, cells = 0, upper = 0, upper_cells = 0, seen = 0, all = 0;
  for (int c = 0; c < raster.columns; ++c) {
    const double at = (c + 0.5) * raster.column;
    const bool in_opening = std::any_of(openings.begin(), openings.end(), [&](const Opening& opening) {
      return at > opening.from && at < opening.to && std::max(opening.door_score, opening.window_score) > 0;
    });
    const WallRaster::Fractions whole = raster.fractions(c, c + 1, wall.visible_from, wall.judged_top - 0.15);
    seen += whole.cells * (whole.measured + whole.behind + whole.through);
    all += whole.cells;
    if (in_opening) continue;
    covered += whole.cells * whole.measured;
    cells += whole.cells;
    const WallRaster::Fractions above =
        raster.fractions(c, c + 1, wall.floor + kBody, wall.judged_top - 0.15);
    upper += above.cells * above.measured;
    upper_cells += above.cells;
  }
  wall.coverage = cells > 0 ? covered / cells : 0;
  wall.upper_coverage = upper_cells > 0 ? upper / upper_cells : wall.coverage;
  wall.observed = all > 0 ? seen / all : 0;
}

/// How much of a wall is known to be solid and how much to be open, in blocks that several rays meet: single
/// cells are finer than the ray spacing.
void measure_sight(WallCandidate& wall, const std::vector<Opening>& openings) {
  constexpr int kColumns = 5, kRows = 3;  // 0.25 by 0.3 m
  constexpr double kSolid = 0.4;          // minimum fraction of a block's cells that are measured
  constexpr int kRays = 3;                // minimum that passed through: one may have grazed an edge
  const WallRaster& raster = wall.raster;
  double solid = 0, open = 0, unknown = 0;
  for (int c = 0; c + kColumns <= raster.columns; c += kColumns) {
    const double at = (c + 0.5 * kColumns) * raster.column;
    const bool in_door = std::any_of(openings.begin(), openings.end(), [&](const Opening& opening) {
      return at > opening.from && at < opening.to && opening.door_score > 0;
    });
    if (in_door) continue;
    for (double z = wall.visible_from; z + kRows * raster.row <= wall.judged_top - 0.1;
         z += kRows * raster.row) {
      const WallRaster::Fractions block = raster.fractions(c, c + kColumns, z, z + kRows * raster.row);
      (block.measured >= kSolid ? solid : block.rays >= kRays ? open : unknown) += 1;
    }
  }
  wall.open = solid + open > 0 ? open / (solid + open) : 0;
  // The unobserved part counts half against a wall: scans see most of a site.
  if (raster.viewpoints_known && solid + open + unknown > 0)
    wall.coverage = solid / (solid + open + 0.5 * unknown);
}

/// Whether the floor was measured on at most one side of the wall.
bool one_sided(const PlanPoints& points, const WallCandidate& wall) {
  const auto columns = static_cast<std::size_t>(wall.raster.columns);
  std::vector<bool> left(columns), right(columns);
  points.near_segment(wall.start, wall.end, 0.6, [&](const PlanPoints::Point& point) {
    if (std::abs(point.p.z() - wall.floor) > 0.1) return;
    const Eigen::Vector2d d = point.p.head<2>().cast<double>() - wall.start;
    const double offset = wall.raster.away.dot(d);
    const int c = static_cast<int>(std::floor(wall.raster.along.dot(d) / wall.raster.column));
    if (c < 0 || c >= wall.raster.columns || std::abs(offset) < 0.15 || std::abs(offset) > 0.6) return;
    (offset > 0 ? left : right)[static_cast<std::size_t>(c)] = true;
  });
  const auto fraction = [&](const std::vector<bool>& side) {
    return static_cast<double>(std::count(side.begin(), side.end(), true)) / static_cast<double>(columns);
  };
  return std::min(fraction(left), fraction(right)) < 0.25;
}

/// Whether a level surface begins at its top: then it is the front of a counter or a chest, not a wall.
bool carries_top(const Segmentation& segmentation, const WallCandidate& wall) {
  constexpr double kHighest = 1.4, kSame = 0.08, kBeside = 0.15;  // m
  constexpr double kMinArea = 0.2;                                // m^2
  if (wall.curve != kNoCurve || wall.z_high - wall.floor > kHighest) return false;
  return std::any_of(segmentation.horizontals.begin(), segmentation.horizontals.end(),
                     [&](const HorizontalSurface& h) {
                       const Eigen::AlignedBox2d plan((h.low.array() - kBeside).matrix(),
                                                      (h.high.array() + kBeside).matrix());
                       return !h.faces_down && h.area > kMinArea && std::abs(h.z - wall.z_high) < kSame &&
                              plan.contains(0.5 * (wall.start + wall.end));
                     });
}

double wall_score(const WallCandidate& wall) {
  const double room = wall.ceiling - wall.floor, top = wall.z_high - wall.floor;
  double score = 6 * (wall.coverage - 0.45) + 0.6 * std::min(wall.whole_length(), 3.0) - 0.8;
  if (room > kMinWallTop + 0.4) {
    score += wall.ceiling - wall.z_high < 0.4                       ? 1.5
             : top < kMinWallTop && wall.judged_top == wall.ceiling ? -6
                                                                    : -1.5;
    score += 5 * std::min(0.0, wall.upper_coverage - 0.45);
  } else {
    // Without a ceiling height: a wall reaches the top of the measurements and bounds the floor.
    score += wall.ceiling - wall.z_high < 0.12 ? 0.5 : -3;
    score += wall.one_sided ? 1 : -2.5;
  }
  // Windows are looked through too, but they are the smaller part of a wall; a railing is mostly open.
  if (wall.raster.viewpoints_known) score -= 16 * std::max(0.0, wall.open - 0.2);
  return score;
}

/// Fraction of its length that is openings: pillars with gaps between them are no wall.
double open_length(const WallCandidate& wall, const std::vector<Opening>& openings) {
  constexpr double kFloor = 0.6;  // of its width
  double sum = 0;
  for (const Opening& opening : openings) {
    // Without viewpoints it is open where nothing closes it, and the floor goes on.
    const bool open = wall.raster.viewpoints_known ? opening.seen_through
                                                   : opening.closed <= 0.35 && opening.sill_floor > kFloor;
    sum += open ? opening.width() : 0;
  }
  return sum / wall.length();
}

std::map<std::uint32_t, double> lengths_of_curves(const Segmentation& segmentation) {
  std::map<std::uint32_t, double> lengths;
  for (const VerticalSurface& s : segmentation.verticals) {
    if (s.curve != kNoCurve) lengths[s.curve] += (s.end - s.start).norm();
  }
  return lengths;
}

/// Indices of the surfaces, those with the most points first; facets of a round one in sequence.
std::vector<std::size_t> by_points(const Segmentation& segmentation) {
  std::map<std::uint32_t, std::uint32_t> of_curve;
  for (const VerticalSurface& s : segmentation.verticals) {
    if (s.curve != kNoCurve) of_curve[s.curve] += s.points;
  }
  const auto key = [&](std::size_t i) {
    const VerticalSurface& s = segmentation.verticals[i];
    return s.curve == kNoCurve ? std::pair(s.points, kNoCurve) : std::pair(of_curve.at(s.curve), s.curve);
  };
  std::vector<std::size_t> order(segmentation.verticals.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return key(a) > key(b); });
  return order;
}

/// Facets of a round wall are labelled together: all are walls or none is.
void average_curve_scores(std::vector<WallCandidate>& walls) {
  std::map<std::uint32_t, Eigen::Vector2d> sums;  // score times length, length
  for (const WallCandidate& wall : walls) {
    if (wall.curve == kNoCurve) continue;
    sums.try_emplace(wall.curve, Eigen::Vector2d::Zero()).first->second +=
        wall.length() * Eigen::Vector2d(wall.score, 1);
  }
  for (WallCandidate& wall : walls) {
    if (wall.curve != kNoCurve) wall.score = sums.at(wall.curve).x() / sums.at(wall.curve).y();
  }
}

/// Walls with their heights, not yet measured.
std::vector<WallCandidate> merged_walls(const Segmentation& segmentation, const Levels& levels) {
  std::vector<WallCandidate> walls;
  const std::vector<std::size_t> order = by_points(segmentation);
  const std::map<std::uint32_t, double> round_lengths = lengths_of_curves(segmentation);
  std::vector<bool> used(order.size());
  for (const std::size_t base : order) {
    if (used[base]) continue;
    WallCandidate wall = merged(segmentation, base, used);
    if (wall.curve != kNoCurve) wall.round_length = round_lengths.at(wall.curve);
    if (wall.whole_length() < kMinLength) continue;
    const Eigen::Vector2d middle = 0.5 * (wall.start + wall.end);
    wall.floor = levels.under(middle, wall.z_low);
    wall.ceiling = levels.over(middle, wall.z_high);
    if (wall.ceiling - wall.floor >= 0.3) walls.push_back(std::move(wall));
  }
  return walls;
}

/// Fills the wall's raster and figures; returns its openings.
std::vector<Opening> measure(const PlanPoints& points, const Segmentation& segmentation, const Levels& levels,
                             std::size_t index, const SemanticNetOptions& options, WallCandidate& wall) {
  wall.raster = rasterize(points, wall.start, wall.end, wall.floor, wall.ceiling, kNear);
  if (levels.ceiling()) wall.z_high = top_of_support(wall);  // else what is higher may not have been seen
  wall.visible_from = visible_from(segmentation, wall);
  wall.judged_top = judged_top(points, wall);
  std::vector<Opening> openings = find_openings(points, wall, index, options);
  measure_coverage(wall, openings);
  measure_sight(wall, openings);
  wall.one_sided = one_sided(points, wall);
  wall.score = wall_score(wall) - (carries_top(segmentation, wall) ? 5 : 0) - (hangs(points, wall) ? 12 : 0) -
               10 * std::max(0.0, open_length(wall, openings) - 0.5);
  return openings;
}

/// A door's leaf that is flush with one face of a wall is recessed from the other. Each face gets those of
/// the other that it has no opening for: only one of the two is labelled wall.
void copy_leaves(WallCandidates& found) {
  constexpr double kLeafSeen = 0.35;  // of the opening
  const std::size_t n = found.openings.size();
  for (std::size_t w = 0; w < found.walls.size(); ++w) {
    const WallCandidate& front = found.walls[w];
    for (std::size_t o = 0; o < n; ++o) {
      const Opening& leaf = found.openings[o];
      if (leaf.wall == w || leaf.door_score <= 0 || leaf.closed <= kLeafSeen) continue;
      const WallCandidate& back = found.walls[leaf.wall];
      const auto other = back_face(front, back);
      if (!other) continue;
      const auto along = [&](double at) {
        return front.raster.along.dot(back.raster.start + at * back.raster.along - front.raster.start);
      };
      Opening same = leaf;
      same.wall = w;
      std::tie(same.from, same.to) = std::minmax({along(leaf.from), along(leaf.to)});
      if (same.from < 0 || same.to > front.length()) continue;
      const double side = front.raster.away.dot(back.raster.away) < 0 ? -1 : 1;
      same.recess = other->depth + side * leaf.recess;
      const auto overlaps = [&](const Opening& opening) {
        return opening.wall == w && std::min(same.to, opening.to) > std::max(same.from, opening.from);
      };
      if (std::none_of(found.openings.begin(), found.openings.end(), overlaps))
        found.openings.push_back(same);
    }
  }
}

}  // namespace

WallCandidates find_wall_candidates(const PlanPoints& points, const Segmentation& segmentation,
                                    const Levels& levels, const SemanticNetOptions& options) {
  WallCandidates found{merged_walls(segmentation, levels), {}};
  std::vector<std::vector<Opening>> openings(found.walls.size());
  const auto measure_wall = [&](std::size_t w) {
    openings[w] = measure(points, segmentation, levels, w, options, found.walls[w]);
  };
  tbb::parallel_for(std::size_t{0}, openings.size(), measure_wall);
  for (const std::size_t w : split_by_storey(segmentation, levels, found.walls)) {
    openings.resize(found.walls.size());
    measure_wall(w);
  }
  average_curve_scores(found.walls);
  for (const std::size_t w : weigh_mirrored(points, found.walls)) measure_wall(w);
  for (const std::vector<Opening>& of_wall : openings)
    found.openings.insert(found.openings.end(), of_wall.begin(), of_wall.end());
  weigh_free_standing(points, found.walls);
  weigh_walls(found.walls);
  copy_leaves(found);
  return found;
}

}  // namespace parhelion::semantic
