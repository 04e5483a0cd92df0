#include "fusion/semantic/net/stair_slopes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <span>
#include <tuple>

#include "fusion/cloud/floor_index.hpp"
#include "fusion/cloud/symmetric3.hpp"
#include "fusion/semantic/net/flight_profile.hpp"
#include "protocols/nearest_on_segment.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kFine = 0.05, kCoarse = 0.25;         ///< m, of the cubes: one point of each fine one counts
constexpr double kWideLevel = 3;                       ///< m^2: a larger level surface is no tread
constexpr std::size_t kFewest = 25;                    ///< points around a slope's middle
constexpr double kFlattest = 0.38, kSteepest = 0.9;    ///< m/m, of a flight
constexpr double kThinnest = 0.02, kThickest = 0.085;  ///< m, sigma of the points about the plane
constexpr double kBroad = 0.12;                        ///< m, sigma along the plane
constexpr double kHalf = 0.75;                         ///< m, along the slope from its middle
constexpr double kSkin = 0.14;                         ///< m, from the plane, upright
constexpr double kOver = 0.55;           ///< m, from the backs of an open flight's steps to its treads
constexpr double kWorth = -0.1;          ///< of a stepping, beyond chance
constexpr std::size_t kMaxPoints = 200;  ///< points that a profile is tried on
constexpr std::size_t kRises = 2;        ///< at least, of a seed

using Place = std::tuple<int, int, int>;  ///< of a cube: y, x, z
Place place_of(const Eigen::Vector3d& p, double side) {
  const auto at = [&](double v) { return cloud::floor_index(v / side); };
  return {at(p.y()), at(p.x()), at(p.z())};
}

/// One point of each fine cube, of what may be treads or risers, by coarse cube.
class LooseCubes {
 public:
  LooseCubes(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation) {
    std::vector<std::pair<Place, std::uint32_t>> fine;
    for (std::uint32_t i = 0; i < cloud.size(); ++i) {
      const std::uint32_t surface = segmentation.surface_of[i];
      const bool wide = surface != kNoSurface && surface >= segmentation.verticals.size() &&
                        segmentation.horizontals[surface - segmentation.verticals.size()].area > kWideLevel;
      if (wide || is_tall(segmentation, surface)) continue;
      const Eigen::Vector3d p = cloud.points[i].cast<double>();
      if (p.cwiseAbs().maxCoeff() < PlanBlocks::kReach) fine.emplace_back(place_of(p, kFine), i);
    }
    std::sort(fine.begin(), fine.end());
    fine.erase(std::unique(fine.begin(), fine.end(),
                           [](const auto& a, const auto& b) { return a.first == b.first; }),
               fine.end());
    for (const auto& [place, i] : fine) {
      const Eigen::Vector3d p = cloud.points[i].cast<double>();
      points_.emplace_back(place_of(p, kCoarse), p);
    }
    std::stable_sort(points_.begin(), points_.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
  }
  const std::vector<std::pair<Place, Eigen::Vector3d>>& points() const { return points_; }

  template <class Visit>
  void for_each_around(const Place& place, Visit&& visit) const {
    const auto [y, x, z] = place;
    for (int n = 0; n < 9; ++n) {
      const int ny = y + n / 3 - 1, nx = x + n % 3 - 1;
      for (auto it = std::lower_bound(points_.begin(), points_.end(), Place{ny, nx, z - 1},
                                      [](const auto&a, const Place&b) { return a.first < b; });
           it != points_.end() && it->first <= Place{ny, nx, z + 1}; ++it)
        visit(it->second);
    }
  }

  /// The points of cubes in rows y0 to y1.
  std::span<const std::pair<Place, Eigen::Vector3d>> rows(int y0, int y1) const {
    constexpr int kLowest = std::numeric_limits<int>::min();
    const auto at = [&](int y) {
      return std::lower_bound(points_.begin(), points_.end(), Place{y, kLowest, kLowest},
                              [](const auto& a, const Place& b) { return a.first < b; });
    };
    return {at(y0), at(y1 + 1)};
  }

 private:
  std::vector<std::pair<Place, Eigen::Vector3d>> points_;
};

std::optional<StairSlope> slope_at(const LooseCubes& cubes, const Place& place) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), squares = sum, beside = sum, origin = sum;
  double n = 0;
  cubes.for_each_around(place, [&](const Eigen::Vector3d& p) {
    if (n == 0) origin = p;
    const Eigen::Vector3d d = p - origin;
    n += 1, sum += d, squares += d.cwiseProduct(d);
    beside += Eigen::Vector3d(d.x() * d.y(), d.x() * d.z(), d.y() * d.z());
  });
  if (n < static_cast<double>(kFewest)) return std::nullopt;
  const Eigen::Vector3d mean = sum / n;
  const cloud::SmallestEigen eigen = cloud::smallest_eigen(
      squares / n - mean.cwiseProduct(mean),
      beside / n - Eigen::Vector3d(mean.x() * mean.y(), mean.x() * mean.z(), mean.y() * mean.z()));
  const double thick = std::sqrt(std::max(0.0, eigen.smallest));
  if (thick < kThinnest || thick > kThickest || eigen.middle < kBroad * kBroad) return std::nullopt;
  const Eigen::Vector3d normal = eigen.vector.z() < 0 ? -eigen.vector : eigen.vector;
  const double level = normal.head<2>().norm(), rise = level / std::max(1e-6, normal.z());
  if (rise < kFlattest || rise > kSteepest) return std::nullopt;
  return StairSlope{origin + mean, -normal.head<2>() / level, rise, 0, 0, static_cast<std::size_t>(n)};
}

