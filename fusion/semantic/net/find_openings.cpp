// Openings of a wall: doors, windows, gaps.
#include <algorithm>
#include <cmath>

#include "fusion/semantic/net/opening_surroundings.hpp"
#include "fusion/semantic/net/wall_candidates.hpp"
#include "fusion/semantic/net/wall_storeys.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kMaxFurniture = 1.8;  ///< m over the floor: objects in front of a wall are rarely higher
constexpr double kJamb = 0.15;         ///< m of solid wall beside an opening
constexpr double kSolidColumn = 0.5;   ///< minimum fraction of a column that is measured
constexpr double kShallow = 0.015;     ///< m, minimum recess of a leaf above noise
constexpr double kLevelFace = 0.008;   ///< m, maximum roughness of a wall's face and of a leaf
constexpr double kFlat = 0.8;          ///< minimum fraction of a wall's face that is this even

/// Distance of `value` to [low, high], in units of `margin`.
double outside(double value, double low, double high, double margin) {
  return std::max({0.0, low - value, value - high}) / margin;
}

/// Height above which the columns of an opening are measured again; `ceiling` where they are not. Cells
/// beside measured ones count as measured: the edge is one row further.
double head_of(const WallRaster& raster, int c0, int c1, double floor, double ceiling) {
  for (double z = floor + 1.5; z < ceiling - 0.5 * raster.row; z += raster.row) {
    if (raster.fractions(c0, c1, z, z + raster.row).measured > 0.6)
      return std::min(raster.z_low + raster.row * (raster.row_of(z + 0.5 * raster.row) + 1), ceiling);
  }
  return ceiling;
}

/// Points per cell of the columns beside an opening.
double density_beside(const WallRaster& raster, int c0, int c1, double low, double high) {
  constexpr int kBeside = 6;  // columns
  const WallRaster::Fractions left = raster.fractions(c0 - kBeside, c0, low, high),
                              right = raster.fractions(c1, c1 + kBeside, low, high);
  const int cells = left.cells + right.cells;
  return cells > 0 ? static_cast<double>(left.points + right.points) / cells : 0;
}

/// Whether most of the rays towards a row of an opening were stopped before the wall. How many there were is
/// known from the wall beside it: rays that left the site through the opening met nothing. What other rays
/// met in or behind the opening, or passed through, is not hidden.
bool is_hidden(const WallRaster& raster, int c0, int c1, double low, double high) {
  constexpr int kBeside = 6;  // columns
  const WallRaster::Fractions row = raster.fractions(c0, c1, low, high),
                              left = raster.fractions(c0 - kBeside, c0, low, high),
                              right = raster.fractions(c1, c1 + kBeside, low, high);
  const auto rays = [](const WallRaster::Fractions& f) {
    return static_cast<double>(f.points) + static_cast<double>(f.crossed) + static_cast<double>(f.hidden);
  };
  const int cells = left.cells + right.cells;
  const double expected = cells > 0 ? row.cells * (rays(left) + rays(right)) / cells : 0;
  return row.hidden >= 10 && row.hidden > 0.5 * expected && row.hidden > 2 * (rays(row) - row.hidden);
}

/// Height up to which the opening's columns are measured, or hidden by objects in front of them. An object
/// that hides the whole opening, such as a leaf ajar, gives no sill, nor does one before a floor that goes on
/// into the opening (`sill_floor`: along this fraction of it).
double sill_of(const WallRaster& raster, int c0, int c1, double floor, double sill_floor) {
  constexpr double kLowSill = 0.25, kHighSill = 1.3;  // m
  const double beside = density_beside(raster, c0, c1, floor + 0.2, floor + kMaxFurniture);
  const auto solid = [&](double z) {
    const WallRaster::Fractions row = raster.fractions(c0, c1, z, z + raster.row);
    const bool hidden = raster.viewpoints_known
                            ? sill_floor < 0.6 && is_hidden(raster, c0, c1, z, z + raster.row)
                            : beside > 0 && row.hidden > 0.5 * beside * row.cells;
    return row.measured > 0.5 || hidden;
  };
  double z = floor + 0.1;
  while (z < floor + 1.6 && solid(z)) z += raster.row;
  // The foot of the wall may be hidden from some sides, and its upper part be measured.
  if (z < floor + kLowSill) {
    int rows = 0, filled = 0;
    for (double over = floor + 0.1; over < floor + kHighSill; over += raster.row) {
      const bool here = raster.fractions(c0, c1, over, over + raster.row).measured > 0.5;
      ++rows, filled += here;
      if (here && 3 * filled >= 2 * rows) z = over + raster.row;
    }
  }
  return z > floor + kLowSill && z < floor + kHighSill ? z - raster.row : floor;
}

