// Prerequisites of stairs (paper 2.3): parallel segments at equal distances, here climbing risers.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "fusion/semantic/segmentation/surface_search.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kMaxTurn = 0.1;                         // rad, 6 degrees between neighbours
constexpr double kMinSpacing = 0.15, kMaxSpacing = 1.2;  // m; no tread is narrower, a landing is wider
constexpr double kMinRise = 0.08, kMaxRise = 0.30;       // m, between the tops of neighbours
constexpr double kUnequal = 0.25;                        // of the median spacing
constexpr double kMinOverlap = 0.5;                      // of the shorter segment
constexpr std::size_t kMinMembers = 3;                   // fewer are parallel by chance

/// m from a to b across a, signed; 0 where b cannot be the riser after a.
double step_across(const VerticalSurface& a, const VerticalSurface& b) {
  const Eigen::Vector2d d = (a.end - a.start).normalized();
  const Eigen::Vector2d e = (b.end - b.start).normalized();
  if (std::abs(d.x() * e.y() - d.y() * e.x()) > kMaxTurn) return 0;
  const double rise = b.z_high - a.z_high;
  if (rise < kMinRise || rise > kMaxRise) return 0;
  const double length = (a.end - a.start).norm();
  const double t0 = d.dot(b.start - a.start), t1 = d.dot(b.end - a.start);
  const double overlap = std::min(length, std::max(t0, t1)) - std::max(0.0, std::min(t0, t1));
  if (overlap < kMinOverlap * std::min(length, std::abs(t1 - t0))) return 0;
  const Eigen::Vector2d offset = (b.start + b.end - a.start - a.end) / 2;
  const double across = d.x() * offset.y() - d.y() * offset.x();
  return std::abs(across) >= kMinSpacing && std::abs(across) <= kMaxSpacing ? across : 0;
}

/// For each surface the nearest following riser, or kNoSurface.
std::vector<std::uint32_t> next_risers(const std::vector<VerticalSurface>& verticals) {
  std::vector<Eigen::Vector3f> middles;
  for (const VerticalSurface& v : verticals) {
    const Eigen::Vector2f middle = ((v.start + v.end) / 2).cast<float>();
    middles.emplace_back(middle.x(), middle.y(), 0.0F);
  }
  constexpr double widest = 6;  // m of a flight; longer segments are walls
  const PlanBlocks blocks(middles, widest / 2 + kMaxSpacing);
  std::vector<std::uint32_t> next(verticals.size(), kNoSurface);
  for (std::uint32_t i = 0; i < verticals.size(); ++i) {
    if ((verticals[i].end - verticals[i].start).norm() > widest) continue;
    const int x = blocks.coordinate(static_cast<double>(middles[i].x()));
    const int y = blocks.coordinate(static_cast<double>(middles[i].y()));
    double nearest = 1e9;
    blocks.for_each_in(x - 1, y - 1, x + 1, y + 1, [&](const PlanBlocks::Block& block, std::size_t) {
      for (std::uint32_t k = block.begin; k < block.end; ++k) {
        const std::uint32_t j = blocks.order()[k];
        if (j == i || (verticals[j].end - verticals[j].start).norm() > widest) continue;
        const double step = std::abs(step_across(verticals[i], verticals[j]));
        if (step == 0 || step >= nearest) continue;
        nearest = step;
        next[i] = j;
      }
    });
  }
  return next;
}

/// The longest stretch of the chain with equal steps.
ParallelSet equidistant(const std::vector<VerticalSurface>& verticals,
                        const std::vector<std::uint32_t>& chain) {
  ParallelSet best;
  std::vector<double> steps;
  for (std::size_t i = 0; i + 1 < chain.size(); ++i)
    steps.push_back(step_across(verticals[chain[i]], verticals[chain[i + 1]]));
  for (std::size_t from = 0; from < steps.size(); ++from) {
    for (std::size_t to = steps.size(); to > from; --to) {
      std::vector<double> sorted;
      for (std::size_t i = from; i < to; ++i) sorted.push_back(std::abs(steps[i]));
      std::sort(sorted.begin(), sorted.end());
      const double median = sorted[sorted.size() / 2];
      if (sorted.front() < (1 - kUnequal) * median || sorted.back() > (1 + kUnequal) * median) continue;
      if (to - from + 1 <= best.members.size()) break;
      best.members.assign(chain.begin() + static_cast<std::ptrdiff_t>(from),
                          chain.begin() + static_cast<std::ptrdiff_t>(to) + 1);
      best.spacing = median;
      break;
    }
  }
  return best;
}

}  // namespace

std::vector<ParallelSet> find_parallel_sets(const std::vector<VerticalSurface>& verticals) {
  const std::vector<std::uint32_t> next = next_risers(verticals);
  std::vector<std::uint32_t> lowest_first(verticals.size());
  std::iota(lowest_first.begin(), lowest_first.end(), 0U);
  std::stable_sort(lowest_first.begin(), lowest_first.end(), [&](std::uint32_t a, std::uint32_t b) {
    return verticals[a].z_high < verticals[b].z_high;
  });
  std::vector<std::uint8_t> used(verticals.size(), 0);
  std::vector<ParallelSet> sets;
  for (const std::uint32_t lowest : lowest_first) {
    std::vector<std::uint32_t> chain;
    for (std::uint32_t i = lowest; i != kNoSurface && !used[i]; i = next[i]) {
      // A flight does not reverse its direction.
      if (chain.size() >= 2) {
        const auto middle = [&](std::uint32_t m) -> Eigen::Vector2d {
          return (verticals[m].start + verticals[m].end) / 2;
        };
        const Eigen::Vector2d before = middle(chain.back()) - middle(chain[chain.size() - 2]);
        if (before.dot(middle(i) - middle(chain.back())) <= 0) break;
      }
      chain.push_back(i);
    }
    ParallelSet set = equidistant(verticals, chain);
    if (set.members.size() < kMinMembers) continue;
    for (const std::uint32_t m : set.members) used[m] = 1;
    const VerticalSurface &first = verticals[set.members.front()], &last = verticals[set.members.back()];
    const Eigen::Vector2d d = (first.end - first.start).normalized();
    const Eigen::Vector2d normal(-d.y(), d.x());
    set.direction = normal.dot(last.start + last.end - first.start - first.end) > 0 ? normal : -normal;
    sets.push_back(std::move(set));
  }
  return sets;
}

}  // namespace parhelion::semantic
