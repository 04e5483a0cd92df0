#include "fusion/semantic/net/find_stairs.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "fusion/semantic/net/flight_profile.hpp"
#include "fusion/semantic/net/flight_strip.hpp"
#include "fusion/semantic/net/stair_slopes.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr std::size_t kMaxPoints = 600;  ///< sample size of a surface for locating it
constexpr int kDirections = 72;          ///< number of tested directions
constexpr std::size_t kMinRises = 3;     ///< of a flight; two may be a threshold and a box
constexpr std::size_t kSeedRises = 2;    ///< of surfaces: the floor is too wide for a strip; added later
constexpr double kGap = 0.30;            ///< m, between two treads in the plan: hidden by the step's edge
constexpr double kUneven = 0.025;  ///< m, a rise may differ from the flight's median (EN 13101: 1 cm; worn)
constexpr double kShallow = 0.08;  ///< m, half a bin less than the lowest rise

struct Tread {
  std::uint32_t horizontal = 0;
  double z = 0;
  std::vector<Eigen::Vector2d> plan;  ///< a sample of its points
};

std::vector<Tread> treads_of(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation) {
  std::vector<Tread> treads;
  const std::size_t verticals = segmentation.verticals.size();
  std::vector<std::uint32_t> seen(segmentation.horizontals.size(), 0);
  for (std::uint32_t h = 0; h < segmentation.horizontals.size(); ++h)
    treads.push_back({h, segmentation.horizontals[h].z, {}});
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const std::uint32_t surface = segmentation.surface_of[i];
    if (surface == kNoSurface || surface < verticals) continue;
    const std::size_t h = surface - verticals;
    const std::size_t stride = 1 + segmentation.horizontals[h].points / kMaxPoints;
    if (seen[h]++ % stride == 0) treads[h].plan.emplace_back(cloud.points[i].head<2>().cast<double>());
  }
  std::erase_if(treads, [&](const Tread& tread) {
    return tread.plan.size() < 20 || segmentation.horizontals[tread.horizontal].faces_down;
  });
  std::stable_sort(treads.begin(), treads.end(), [](const Tread& a, const Tread& b) { return a.z < b.z; });
  return treads;
}

/// A circle of the plan around a tread's points.
struct Circle {
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  double radius = 0;
};

Circle circle_around(const Tread& tread) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : tread.plan) box.extend(p);
  Circle circle{box.center(), 0};
  for (const Eigen::Vector2d& p : tread.plan)
    circle.radius = std::max(circle.radius, (p - circle.centre).norm());
  return circle;
}

/// The treads that may have one before and one after them in a flight, or two on one side, in whatever
/// direction; the others would only be tested in vain.
std::vector<Tread> in_chains(const std::vector<Tread>& treads, const SemanticNetOptions& options) {
  constexpr double kRounding = 1e-3;  // m
  std::vector<Circle> circles;
  for (const Tread& tread : treads) circles.push_back(circle_around(tread));
  std::vector<std::vector<std::uint32_t>> above(treads.size());
  std::vector<bool> has_below(treads.size());
  for (std::uint32_t a = 0; a < treads.size(); ++a) {
    for (std::uint32_t b = a + 1; b < treads.size(); ++b) {
      const double rise = treads[b].z - treads[a].z;
      if (rise > options.rise_max) break;
      if (rise < options.rise_min) continue;
      // follows(): along the flight their strips are up to kGap apart, across it they overlap.
      const double radii = circles[a].radius + circles[b].radius + kRounding;
      if ((circles[a].centre - circles[b].centre).norm() > std::hypot(radii + kGap, radii)) continue;
      above[a].push_back(b), has_below[b] = true;
    }
  }
  std::vector<bool> in_chain(treads.size());
  for (std::uint32_t a = 0; a < treads.size(); ++a) {
    for (const std::uint32_t b : above[a]) {
      if (above[b].empty() && !has_below[a]) continue;
      in_chain[a] = in_chain[b] = true;
    }
  }
  std::vector<Tread> result;
  for (std::size_t i = 0; i < treads.size(); ++i) {
    if (in_chain[i]) result.push_back(treads[i]);
  }
  return result;
}