/// m, across the slope: how far points of it reach to both sides of its middle without a gap.
void find_width(const LooseCubes& cubes, StairSlope& slope) {
  constexpr double kBin = 0.1, kFar = 3;  // m
  constexpr auto kBins = static_cast<int>(2 * kFar / kBin);
  std::array<bool, kBins> seen{};
  const Eigen::Vector2d across(-slope.uphill.y(), slope.uphill.x());
  const auto reach = static_cast<int>(std::ceil(kFar / kCoarse));
  const auto [y, x, z] = place_of(slope.middle, kCoarse);
  static_cast<void>(z);
  for (const auto& [place, p] : cubes.rows(y - reach, y + reach)) {
    if (std::abs(std::get<1>(place) - x) > reach) continue;
    const Eigen::Vector2d d = p.head<2>() - slope.middle.head<2>();
    const double s = slope.uphill.dot(d), t = across.dot(d);
    if (std::abs(s) > 0.5 * kHalf || std::abs(p.z() - slope.middle.z() - slope.rise * s) > kSkin) continue;
    const auto bin = static_cast<int>((t + kFar) / kBin);
    if (bin >= 0 && bin < kBins) seen[static_cast<std::size_t>(bin)] = true;
  }
  const auto any = [&](int bin) { return bin >= 0 && bin < kBins && seen[static_cast<std::size_t>(bin)]; };
  int left = kBins / 2, right = kBins / 2;
  while (any(left - 1) || any(left - 2)) --left;
  while (any(right + 1) || any(right + 2)) ++right;
  const double middle = across.dot(slope.middle.head<2>());
  slope.left = middle + left * kBin - kFar;
  slope.width = (right + 1 - left) * kBin;
}

/// m, in the plan, from a point to a surface.
double distance(const VerticalSurface& surface, const Eigen::Vector2d& p) {
  return (nearest_on_segment(p, surface.start, surface.end) - p).norm();
}

/// Seen from its side, what is seen of a flight may rise askew: then it rises along the longest of the walls
/// and cheeks beside it.
void turn_along_side(const Segmentation& segmentation, StairSlope& slope) {
  constexpr double kBeside = 1.2, kLong = 0.8, kAskew = 0.85;  // m, m, cosine
  double longest = kLong;
  Eigen::Vector2d along = slope.uphill;
  for (std::uint32_t k = 0; k < segmentation.verticals.size(); ++k) {
    const VerticalSurface& side = segmentation.verticals[k];
    const double length = (side.end - side.start).norm();
    if (length <= longest || !is_tall(segmentation, k) || distance(side, slope.middle.head<2>()) > kBeside)
      continue;
    const Eigen::Vector2d direction = (side.end - side.start) / length;
    if (std::abs(direction.dot(slope.uphill)) < kAskew) continue;
    longest = length;
    along = direction.dot(slope.uphill) > 0 ? direction : -direction;
  }
  slope.rise *= along.dot(slope.uphill);
  slope.uphill = along;
}

