#include "fusion/semantic/net/levels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "fusion/semantic/net/site_columns.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kLip = 0.09, kApart = 0.30,
                 kNearby = 1.5;    ///< m, heights below a floor where there is nothing: a small, a wide one
constexpr double kOver = 10;       ///< m over a shelf, up to the ceiling of a hall
constexpr double kLayer = 0.05;    ///< m, of the columns: one that holds the lower height counts as lower
constexpr double kThickest = 0.7;  ///< m, from a ceiling to the floor on it
constexpr double kStorey = 4;      ///< m^2, of an upper floor that nothing was measured over
constexpr double kRaised = 0.4;    ///< of its rim: a plate that drops on as much is no floor
constexpr double kWalled = 0.5;  ///< of its rim: walls stand on a room's floor, higher ground is beyond some
constexpr std::size_t kSamples = 3'000'000;  ///< points used
constexpr double kMinRoomHeight = 1.9;       ///< m, from a floor to the ceiling over it
constexpr double kMinArea = 1.0;             ///< m^2, of a floor or a ceiling
constexpr double kSteepest = 0.364;          ///< m per metre: 20 degrees, as of ramps; steeper is no floor
constexpr double kBow = 0.12;                ///< m, height variation of one floor
constexpr double kPart = 3;                  ///< deduction for a part of a larger level
constexpr double kBeside = 0.6;              ///< m, a level reaches this far beyond its bounds
constexpr double kBeam = 0.5;                ///< m wide: catwalks and landings are wider
constexpr double kBoard = 1.25;              ///< m wide: two shelves back to back
constexpr double kNoLevel = 8;               ///< deduction for a beam, a slice of a roof or a shelf's board

/// What the eye meets beyond a plate's edge: the first cell outwards with points near its height or lower.
enum class Beyond : std::uint8_t { nothing, lower, level, higher };

/// A plate at height `z` (m), and how far it goes down at its edge.
struct PlateEdge {
  double z = 0, step = 0;  ///< m
  bool small = false;      ///< the first cells beyond it may hold its rounded flank
};

Beyond beyond(const SiteColumns& columns, int x, int y, int dx, int dy, const PlateEdge& plate) {
  constexpr int kReach = 4;  // cells: an edge hides what is close behind it
  constexpr int kFlank = 2;  // cells: a body's rounded flank, an arm beside it
  int flank = 0;
  for (int k = 1; k <= kReach; ++k) {
    if (!columns.contains(x + k * dx, y + k * dy)) break;
    const std::uint32_t cell = columns.index(x + k * dx, y + k * dy);
    // Over a small thing a table is no wall, and a wall behind it says nothing of the ground between them.
    if (columns.occupied(cell, plate.z + 0.2, plate.z + (plate.small ? 0.45 : 1.0)))
      return plate.small && k > 1 ? Beyond::nothing : Beyond::higher;
    if (columns.occupied(cell, plate.z - plate.step, plate.z + 0.1)) {
      if (!plate.small || flank == kFlank) return Beyond::level;
      ++flank;
    } else if (columns.occupied(cell, plate.z - 1.4, plate.z - plate.step + (plate.small ? kLayer : 0))) {
      return Beyond::lower;
    }
  }
  return flank > 0 ? Beyond::level : Beyond::nothing;
}

/// Fraction of the rim of these cells beyond which it goes down by more than the plate's step.
double drops_of(const SiteColumns& columns, const std::vector<std::uint32_t>& cells, const PlateEdge& plate) {
  double lower = 0, all = 0;
  for (const std::uint32_t cell : cells) {
    const int x = static_cast<int>(cell) % columns.width(), y = static_cast<int>(cell) / columns.width();
    for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      if (!columns.contains(x + dx, y + dy) ||
          std::binary_search(cells.begin(), cells.end(), columns.index(x + dx, y + dy)))
        continue;
      const Beyond next = beyond(columns, x, y, dx, dy, plate);
      all += next == Beyond::nothing ? 0 : 1;
      lower += next == Beyond::lower ? 1 : 0;
    }
  }
  return all > 0 ? lower / all : 0;
}

/// Fraction of the rim of these cells at height `z` (m) at which something rises and nothing was measured
/// below: the foot of a wall. Beside a table walls go on below its top, and most of its rim meets none.
double walled_of(const SiteColumns& columns, const std::vector<std::uint32_t>& cells, double z) {
  double walled = 0, all = 0;
  for (const std::uint32_t cell : cells) {
    const int x = static_cast<int>(cell) % columns.width(), y = static_cast<int>(cell) / columns.width();
    for (const auto& [dx, dy] : {std::pair{1, 0}, {-1, 0}, {0, 1}, {0, -1}}) {
      const bool inside = columns.contains(x + dx, y + dy);
      if (inside && std::binary_search(cells.begin(), cells.end(), columns.index(x + dx, y + dy))) continue;
      ++all;
      const auto rises = [&](std::uint32_t at) {
        return columns.occupied(at, z + 0.4, z + 1.0) && !columns.occupied(at, z - 1.4, z - kLip);
      };
      walled += rises(cell) || (inside && rises(columns.index(x + dx, y + dy))) ? 1 : 0;
    }
  }
  return all > 0 ? walled / all : 0;
}

