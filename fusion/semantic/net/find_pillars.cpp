#include "fusion/semantic/net/find_pillars.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace parhelion::semantic {
namespace {

constexpr double kCell = 0.10;      ///< m, of the plan and of the slices
constexpr double kFrom = 0.3;       ///< m over the floor, the lowest slice: above thresholds and clutter
constexpr double kTo = 2.1;         ///< m over the floor, the highest: above a person's head
constexpr double kWidest = 0.8;     ///< m, of a pillar
constexpr double kTall = 0.65;      ///< minimum fraction of occupied slices of a column
constexpr double kMaxLayers = 200;  ///< of kCell, of a pillar's height
constexpr std::size_t kFirst = 3;   ///< the lowest layers may be hidden
constexpr double kAgainstWall = 3, kBehind = 0.15, kLongWall = 1.5;  ///< of the score; m; m
constexpr double kCarriesNothing = 2;                                ///< of the score
constexpr double kSolid = 0.7;                                       ///< coverage
constexpr double kFromWall = 0.15;                                   ///< m: nearer points belong to the wall

bool near_wall(const WallCandidates& walls, const Eigen::Vector2d& p) {
  return std::any_of(walls.walls.begin(), walls.walls.end(), [&](const WallCandidate& wall) {
    // A rejected stub, too, has edges that look like pillars.
    if (wall.score < 0 && (wall.coverage < kSolid || wall.of_pillar)) return false;
    const Eigen::Vector2d along = (wall.end - wall.start).normalized(), d = p - wall.start;
    const double s = along.dot(d);
    return s > -kFromWall && s < wall.length() + kFromWall &&
           std::abs(along.x() * d.y() - along.y() * d.x()) < kFromWall;
  });
}

/// Layers up to where the column ends: a gap of 0.4 m. The ceiling over a person is not part of them.
std::size_t unbroken(const std::vector<bool>& layers) {
  constexpr std::size_t kGap = 4;
  std::size_t top = 0;
  for (std::size_t k = 0; k < layers.size() && k < top + kFirst + kGap; ++k) {
    if (layers[k]) top = k + 1;
  }
  return top;
}

/// Whether it stands before a wall with hardly a gap, as the end of a shelf does.
bool against_wall(const WallCandidates& walls, const PillarCandidate& pillar) {
  const Eigen::Vector2d centre = 0.5 * (pillar.low + pillar.high);
  const double half = 0.5 * (pillar.high - pillar.low).norm();
  return std::any_of(walls.walls.begin(), walls.walls.end(), [&](const WallCandidate& wall) {
    if ((wall.score < 0 && !wall.free_standing) || wall.whole_length() < kLongWall) return false;
    const Eigen::Vector2d along = (wall.end - wall.start).normalized(), d = centre - wall.start;
    const double s = along.dot(d), across = std::abs(along.x() * d.y() - along.y() * d.x());
    const double beyond = wall.free_standing ? kBehind : 0;  // its ends look like pillars
    return s > -beyond && s < wall.length() + beyond && across < half + kBehind;
  });
}

/// Whether the ceiling was measured around it, and nothing between its top and the ceiling: it carries none.
bool ends_free(const PlanPoints& points, const PillarCandidate& pillar, double ceiling) {
  constexpr double kAround = 0.4, kNear = 0.12, kGap = 0.5;  // m
  if (ceiling - pillar.top < kGap) return false;
  bool over = false, between = false;
  points.near_segment(pillar.low, pillar.high, kAround, [&](const PlanPoints::Point& point) {
    const Eigen::Vector2d p = point.p.head<2>().cast<double>();
    const auto within = [&](double margin) {
      return (p.array() > pillar.low.array() - margin).all() &&
             (p.array() < pillar.high.array() + margin).all();
    };
    const double z = static_cast<double>(point.p.z());
    over = over || (within(kAround) && std::abs(z - ceiling) < kNear);
    between = between || (within(kNear) && z > pillar.top + kGap / 2 && z < ceiling - kNear);
  });
  return over && !between;
}

/// Pillars that are seen from `floor` (m) up to the height of a head.
std::vector<PillarCandidate> pillars_over(const PlanPoints& points, const WallCandidates& walls,
                                          const Levels& levels, double floor) {
  std::vector<PillarCandidate> pillars;
  const double to = std::min(kTo, (levels.ceiling() ? *levels.ceiling() : levels.top()) - floor - 0.15);
  if (to < 1.6) return pillars;
  Eigen::AlignedBox2d bounds;
  for (const PlanPoints::Point& point : points.all()) bounds.extend(point.p.head<2>().cast<double>());
  if (bounds.isEmpty()) return pillars;
  const Eigen::Vector2i cells = (bounds.sizes() / kCell).array().floor().cast<int>() + 1;
  if (cells.cast<double>().prod() > 5e7) return pillars;
  const auto index = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(cells.x()) + static_cast<std::size_t>(x);
  };
  const auto cell_of = [&](const Eigen::Vector3f& p) {
    return Eigen::Vector2i(((p.head<2>().cast<double>() - bounds.min()) / kCell).array().floor().cast<int>());
  };
  const int slices = std::min(30, static_cast<int>((to - kFrom) / kCell));
  std::vector<std::uint32_t> column(index(0, cells.y()), 0);
  for (const PlanPoints::Point& point : points.all()) {
    const double z = point.p.z() - floor - kFrom;
    if (z < 0 || z >= slices * kCell) continue;
    const Eigen::Vector2i c = cell_of(point.p);
    column[index(c.x(), c.y())] |= 1U << static_cast<int>(z / kCell);
  }
  const auto tall = [&](int x, int y) { return std::popcount(column[index(x, y)]) >= kTall * slices; };
  std::vector<bool> seen(column.size(), false);
  for (int y0 = 0; y0 < cells.y(); ++y0) {
    for (int x0 = 0; x0 < cells.x(); ++x0) {
      if (seen[index(x0, y0)] || !tall(x0, y0)) continue;
      std::vector<Eigen::Vector2i> part{{x0, y0}};
      seen[index(x0, y0)] = true;
      Eigen::AlignedBox2i box;
      for (std::size_t k = 0; k < part.size(); ++k) {
        box.extend(part[k]);
        for (int y = std::max(part[k].y() - 1, 0); y <= std::min(part[k].y() + 1, cells.y() - 1); ++y) {
          for (int x = std::max(part[k].x() - 1, 0); x <= std::min(part[k].x() + 1, cells.x() - 1); ++x) {
            if (seen[index(x, y)] || !tall(x, y)) continue;
            seen[index(x, y)] = true;
            part.emplace_back(x, y);
          }
        }
      }
      PillarCandidate pillar;
      pillar.low = bounds.min() + kCell * box.min().cast<double>();
      pillar.high = bounds.min() + kCell * (box.max().cast<double>() + Eigen::Vector2d::Ones());
      if ((pillar.high - pillar.low).maxCoeff() > kWidest + kCell) continue;
      const Eigen::Vector2d centre = 0.5 * (pillar.low + pillar.high);
      if (near_wall(walls, centre)) continue;
      pillar.floor = levels.under(centre, floor + 0.2);
      if (floor != levels.floor() && std::abs(pillar.floor - floor) > 0.2) continue;
      std::vector<bool> layers;
      Eigen::AlignedBox2d tight;
      points.near_segment(pillar.low, pillar.high, 0.5, [&](const PlanPoints::Point& point) {
        const Eigen::Vector2d p = point.p.head<2>().cast<double>();
        if ((p.array() < pillar.low.array() - 1e-6).any() || (p.array() > pillar.high.array() + 1e-6).any())
          return;
        const double layer = (static_cast<double>(point.p.z()) - pillar.floor) / kCell;
        if (layer >= 0 && layer < kMaxLayers) {
          layers.resize(std::max(layers.size(), static_cast<std::size_t>(layer) + 1));
          layers[static_cast<std::size_t>(layer)] = true;
        }
        if (point.p.z() > floor + kFrom && point.p.z() < floor + to) tight.extend(p);
      });
      pillar.top = pillar.floor + kCell * static_cast<double>(unbroken(layers));
      if (!tight.isEmpty()) pillar.low = tight.min(), pillar.high = tight.max();
      const double widest = (pillar.high - pillar.low).maxCoeff(),
                   narrow = (pillar.high - pillar.low).minCoeff();
      const double height = pillar.top - pillar.floor;
      pillar.score = 1.5 - 4 * std::max(0.0, widest - 0.6) / 0.2 - 4 * std::max(0.0, 1.9 - height) / 0.2;
      pillar.score -= 2 * std::max(0.0, 0.08 - narrow) / 0.03;  // an edge that a few beams grazed
      const double ceiling = levels.over(centre, pillar.top);
      if (levels.ceiling()) pillar.score += ceiling - pillar.top < 0.5 ? 1 : -1;
      if (levels.ceiling() && ends_free(points, pillar, ceiling)) pillar.score -= kCarriesNothing;
      const bool slender = narrow < 0.15, ends_below = levels.ceiling() && ceiling - pillar.top > 0.3;
      if ((slender || ends_below) && against_wall(walls, pillar)) pillar.score -= kAgainstWall;
      pillars.push_back(pillar);
    }
  }
  return pillars;
}

}  // namespace

std::vector<PillarCandidate> find_pillars(const PlanPoints& points, const WallCandidates& walls,
                                          const Levels& levels) {
  std::vector<PillarCandidate> pillars;
  for (const double floor : levels.floors()) {
    for (PillarCandidate& pillar : pillars_over(points, walls, levels, floor)) {
      const auto same = [&](const PillarCandidate& other) {
        return (pillar.low.array() < other.high.array()).all() &&
               (other.low.array() < pillar.high.array()).all() && pillar.floor < other.top &&
               other.floor < pillar.top;
      };
      if (std::none_of(pillars.begin(), pillars.end(), same)) pillars.push_back(pillar);
    }
  }
  return pillars;
}

}  // namespace parhelion::semantic