/// Steps of one size at one place along the slope.
struct Stepping {
  double edge = 0, z = 0, rise = 0, depth = 0;  ///< m: one riser's place, its foot's height
  double worth = 0;
};

constexpr double kClose = 0.025;  ///< m, from a step to a point on it

/// A point with the step that it is over or under, of those with one depth and place.
struct OnStep {
  double which, s, z;  ///< number of the step from the first one; m behind its riser; m
  bool from_above, from_front;
};

/// How many more points are on a stepping than off it, per point, beyond chance.
class Worth {
 public:
  Worth(const Stepping& steps, std::size_t points)
      : count_(static_cast<double>(std::max<std::size_t>(1, points))),
        // A finer stepping has more of any points on it by chance.
        by_chance_(std::min(0.9, 2 * kClose * (steps.rise + steps.depth) / (steps.rise * steps.depth))) {}
  double of(std::size_t on, std::size_t off) const {
    return ((1 - by_chance_) * static_cast<double>(on) - (1 + by_chance_) * static_cast<double>(off)) /
           count_;
  }

 private:
  double count_, by_chance_;
};

struct Evidence {
  bool on, off;  ///< at most one of them
};

/// Free of branches, which cannot be predicted here: a stepping is tried at any place.
Evidence evidence_of(const OnStep& p, const Stepping& steps) {
  const double over = p.z - (steps.z + (p.which + 1) * steps.rise);  // its tread
  const bool under = over < 0, on_tread = std::abs(over) < kClose;
  const bool by_riser = (under & (p.s < kClose)) | ((over > 0) & (steps.depth - p.s < kClose));
  const bool on = (p.from_above & on_tread) | (p.from_front & by_riser);
  // Seen from behind, what is under a tread may be the back of an open flight, but not the tread before.
  const bool may_be_back = !p.from_front & under & (std::abs(over + steps.rise) > kClose);
  const bool off = !on & !may_be_back;
  return {on, off};
}

/// Replaces `best` if these steps are worth more; stops counting where they cannot be any more.
void try_stepping(const std::vector<OnStep>& points, const Stepping& steps, Stepping& best) {
  constexpr std::size_t kBatch = 16;
  const Worth worth(steps, points.size());
  std::size_t on = 0, off = 0;
  for (std::size_t i = 0; i < points.size();) {
    const std::size_t end = std::min(points.size(), i + kBatch);
    for (; i < end; ++i) {
      const Evidence evidence = evidence_of(points[i], steps);
      on += evidence.on, off += evidence.off;
    }
    if (worth.of(on + points.size() - end, off) <= best.worth) return;
  }
  best = steps;
  best.worth = worth.of(on, off);
}

/// The stepping that is worth the most, if it is worth at least kWorth.
std::optional<Stepping> best_stepping(const FlightPoints& points, const StairSlope& slope, double middle,
                                      double highest) {
  constexpr int kPhases = 10;
  Stepping best;
  best.worth = std::nextafter(kWorth, -1);
  std::array<std::vector<OnStep>, kPhases> placed;
  for (double depth = 0.22; depth < 0.395; depth += 0.02) {
    const auto edge_of = [&](int phase) { return middle + depth * phase / kPhases; };
    for (int phase = 0; phase < kPhases; ++phase) {
      std::vector<OnStep>& of_phase = placed[static_cast<std::size_t>(phase)];
      of_phase.clear();
      for (const FlightPoint& p : points) {
        const double along = (p.s - edge_of(phase)) / depth, which = std::floor(along);
        of_phase.push_back({which, (along - which) * depth, p.z, p.from_above, p.from_front});
      }
    }
    for (const double steeper : {0.92, 1.0, 1.08}) {
      const double rise = steeper * slope.rise * depth;
      if (rise < 0.11 || rise > 0.22) continue;
      for (int phase = 0; phase < kPhases; ++phase) {
        const double edge = edge_of(phase);
        const double half = slope.middle.z() + slope.rise * (edge - middle);
        for (double up = -0.06; up < 0.07 + highest - kSkin; up += 0.02)
          try_stepping(placed[static_cast<std::size_t>(phase)],
                       {edge, half - 0.5 * rise + up, rise, depth, 0}, best);
      }
    }
  }
  return best.depth > 0 ? std::optional(best) : std::nullopt;
}