/// Whether it goes up to the ceiling between walls that do, too, and was looked through down to the floor
/// behind it: a doorway without a head.
bool is_passage(const Opening& opening, const WallCandidate& wall) {
  constexpr double kUpper = 0.3, kSolid = 0.6, kFloor = 0.8;  // m under the ceiling; of cells; of the width
  constexpr int kBeside = 6;                                  // columns
  if (!opening.seen_through || opening.sill_floor < kFloor || opening.head < wall.ceiling - kUpper)
    return false;
  const WallRaster& raster = wall.raster;
  const int from = static_cast<int>(std::lround(opening.from / raster.column)),
            to = static_cast<int>(std::lround(opening.to / raster.column));
  const auto solid = [&](int c0, int c1) {
    return raster.fractions(c0, c1, wall.floor + kMaxFurniture, wall.ceiling - kUpper).measured > kSolid;
  };
  return solid(from - kBeside, from) && solid(to, to + kBeside);
}

void score_opening(Opening& opening, const WallCandidate& wall, const SemanticNetOptions& options) {
  const double room = wall.ceiling - wall.floor, height = opening.head - wall.floor;
  const bool viewpoints_known = wall.raster.viewpoints_known;
  // A lintel that fills the rest of a low room need not be visible between walls that reach as high; what is
  // closed up to the ceiling is a niche or a cupboard.
  const bool niche = opening.closed > 0.35 && opening.head > wall.ceiling - 0.2;
  const bool lintel =
      opening.lintel > 0.4 || (!niche && opening.beside_lintel > 0.6 &&
                               room < options.door_height_max + 0.2 && room > options.door_height_min);
  const bool passage = is_passage(opening, wall);
  // A window front is as wide, but has a sill, and its head is higher; behind a wardrobe the wall's other
  // face closes it.
  constexpr double kMaxClosed = 0.7;
  const bool of_double_door = opening.lintel > 0.4 && opening.closed < kMaxClosed &&
                              opening.sill < wall.floor + 0.15 && height > options.door_height_min - 0.05 &&
                              height < options.door_height_max + 0.05;
  const double width_max = of_double_door ? options.double_door_width_max : options.door_width_max;
  double door = -1;
  door -= 3 * outside(opening.width(), options.door_width_min, width_max, 0.1);
  if (!passage) door -= 2 * outside(height, options.door_height_min, options.door_height_max, 0.15);
  door -= 4 * std::max(0.0, opening.sill - wall.floor - 0.2) / 0.2;
  door += lintel ? 1.5 : passage ? 0 : -2;
  // Rays that met nothing went through it, out of the site.
  const double unclosed = opening.seen_through  ? 1.5
                          : opening.empty > 0.6 ? 1
                          : viewpoints_known    ? -1.5
                                                : -0.5;
  door += opening.closed > 0.35 ? 2 : unclosed;
  if (opening.closed <= 0.35) door += opening.sill_floor > 0.6 ? 1 : opening.sill_floor < 0.2 ? -1 : 0;
  // Behind furniture the wall's other face looks like a leaf.
  if (opening.hidden || (opening.niche && !opening.seen_through)) door -= 3;
  opening.door_score = door;

  double window = -1.5;
  window -= 3 * outside(opening.sill - wall.floor, 0.4, 1.4, 0.15);
  window -= 2 * outside(opening.width(), 0.4, 4.0, 0.2);
  window += opening.lintel > 0.4 ? 1 : -1;
  window += opening.seen_through || opening.empty > 0.5 ? 1.5 : opening.closed > 0.35 ? 0.5 : -1;
  opening.window_score = window;
}

/// Columns that are measured at the height of a walking person.
std::vector<bool> solid_columns(const WallCandidate& wall, double low, double high) {
  std::vector<bool> solid;
  for (int c = 0; c < wall.raster.columns; ++c)
    solid.push_back(wall.raster.fractions(c, c + 1, low, high).measured >= kSolidColumn);
  return solid;
}

long count_in(const std::vector<bool>& columns, int from, int to) {
  from = std::max(from, 0), to = std::min(to, static_cast<int>(columns.size()));
  return from >= to ? 0 : std::count(columns.begin() + from, columns.begin() + to, true);
}

/// Runs of columns [first, end) that are not solid, between solid ones.
std::vector<std::pair<int, int>> gaps(const std::vector<bool>& solid) {
  constexpr int kJambs = 3, kMinColumns = 5;  // columns
  std::vector<std::pair<int, int>> found;
  const int n = static_cast<int>(solid.size());
  for (int c = 0; c < n;) {
    int end = c;
    while (end < n && !solid[static_cast<std::size_t>(end)]) ++end;
    const bool framed =
        count_in(solid, c - 2 * kJambs, c) >= kJambs && count_in(solid, end, end + 2 * kJambs) >= kJambs;
    if (end - c > kMinColumns && framed) found.emplace_back(c, end);
    c = end + 1;
  }
  return found;
}