Step strip(const Tread& tread, const Eigen::Vector2d& direction) {
  const Eigen::Vector2d across(-direction.y(), direction.x());
  std::vector<double> s(tread.plan.size()), t(tread.plan.size());
  for (std::size_t i = 0; i < s.size(); ++i)
    s[i] = direction.dot(tread.plan[i]), t[i] = across.dot(tread.plan[i]);
  const auto [near, far] = quantile_range(s, 0.05, 0.95);
  const auto [left, right] = quantile_range(t, 0.05, 0.95);
  return {tread.horizontal, tread.z, near, far, left, right};
}

/// Whether `b` is the step after `a`: above and parallel (paper 2.3).
bool follows(const Step& a, const Step& b, const SemanticNetOptions& options) {
  const double rise = b.z - a.z;
  if (rise < options.rise_min || rise > options.rise_max) return false;
  const double depth = std::min({a.far - a.near, b.far - b.near, 0.4});
  if (b.near - a.far > kGap || a.far - b.near > 0.35 * depth) return false;
  if (b.near - a.near < 0.6 * options.tread_min) return false;
  const double overlap = std::min(a.right, b.right) - std::max(a.left, b.left);
  return overlap > 0.5 * std::min(a.right - a.left, b.right - b.left) && overlap > 0.4;
}

/// The longest chain in one direction with only unused steps.
Flight longest(const std::vector<Step>& steps, const std::vector<bool>& used,
               const Eigen::Vector2d& direction, const SemanticNetOptions& options) {
  const std::size_t n = steps.size();
  std::vector<int> length(n, 0);
  std::vector<std::size_t> before(n, n);
  Flight flight;
  flight.direction = direction;
  std::size_t best = n;
  for (std::size_t j = 0; j < n; ++j) {
    if (used[j]) continue;
    for (std::size_t i = 0; i < j; ++i) {
      if (used[i] || length[i] + 1 <= length[j] || !follows(steps[i], steps[j], options)) continue;
      if (before[i] < n &&
          std::abs((steps[j].z - steps[i].z) - (steps[i].z - steps[before[i]].z)) > 2 * kUneven)
        continue;
      length[j] = length[i] + 1;
      before[j] = i;
    }
    if (best == n || length[j] > length[best]) best = j;
  }
  for (std::size_t i = best; i < n; i = before[i]) flight.steps.push_back(steps[i]);
  std::reverse(flight.steps.begin(), flight.steps.end());
  return flight;
}

/// The same step along another direction.
Step turned(const Step& step, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const Eigen::Vector2d middle = 0.5 * (step.near + step.far) * from +
                                 0.5 * (step.left + step.right) * Eigen::Vector2d(-from.y(), from.x());
  const double s = to.dot(middle), t = to.x() * middle.y() - to.y() * middle.x();
  const double depth = step.far - step.near, width = step.right - step.left;
  return {step.horizontal, step.z, s - depth / 2, s + depth / 2, t - width / 2, t + width / 2};
}

/// Directions are tested by whole steps of an angle; the risers tell it better.
void turn_square(const StepPoints& points, const std::vector<Tread>& treads, Flight& flight) {
  for (int round = 0; round < 2; ++round) {
    const Eigen::Vector2d before = std::exchange(flight.direction, square_to_risers(points, flight));
    for (Step& step : flight.steps) {
      const auto tread = std::find_if(treads.begin(), treads.end(),
                                      [&](const Tread& t) { return t.horizontal == step.horizontal; });
      step = tread != treads.end() ? strip(*tread, flight.direction) : turned(step, before, flight.direction);
    }
  }
}