/// A slope in the place of one that was taken before, and as steep.
bool repeats(const StairSlope& slope, const StairSlope& taken) {
  constexpr double kBeside = 0.7, kUp = 0.2, kAlike = 0.97;  // m, m, cosine
  const Eigen::Vector3d d = slope.middle - taken.middle;
  return d.head<2>().norm() < kBeside && std::abs(d.z() - taken.rise * taken.uphill.dot(d.head<2>())) < kUp &&
         slope.uphill.dot(taken.uphill) > kAlike;
}

}  // namespace

std::vector<StairSlope> find_slopes(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation) {
  constexpr double kNarrowest = 0.4;  // m
  const LooseCubes cubes(cloud, segmentation);
  std::vector<StairSlope> slopes, kept;
  for (std::size_t i = 0; i < cubes.points().size(); ++i) {
    if (i > 0 && cubes.points()[i].first == cubes.points()[i - 1].first) continue;
    if (const auto slope = slope_at(cubes, cubes.points()[i].first)) slopes.push_back(*slope);
  }
  std::stable_sort(slopes.begin(), slopes.end(),
                   [](const StairSlope& a, const StairSlope& b) { return a.points > b.points; });
  for (StairSlope& slope : slopes) {
    const auto repeated = [&](const StairSlope& taken) { return repeats(slope, taken); };
    turn_along_side(segmentation, slope);
    if (std::any_of(kept.begin(), kept.end(), repeated)) continue;
    find_width(cubes, slope);
    if (slope.width > kNarrowest) kept.push_back(slope);
  }
  return kept;
}

Flight flight_on(const StepPoints& points, const StairSlope& slope) {
  ProfileFrame frame{slope.left, slope.width, 0, 0};
  const double middle = slope.uphill.dot(slope.middle.head<2>());
  const double up = slope.rise * kHalf + kOver;
  FlightPoints near = points_along(points, slope.uphill, frame, middle - kHalf, middle + kHalf,
                                   slope.middle.z() - up, slope.middle.z() + up);
  const auto over = [&](const FlightPoint& p) {
    return p.z - slope.middle.z() - slope.rise * (p.s - middle);
  };
  const auto around = std::count_if(near.begin(), near.end(),
                                    [&](const FlightPoint& p) { return std::abs(over(p)) < kSkin; });
  const auto in_front = std::count_if(near.begin(), near.end(), [&](const FlightPoint& p) {
    return p.from_front && std::abs(over(p)) < kSkin;
  });
  const double highest = 2 * in_front < around ? kOver : kSkin;
  std::erase_if(near, [&](const FlightPoint& p) { return over(p) < -kSkin || over(p) > highest; });
  FlightPoints sample;
  const std::size_t stride = 1 + near.size() / kMaxPoints;
  for (std::size_t i = 0; i < near.size(); i += stride) sample.push_back(near[i]);
  Flight best, run;
  const std::optional<Stepping> found = best_stepping(sample, slope, middle, highest);
  if (!found) return best;
  const Stepping& steps = *found;
  frame.rise = steps.rise, frame.depth = steps.depth;
  const FlightPoints all = points_along(points, slope.uphill, frame, middle - 2 * kHalf, middle + 2 * kHalf,
                                        slope.middle.z() - 2 * up, slope.middle.z() + 2 * up);
  best.direction = run.direction = slope.uphill;
  const auto many = static_cast<int>(kHalf / steps.depth) + 1;
  for (int k = -many; k <= many; ++k) {
    const ProfileCorner corner{steps.edge + k * steps.depth, steps.z + k * steps.rise,
                               steps.z + (k + 1) * steps.rise, false};
    const ProfileMatch there = match(all, corner, steps.depth, frame.width);
    if (!there.continues()) {
      run.steps.clear();
      continue;
    }
    if (run.steps.empty()) {
      run.steps.push_back(step_at(corner, {}, frame));
      Step& base = run.steps.back();
      base.z = corner.low, base.far = base.near, base.near -= steps.depth;
    }
    run.steps.push_back(step_at(corner, there, frame));
    if (run.steps.size() > best.steps.size()) best.steps = run.steps;
  }
  if (best.steps.size() <= kRises) best.steps.clear();
  return best;
}

}  // namespace parhelion::semantic