/// Fraction of the rays towards an opening without a hit: relative to the number beside it, those that are
/// missing. Glass and the sky return nothing; a part hidden by furniture is no opening.
double empty_fraction(const WallRaster& raster, int c0, int c1, double low, double high) {
  const WallRaster::Fractions inside = raster.fractions(c0, c1, low, high);
  const double expected = inside.cells * density_beside(raster, c0, c1, low, high);
  const double met = inside.points + static_cast<double>(inside.crossed) + static_cast<double>(inside.hidden);
  return expected < 20 ? 0 : std::clamp(1 - met / expected, 0.0, 1.0);
}

/// Fraction of the plane above a door's height that is measured beside an opening, on the side where it is
/// less. 1: no plane is left there.
double beside_lintel(const WallCandidate& wall, int c0, int c1) {
  constexpr int kBeside = 6;         // columns
  constexpr double kOverDoor = 2.1;  // m
  const auto measured = [&](int from, int to) {
    const WallRaster::Fractions seen =
        wall.raster.fractions(from, to, wall.floor + kOverDoor, wall.ceiling - 0.1);
    return seen.cells > 0 ? seen.measured : 1;
  };
  return std::min(measured(c0 - kBeside, c0), measured(c1, c1 + kBeside));
}

/// The opening in columns [c0, c1), measured.
Opening measure_opening(const PlanPoints& points, const WallCandidate& wall, std::size_t index, int c0,
                        int c1, double low, double high) {
  const WallRaster& raster = wall.raster;
  Opening opening;
  opening.wall = index;
  // Cells beside measured ones count as measured: the opening extends one column further on each side.
  opening.from = (c0 - 1) * raster.column;
  opening.to = (c1 + 1) * raster.column;
  opening.head = head_of(raster, c0, c1, wall.floor, wall.ceiling);
  const OpeningSurroundings around = surroundings_of(points, wall, c0, c1, low, std::min(high, opening.head));
  opening.sill_floor = around.floor_behind;
  opening.hidden = is_behind_furniture(around);
  opening.niche = around.niche > 0.5;
  opening.beside_lintel = beside_lintel(wall, c0, c1);
  opening.sill = sill_of(raster, c0, c1, wall.floor, opening.sill_floor);
  opening.lintel = raster.fractions(c0, c1, opening.head, wall.ceiling - 0.1).measured;
  const double from = std::max(low, opening.sill), to = std::min(high, opening.head);
  const WallRaster::Fractions body = raster.fractions(c0, c1, from, to);
  opening.closed = body.behind;
  opening.seen_through = body.rays >= 10 && body.behind < 0.35;
  opening.walked_through = !raster.viewpoints_known && body.behind < 0.35 && opening.lintel < 0.4 &&
                           !opening.niche && opening.sill_floor > 0.6 && around.floor_before > 0.6;
  opening.empty = empty_fraction(raster, c0, c1, from, to);
  double sum = 0;
  int n = 0;
  for (int k = c0; k < c1; ++k) {
    const double depth = raster.depth[static_cast<std::size_t>(k)];
    if (depth > 0) sum += depth, ++n;
  }
  if (opening.closed > 0.35 && n > 0) opening.recess = sum / n;
  return opening;
}

/// Columns [first, end) of a face that lie behind its plane by the same depth.
struct RecessedColumns {
  int first = 0, end = 0;
  double depth = 0;  ///< m
};

/// Smooth stretches of a door's width behind the plane of the face, with the face itself on both sides.
std::vector<RecessedColumns> recessed_stretches(const WallRaster& raster, double plane,
                                                const std::vector<bool>& on_face,
                                                const SemanticNetOptions& options) {
  std::vector<RecessedColumns> found;
  const int jamb = static_cast<int>(kJamb / raster.column);
  // In a voxel map places are known to half of a voxel: a wall across its grid looks as if it had steps.
  const double shallow = std::max(kShallow, options.voxel / 2);
  for (int c = 0; c < raster.columns;) {
    const double recess = raster.face[static_cast<std::size_t>(c)] - plane;
    int end = c + 1;
    if (recess > shallow) {
      while (end < raster.columns &&
             std::abs(raster.face[static_cast<std::size_t>(end)] - plane - recess) < 1.5 * kLevelFace)
        ++end;
      const double width = (end - c) * raster.column;
      if (width > options.door_width_min - 0.05 && width < options.door_width_max + 0.05 &&
          count_in(on_face, c - 2 * jamb, c) >= jamb && count_in(on_face, end, end + 2 * jamb) >= jamb)
        found.push_back({c, end, recess});
    }
    c = end;
  }
  return found;
}