/// The number of steps of `a` that lie on `b`, or under it: the underside of an open flight.
std::size_t steps_on(const Flight& a, const Flight& b) {
  constexpr double kUnder = 0.6, kOver = 0.2;  // m
  std::size_t shared = 0;
  for (std::size_t i = 1; i < a.steps.size(); ++i) {
    const Step middle = turned(a.steps[i], a.direction, b.direction);
    const double s = 0.5 * (middle.near + middle.far), t = 0.5 * (middle.left + middle.right);
    for (std::size_t k = 1; k < b.steps.size(); ++k) {
      const Step& step = b.steps[k];
      const double end = k + 1 < b.steps.size() ? b.steps[k + 1].near : step.far;  // hidden treads are short
      if (s < step.near || s > end || t < step.left || t > step.right) continue;
      if (middle.z < step.z - kUnder || middle.z > step.z + kOver) continue;
      ++shared;
      break;
    }
  }
  return shared;
}

bool same_place(const Flight& a, const Flight& b) { return 2 * steps_on(a, b) >= a.steps.size() - 1; }

/// Whether `a` runs across `b`, a third of its steps on it: two flights do not share their place.
bool crosses(const Flight& a, const Flight& b) {
  constexpr double kAcross = 0.94;  // cosine of 20 degrees
  return std::abs(a.direction.dot(b.direction)) < kAcross && 3 * steps_on(a, b) >= a.steps.size() - 1;
}

/// Whether the slope's middle lies on a flight.
bool is_on(const StairSlope& slope, const Flight& flight) {
  const Eigen::Vector2d across(-slope.uphill.y(), slope.uphill.x());
  const double s = slope.uphill.dot(slope.middle.head<2>()), t = across.dot(slope.middle.head<2>());
  const Step middle{kNoSurface, slope.middle.z(), s, s, t, t};
  return same_place({slope.uphill, {middle, middle}, 0}, flight);
}

bool has_step(const Flight& flight, std::uint32_t horizontal) {
  return std::any_of(flight.steps.begin(), flight.steps.end(),
                     [&](const Step& step) { return step.horizontal == horizontal; });
}

/// Two flights over the same steps are one, seen from its two ends: keeps the better one.
void drop_repeated(std::vector<Flight>& flights) {
  std::stable_sort(flights.begin(), flights.end(),
                   [](const Flight& a, const Flight& b) { return a.score > b.score; });
  std::vector<Flight> kept;
  for (Flight& flight : flights) {
    const auto repeats = [&](const Flight& better) {
      return std::any_of(flight.steps.begin() + 1, flight.steps.end() - 1, [&](const Step& step) {
        return step.horizontal != kNoSurface && has_step(better, step.horizontal);
      });
    };
    const auto lies_on = [&](const Flight& better) {
      return same_place(flight, better) || crosses(flight, better);
    };
    if (std::none_of(kept.begin(), kept.end(), repeats) && std::none_of(kept.begin(), kept.end(), lies_on))
      kept.push_back(std::move(flight));
  }
  flights = std::move(kept);
}

/// Leaves out steps at the ends whose rise is none of the flight's.
void drop_uneven_ends(Flight& flight) {
  constexpr double kFar = 0.03;  // m
  const auto is_uneven = [&](std::size_t i) {
    return std::abs(flight.steps[i].z - flight.steps[i - 1].z - median(flight.rises())) > kFar;
  };
  while (flight.steps.size() > kMinRises && is_uneven(1)) flight.steps.erase(flight.steps.begin());
  while (flight.steps.size() > kMinRises && is_uneven(flight.steps.size() - 1)) flight.steps.pop_back();
}

void judge(Flight& flight) {
  std::vector<double> rises = flight.rises();
  const double middle = quantile(rises, 0.5);
  flight.score = -4;
  for (const double rise : rises) flight.score += 2 - 2 * std::abs(rise - middle) / kUneven;
  for (std::size_t i = 1; i < flight.steps.size(); ++i) {
    const Step &a = flight.steps[i - 1], &b = flight.steps[i];
    flight.score -= 2 * std::max(0.0, a.far - b.near) / kShallow;  // strips must not overlap
  }
}

}  // namespace