/// Whether it is small, and a larger surface is as far below it as a body or a box is high.
bool lies_on_larger(const std::vector<HorizontalSurface>& all, std::size_t h) {
  constexpr double kBody = 0.3;  // m
  if (all[h].area >= kStorey) return false;
  const Eigen::AlignedBox2d plan(all[h].low, all[h].high);
  return std::any_of(all.begin(), all.end(), [&](const HorizontalSurface& g) {
    const double under = all[h].z - g.z;
    return !g.faces_down && under > kLip - kLayer && under < kBody && g.area > all[h].area &&
           plan.exteriorDistance(Eigen::AlignedBox2d(g.low, g.high)) < kBeside;
  });
}

/// m, about: of a strip in any direction its width, of a rectangle a little less than its shorter side.
double width_of(const HorizontalSurface& h) { return h.area / std::max(1e-6, (h.high - h.low).norm()); }

bool beside(const HorizontalSurface& h, const Eigen::Vector2d& p) {
  return (p.array() > h.low.array() - kBeside).all() && (p.array() < h.high.array() + kBeside).all();
}

}  // namespace

Levels::Levels(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation)
    : segmentation_(segmentation) {
  const std::size_t n = segmentation.horizontals.size();
  evidence_.resize(n);
  floor_part_.assign(n, 0);
  ceiling_part_.assign(n, 0);
  find_evidence(cloud);
  std::vector<float> heights;
  for (std::size_t i = 0; i < cloud.size(); i += 1 + cloud.size() / 200'000)
    heights.push_back(cloud.points[i].z());
  if (!heights.empty()) top_ = quantile(heights, 0.995), floor_ = lowest_ = quantile(heights, 0.005);
  find_parts();
  find_raised();
  find_tops();
  find_scattered();
  double floor_area = 0, ceiling_area = 0;
  for (std::size_t h = 0; h < n; ++h) {
    const double area = segmentation.horizontals[h].area;
    if (floor_score(h) > 0 && area > floor_area) {
      floor_area = area;
      floor_ = lowest_ = segmentation.horizontals[h].z;
      has_floor_ = true;
    }
  }
  // What little lies under a floor may be its image in it.
  constexpr double kOfWidest = 0.1;
  for (std::size_t h = 0; h < n; ++h) {
    const HorizontalSurface& surface = segmentation.horizontals[h];
    if (floor_score(h) > 0 && surface.area > kOfWidest * floor_area) lowest_ = std::min(lowest_, surface.z);
  }
  for (std::size_t h = 0; h < n; ++h) {
    const HorizontalSurface& surface = segmentation.horizontals[h];
    if (ceiling_score(h) > 0 && surface.area > ceiling_area) {
      ceiling_area = surface.area;
      ceiling_ = surface.z;
    }
  }
}

void Levels::find_evidence(const cloud::PointCloud<Map>& cloud) {
  const SiteColumns columns(cloud);
  const std::size_t verticals = segmentation_.verticals.size();
  SurfaceCells cells(segmentation_.horizontals.size());
  std::vector<std::uint32_t> before(cells.size(), ~std::uint32_t{0});
  const std::size_t stride = 1 + cloud.size() / kSamples;
  for (std::size_t i = 0; i < cloud.size(); i += stride) {
    const std::uint32_t surface = segmentation_.surface_of[i];
    if (surface == kNoSurface || surface < verticals) continue;
    const std::uint32_t cell = columns.cell_of(cloud.points[i]);
    if (before[surface - verticals] != cell) cells[surface - verticals].push_back(cell);
    before[surface - verticals] = cell;
  }
  for (auto& of_surface : cells) {
    std::sort(of_surface.begin(), of_surface.end());
    of_surface.erase(std::unique(of_surface.begin(), of_surface.end()), of_surface.end());
  }
  for (std::size_t h = 0; h < cells.size(); ++h) {
    const double z = segmentation_.horizontals[h].z;
    // A pavement is wide and may lie over the street by a step; what is small and does is a crate.
    const double step = segmentation_.horizontals[h].area < kStorey ? kLip : kApart;
    const bool small = lies_on_larger(segmentation_.horizontals, h);
    const bool narrow = width_of(segmentation_.horizontals[h]) < kBoard;
    double lowest = 0, highest = 0, overlooked = 0;
    for (const std::uint32_t cell : cells[h]) {
      lowest += columns.occupied(cell, z - kNearby, z - step) ? 0 : 1;
      const auto is_under = [&](double reach) {
        return columns.occupied(cell, z + 0.15, z + reach) && !carries_floor(cells, h, cell);
      };
      highest += is_under(kNearby) ? 0 : 1;
      overlooked += narrow && is_under(kOver) ? 1 : 0;
    }
    const double n = std::max(1.0, static_cast<double>(cells[h].size()));
    evidence_[h] = {lowest / n, highest / n, drops_of(columns, cells[h], {z, step, small}),
                    walled_of(columns, cells[h], z), overlooked / n};
  }
}

/// Whether a floor lies on the ceiling `h` over a cell.
bool Levels::carries_floor(const SurfaceCells& cells, std::size_t h, std::uint32_t cell) const {
  const std::vector<HorizontalSurface>& all = segmentation_.horizontals;
  for (std::size_t g = 0; g < all.size(); ++g) {
    const double over = all[g].z - all[h].z;
    if (all[g].faces_down || over < 0.05 || over > kThickest || all[g].area < kMinArea) continue;
    if (std::binary_search(cells[g].begin(), cells[g].end(), cell)) return true;
  }
  return false;
}

void Levels::find_parts() {
  const std::vector<HorizontalSurface>& all = segmentation_.horizontals;
  for (std::size_t h = 0; h < all.size(); ++h) {
    const Eigen::Vector2d centre = 0.5 * (all[h].low + all[h].high);
    for (std::size_t g = 0; g < all.size(); ++g) {
      if (all[g].area < kPart * all[h].area || !beside(all[g], centre)) continue;
      const double over = all[h].z - all[g].z;
      if (!all[g].faces_down && over > 0 && over < kBow) floor_part_[h] = 2 * kPart;
      if (all[g].faces_down && over < 0 && over > -1.0) ceiling_part_[h] = 2 * kPart;
    }
  }
}

/// A plate that no climbable step joins to the floor under it is furniture, whatever hides that floor.
void Levels::find_raised() {
  constexpr double kClimb = 0.25, kHigh = 1.4, kNext = 1.0;  // m
  constexpr double kLowGround = 0.7;  // m, below a room's floor; worktops begin above that
  constexpr double kDeck = 20;        // m^2: wider than worktops
  const std::vector<HorizontalSurface>& all = segmentation_.horizontals;
  std::vector<std::size_t> raised;
  for (std::size_t h = 0; h < all.size(); ++h) {
    if (all[h].faces_down || floor_score(h) <= 0) continue;
    const Eigen::AlignedBox2d plan(all[h].low, all[h].high);
    std::vector<double> between;
    bool over_floor = false;
    double floor = all[h].z;
    for (std::size_t g = 0; g < all.size(); ++g) {
      const double under = all[h].z - all[g].z;
      if (all[g].faces_down || under <= 0 || under > kHigh) continue;
      if (plan.exteriorDistance(Eigen::AlignedBox2d(all[g].low, all[g].high)) > kNext) continue;
      between.push_back(all[g].z);
      const bool is_room = evidence_[h].walled > kWalled && (under < kLowGround || all[h].area > kDeck);
      const bool wider = all[h].area > kStorey && (all[h].area > all[g].area || is_room);
      if (under < kClimb || wider || floor_score(g) <= 0) continue;
      over_floor = true;
      floor = std::min(floor, all[g].z);
    }
    std::sort(between.begin(), between.end());
    for (const double z : between) floor = z > floor && z < floor + kClimb ? z : floor;
    if (over_floor && all[h].z > floor + kClimb) raised.push_back(h);
  }
  for (const std::size_t h : raised) floor_part_[h] += 4 * kPart;
}

/// Where the floor was cut off, or nobody saw it, walls go on below each level plate. Those that are lower
/// than a storey's floor could be are the tops of tables and seats, however little lies under them.
void Levels::find_tops() {
  constexpr double kLong = 1.0, kHigh = 0.8, kMinLength = 4;  // m: of a wall's surface; of all together
  constexpr double kAbove = 0.12, kAboveWide = 0.25;          // m over the walls' foot
  constexpr double kStoreyHeight = 2.2;                       // m, least
  std::vector<std::pair<double, double>> feet;                // m: height, length
  double all = 0;
  for (const VerticalSurface& wall : segmentation_.verticals) {
    const double length = (wall.end - wall.start).norm();
    if (length < kLong || wall.z_high - wall.z_low < kHigh) continue;
    feet.emplace_back(wall.z_low, length);
    all += length;
  }
  if (all < kMinLength) return;
  std::sort(feet.begin(), feet.end());
  double foot = feet.front().first, below = 0;
  for (std::size_t i = 0; i < feet.size() && below < 0.5 * all; ++i)
    foot = feet[i].first, below += feet[i].second;
  for (std::size_t h = 0; h < segmentation_.horizontals.size(); ++h) {
    const HorizontalSurface& plate = segmentation_.horizontals[h];
    if (!plate.faces_down && plate.area > kMinArea &&
        plate.z < foot + (plate.area < kStorey ? kAbove : kAboveWide))
      return;
  }
  for (std::size_t h = 0; h < floor_part_.size(); ++h)
    if (segmentation_.horizontals[h].z < foot + kStoreyHeight) floor_part_[h] += 4 * kPart;
}

/// Crowns of trees, eaves and the tops of hedges along a street are seen from below here and there: rooms
/// have more of a ceiling for their floor, or none was seen.
void Levels::find_scattered() {
  constexpr double kOfFloor = 0.12;
  const std::vector<HorizontalSurface>& all = segmentation_.horizontals;
  double floors = 0, ceilings = 0;
  for (std::size_t h = 0; h < all.size(); ++h) {
    floors += floor_score(h) > 0 ? all[h].area : 0;
    ceilings += ceiling_score(h) > 0 ? all[h].area : 0;
  }
  if (ceilings < kOfFloor * floors) ceiling_part_.assign(all.size(), 2 * kPart);
}

std::vector<double> Levels::floors() const {
  constexpr double kWide = 10, kOther = 0.5;  // m^2; m
  std::vector<double> floors{floor_};
  for (std::size_t h = 0; h < segmentation_.horizontals.size(); ++h) {
    const HorizontalSurface& surface = segmentation_.horizontals[h];
    if (surface.area < kWide || floor_score(h) <= 0) continue;
    const bool other =
        std::all_of(floors.begin(), floors.end(), [&](double z) { return std::abs(z - surface.z) > kOther; });
    if (other) floors.push_back(surface.z);
  }
  return floors;
}

double Levels::floor_score(std::size_t i) const {
  const HorizontalSurface& h = segmentation_.horizontals[i];
  if (h.faces_down) return -4;
  if (h.slope > kSteepest) return -kNoLevel;
  const bool beam = has_floor_ && h.z > floor_ + kMinRoomHeight && width_of(h) < kBeam;
  const double raised = 15 * std::max(0.0, evidence_[i].drops - kRaised);
  return -floor_part_[i] - raised - (beam ? kNoLevel : 0) + 8 * (evidence_[i].lowest - 0.6) +
         std::min(std::log(h.area / kMinArea), 1.5) -
         (evidence_[i].highest > 0.9 && h.z > floor_ + kMinRoomHeight && has_floor_ && h.area < kStorey ? 3
                                                                                                        : 0);
}

double Levels::ceiling_score(std::size_t i) const {
  const HorizontalSurface& h = segmentation_.horizontals[i];
  if (h.z < lowest_ + kMinRoomHeight) return -6;
  // A ceiling hides what is over it, unless a floor lies on it.
  const bool board = evidence_[i].overlooked > 0.5;
  return -ceiling_part_[i] - (board ? kNoLevel : 0) + 6 * (evidence_[i].highest - 0.6) +
         std::min(std::log(h.area / kMinArea), 1.5) + (h.faces_down ? 1 : -2);
}

double Levels::over(const Eigen::Vector2d& p, double z_high) const {
  double best = std::numeric_limits<double>::max();
  for (std::size_t i = 0; i < segmentation_.horizontals.size(); ++i) {
    const HorizontalSurface& h = segmentation_.horizontals[i];
    if (ceiling_score(i) > 0 && h.z > z_high - 0.3 && h.z < best && beside(h, p)) best = h.z;
  }
  return best < std::numeric_limits<double>::max() ? best
         : ceiling_ && *ceiling_ > z_high - 0.3    ? *ceiling_
                                                   : std::max(top_, z_high);
}

double Levels::under(const Eigen::Vector2d& p, double z_low) const {
  double best = std::numeric_limits<double>::lowest();
  for (std::size_t i = 0; i < segmentation_.horizontals.size(); ++i) {
    const HorizontalSurface& h = segmentation_.horizontals[i];
    if (floor_score(i) > 0 && h.z < z_low + 0.4 && h.z > best && beside(h, p)) best = h.z;
  }
  return best > std::numeric_limits<double>::lowest() ? best : std::min(floor_, z_low);
}

}  // namespace parhelion::semantic