/// Leaves behind the face by less than the tolerance of the plane. A face that waves has none.
std::vector<Opening> shallow_leaves(const PlanPoints& points, const WallCandidate& wall, std::size_t index,
                                    const SemanticNetOptions& options) {
  const WallRaster& raster = wall.raster;
  std::vector<float> faces;
  for (const float face : raster.face) {
    if (std::isfinite(face)) faces.push_back(face);
  }
  if (faces.size() < 20) return {};
  const double plane = median(faces);
  std::vector<bool> on_face;
  for (const float face : raster.face) on_face.push_back(std::abs(face - plane) < kLevelFace);
  const std::vector<RecessedColumns> stretches = recessed_stretches(raster, plane, on_face, options);
  auto rest = static_cast<double>(faces.size());  // columns
  for (const RecessedColumns& stretch : stretches) rest -= stretch.end - stretch.first;
  if (static_cast<double>(count_in(on_face, 0, raster.columns)) < kFlat * rest) return {};
  std::vector<Opening> found;
  for (const auto& [first, end, recess] : stretches) {
    Opening leaf =
        measure_opening(points, wall, index, first, end, wall.floor + 0.2, wall.floor + kMaxFurniture);
    leaf.from = first * raster.column, leaf.to = end * raster.column;
    leaf.sill = wall.floor;
    leaf.head = std::min(wall.floor + 2.05, wall.ceiling);  // its upper edge cannot be measured
    leaf.closed = 1, leaf.recess = recess, leaf.lintel = 1;
    leaf.seen_through = leaf.niche = leaf.walked_through = false;  // it is shut
    score_opening(leaf, wall, options);
    leaf.door_score -= 1;  // a panel or a poster is equally smooth
    found.push_back(leaf);
  }
  return found;
}

}  // namespace

bool same_hole(const Opening& a, const WallCandidate& wall_a, const Opening& b, const WallCandidate& wall_b) {
  constexpr double kThickest = 0.45;  // m, of a wall
  if (std::abs(std::remainder(wall_a.yaw() - wall_b.yaw(), EIGEN_PI)) > 0.1) return false;
  if (!on_same_storey(wall_a, wall_b)) return false;
  const Eigen::Vector2d along = (wall_a.end - wall_a.start).normalized();
  const Eigen::Vector2d along_b = (wall_b.end - wall_b.start).normalized();
  const Eigen::Vector2d p = wall_b.start + b.from * along_b - wall_a.start,
                        q = wall_b.start + b.to * along_b - wall_a.start;
  const double from = std::min(along.dot(p), along.dot(q)), to = std::max(along.dot(p), along.dot(q));
  const double across = std::abs(along.x() * p.y() - along.y() * p.x());
  return across < kThickest &&
         std::min(a.to, to) - std::max(a.from, from) > 0.5 * std::min(a.width(), b.width());
}

std::vector<Opening> find_openings(const PlanPoints& points, const WallCandidate& wall, std::size_t index,
                                   const SemanticNetOptions& options) {
  const double low = wall.floor + 0.2, high = std::min(wall.floor + kMaxFurniture, wall.ceiling - 0.2);
  std::vector<Opening> found = shallow_leaves(points, wall, index, options);
  const auto add = [&](double from, double to, bool windows) {
    for (const auto& [c, end] : gaps(solid_columns(wall, from, to))) {
      Opening opening = measure_opening(points, wall, index, c, end, low, high);
      // What stands on the sill must not narrow a window.
      if (opening.sill >= wall.floor + 0.4) {
        for (const auto& [wide_c, wide_end] : gaps(solid_columns(wall, opening.sill + 0.2, high))) {
          if (wide_c <= c && wide_end >= end && wide_end - wide_c > end - c)
            opening = measure_opening(points, wall, index, wide_c, wide_end, low, high);
        }
      }
      score_opening(opening, wall, options);
      const auto overlaps = [&](const Opening& other) {
        return std::min(opening.to, other.to) > std::max(opening.from, other.from);
      };
      if (windows && (opening.sill < wall.floor + 0.4 || std::any_of(found.begin(), found.end(), overlaps)))
        continue;
      found.push_back(opening);
    }
  };
  add(low, high, false);
  // A window over a high sill leaves most of its columns measured.
  add(wall.floor + 1.2, high, true);
  std::stable_sort(found.begin(), found.end(),
                   [](const Opening& a, const Opening& b) { return a.from < b.from; });
  return found;
}

}  // namespace parhelion::semantic