std::vector<double> Flight::rises() const {
  std::vector<double> result;
  for (std::size_t i = 1; i < steps.size(); ++i) result.push_back(steps[i].z - steps[i - 1].z);
  return result;
}

std::vector<double> Flight::treads() const {
  std::vector<double> result;
  for (std::size_t i = 1; i + 1 < steps.size(); ++i) {
    const double from = 0.5 * (steps[i - 1].far + steps[i].near),
                 to = 0.5 * (steps[i].far + steps[i + 1].near);
    result.push_back(to - from);
  }
  return result;
}

std::vector<Flight> find_flights(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation,
                                 const SemanticNetOptions& options) {
  const std::vector<Tread> treads = treads_of(cloud, segmentation), chained = in_chains(treads, options);
  std::vector<std::vector<Step>> strips(kDirections);
  std::vector<Eigen::Vector2d> directions(kDirections);
  tbb::parallel_for(std::size_t{0}, directions.size(), [&](std::size_t k) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(k) / kDirections;
    directions[k] = {std::cos(angle), std::sin(angle)};
    for (const Tread& tread : chained) strips[k].push_back(strip(tread, directions[k]));
  });
  std::optional<StripPoints> points;
  std::vector<Flight> flights;
  std::vector<bool> used(chained.size(), false);
  for (;;) {
    Flight best;
    for (std::size_t k = 0; k < directions.size(); ++k) {
      Flight flight = longest(strips[k], used, directions[k], options);
      if (flight.steps.size() <= kSeedRises) continue;
      judge(flight);
      if (best.steps.empty() || flight.score > best.score) best = std::move(flight);
    }
    if (best.steps.empty()) break;
    for (std::size_t i = 0; i < chained.size(); ++i)
      used[i] = used[i] || has_step(best, chained[i].horizontal);
    if (!points) points.emplace(cloud.points);
    turn_square({*points, cloud, segmentation}, treads, best);
    extend({*points, cloud, segmentation}, best);
    refine_heights(*points, segmentation, best);
    even_rises(*points, best);
    if (best.steps.size() <= kMinRises) continue;
    for (std::size_t i = 0; i < chained.size(); ++i)
      used[i] = used[i] || has_step(best, chained[i].horizontal);
    judge(best);
    flights.push_back(std::move(best));
  }
  const std::vector<StairSlope> slopes = find_slopes(cloud, segmentation);
  const auto is_taken = [&](const StairSlope& slope) {
    return std::any_of(flights.begin(), flights.end(),
                       [&](const Flight& flight) { return is_on(slope, flight); });
  };
  if (!slopes.empty() && !points) points.emplace(cloud.points);
  std::vector<Flight> on_slopes(slopes.size());
  tbb::parallel_for(std::size_t{0}, slopes.size(), [&](std::size_t i) {
    if (!is_taken(slopes[i])) on_slopes[i] = flight_on({*points, cloud, segmentation}, slopes[i]);
  });
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    if (is_taken(slopes[i])) continue;  // by one of these flights
    Flight& flight = on_slopes[i];
    if (flight.steps.size() <= kSeedRises ||
        std::any_of(flights.begin(), flights.end(),
                    [&](const Flight& other) { return same_place(flight, other); }))
      continue;
    turn_square({*points, cloud, segmentation}, treads, flight);
    extend({*points, cloud, segmentation}, flight);
    refine_heights(*points, segmentation, flight);
    even_rises(*points, flight);
    drop_uneven_ends(flight);
    if (flight.steps.size() <= kMinRises || !is_on_profile({*points, cloud, segmentation}, flight)) continue;
    judge(flight);
    flights.push_back(std::move(flight));
  }
  drop_repeated(flights);
  return flights;
}

}  // namespace parhelion::semantic
