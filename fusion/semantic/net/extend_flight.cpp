// The levels adjacent to a flight's ends that are no surfaces of their own: a narrow strip before the first
// riser, a half hidden tread.
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "fusion/semantic/net/find_stairs.hpp"
#include "fusion/semantic/net/flight_profile.hpp"
#include "fusion/semantic/net/flight_strip.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kCell = 0.05;      ///< m, of the plan beside the flight's end
constexpr double kReach = 0.6;      ///< m, search range beyond the end, where the treads' depth is unknown
constexpr double kOfTread = 0.8;    ///< of a tread's depth: the same range, short of the next riser
constexpr double kInto = 0.05;      ///< m, overlap with the end's own strip: edges are not sharp
constexpr double kOff = 0.03;       ///< m, the next rise may differ from the flight's median
constexpr double kSkin = 0.03;      ///< m, thickness of a cell's outermost layer, noise included
constexpr double kWindow = 0.03;    ///< m, tolerance of the heights of one level
constexpr double kAcross = 0.5;     ///< minimum fraction of the flight's width on which it is seen...
constexpr double kAcrossFew = 0.3;  ///< ...or this, where a scan's lines are farther apart than cells
constexpr double kAgree = 0.3;      ///< minimum fraction of the cells there: less is a slope
constexpr std::size_t kMinPoints = 50;  ///< points...
constexpr std::size_t kMinFew =
    12;  ///< ...or this, of a flight of four rises that they continue upwards to 1.5 cm
constexpr std::size_t kSureRises = 4;
constexpr double kOffFew = 0.015;  ///< m
constexpr std::size_t kMaxSteps = 60;

struct Seen {
  double s, height;  ///< m; height relative to the end's tread, onwards
  std::uint32_t surface;
};

/// Points beyond the end, by cell of the plan. `height` is up for the upper end, down for the lower one.
using Cells = std::map<std::pair<int, int>, std::vector<Seen>>;

/// m, depth of the flight's treads; nullopt: fewer than two are known.
std::optional<double> depth_of(const Flight& flight) {
  std::vector<double> treads = flight.treads();
  return treads.size() < 2 ? std::nullopt : std::optional(std::max(0.15, median(treads)));
}

Cells cells_beside(const StripPoints& points, const Segmentation& segmentation, const Flight& flight,
                   const Step& end, bool below, double rise) {
  const Eigen::Vector2d across(-flight.direction.y(), flight.direction.x());
  const double edge = below ? end.near : end.far, outwards = below ? -1 : 1;
  Cells cells;
  const auto depth = depth_of(flight);
  const double reach = depth && !below ? std::max(0.2, kOfTread * *depth) : kReach;
  const double from = edge - outwards * kInto, to = edge + outwards * reach;
  points.for_each_on(flight.direction, {from, to, end.left, end.right}, [&](std::uint32_t i) {
    const Eigen::Vector3f& point = points.sorted()[i];
    const double height = outwards * (point.z() - end.z);
    if (height < 0.3 * rise || height > 1.6 * rise) return;
    const Eigen::Vector2d p = point.head<2>().cast<double>();
    const double s = flight.direction.dot(p), t = across.dot(p), beyond = outwards * (s - edge);
    if (t < end.left || t > end.right || beyond < -kInto || beyond > reach) return;
    cells[{static_cast<int>((t - end.left) / kCell), static_cast<int>((beyond + kInto) / kCell)}].push_back(
        {s, height, segmentation.surface_of[points.order()[i]]});
  });
  return cells;
}

/// Height of a cell's outermost points: the lower edge of a riser, or the level itself. A riser higher than
/// one rise has them elsewhere.
double outermost(std::vector<Seen>& seen) {
  const double largest = std::max_element(seen.begin(), seen.end(), [](const Seen& a, const Seen& b) {
                           return a.height < b.height;
                         })->height;
  std::erase_if(seen, [&](const Seen& point) { return point.height < largest - kSkin; });
  std::vector<double> heights;
  for (const Seen& point : seen) heights.push_back(point.height);
  return median(heights);
}

/// The centre of the fullest window of heights around one more rise.
std::optional<double> fullest_window(std::vector<double> heights, double rise) {
  std::sort(heights.begin(), heights.end());
  std::size_t begin = 0, largest = 0;
  double middle = 0;
  for (std::size_t end = 0; end < heights.size(); ++end) {
    while (heights[end] - heights[begin] > kWindow) ++begin;
    const double centre = 0.5 * (heights[begin] + heights[end]);
    if (end + 1 - begin > largest && std::abs(centre - rise) < kOff) {
      largest = end + 1 - begin;
      middle = centre;
    }
  }
  return largest > 0 ? std::optional(middle) : std::nullopt;
}

/// The surface of the majority of these points, if there is one.
std::uint32_t main_surface(const std::map<std::uint32_t, std::size_t>& count, std::size_t total,
                           std::size_t verticals) {
  for (const auto& [surface, points] : count) {
    if (surface != kNoSurface && surface >= verticals && 2 * points > total)
      return static_cast<std::uint32_t>(surface - verticals);
  }
  return kNoSurface;
}

/// The level that continues the series beyond one end: across the flight's width, level, one rise further.
std::optional<Step> next_level(const StripPoints& points, const Segmentation& segmentation,
                               const Flight& flight, bool below) {
  const double rise = median(flight.rises());
  const Step& end = below ? flight.steps.front() : flight.steps.back();
  Cells cells = cells_beside(points, segmentation, flight, end, below, rise);
  std::vector<double> heights;
  for (auto& [place, seen] : cells) heights.push_back(outermost(seen));
  const auto middle = fullest_window(heights, rise);
  if (!middle) return std::nullopt;
  std::vector<double> agreeing, along;
  std::vector<bool> across(static_cast<std::size_t>((end.right - end.left) / kCell) + 1);
  std::map<std::uint32_t, std::size_t> surfaces;
  std::size_t agree = 0, k = 0;
  for (const auto& [place, seen] : cells) {
    if (std::abs(heights[k++] - *middle) > kWindow / 2 + 1e-9) continue;
    ++agree;
    across[static_cast<std::size_t>(place.first)] = true;
    for (const Seen& point : seen) {
      agreeing.push_back(point.height), along.push_back(point.s);
      ++surfaces[point.surface];
    }
  }
  const auto wide = static_cast<double>(std::count(across.begin(), across.end(), true));
  const bool few = !below && flight.steps.size() > kSureRises && std::abs(*middle - rise) < kOffFew;
  if (agreeing.size() < (few ? kMinFew : kMinPoints) ||
      wide < (few ? kAcrossFew : kAcross) * static_cast<double>(across.size()) ||
      static_cast<double>(agree) < kAgree * static_cast<double>(cells.size()))
    return std::nullopt;
  const double z = end.z + (below ? -1 : 1) * median(agreeing);
  return Step{main_surface(surfaces, agreeing.size(), segmentation.verticals.size()),
              z,
              quantile(along, 0.05),
              quantile(along, 0.95),
              end.left,
              end.right};
}

/// m along the flight, where the next riser stands beyond a landing at its upper end: the first place with
/// points of its lower half over a third of the width.
std::optional<double> riser_beyond_landing(const StripPoints& points, const Flight& flight) {
  constexpr double kLongest = 2.5, kBin = 0.05;  // m
  const Step& end = flight.steps.back();
  const double rise = median(flight.rises());
  const Eigen::Vector2d across(-flight.direction.y(), flight.direction.x());
  std::map<int, std::pair<std::size_t, std::vector<bool>>> bins;
  const auto wide = static_cast<std::size_t>((end.right - end.left) / kCell) + 1;
  points.for_each_on(
      flight.direction, {end.far, end.far + kLongest, end.left, end.right}, [&](std::uint32_t i) {
        const Eigen::Vector3f& point = points.sorted()[i];
        const double over = (static_cast<double>(point.z()) - end.z) / rise;
        const Eigen::Vector2d p = point.head<2>().cast<double>();
        const double s = flight.direction.dot(p) - end.far, t = across.dot(p) - end.left;
        if (over < 0.3 || over > 0.8 || s < 0.3 || s > kLongest || t < 0 || t > end.right - end.left) return;
        auto& bin = bins[static_cast<int>(s / kBin)];
        ++bin.first;
        bin.second.resize(wide);
        bin.second[static_cast<std::size_t>(t / kCell)] = true;
      });
  for (const auto& [bin, seen] : bins) {
    const auto columns = static_cast<double>(std::count(seen.second.begin(), seen.second.end(), true));
    if (seen.first >= kMinFew && columns >= kAcrossFew * static_cast<double>(wide))
      return end.far + (bin + 0.5) * kBin;
  }
  return std::nullopt;
}

/// The next level behind a landing at the flight's upper end; the landing's own step reaches up to it.
std::optional<Step> beyond_landing(const StepPoints& points, Flight& flight) {
  if (flight.steps.size() <= kSureRises) return std::nullopt;
  const auto riser = riser_beyond_landing(points.strips, flight);
  if (!riser || !may_have_landing(points, flight, *riser)) return std::nullopt;
  const double before = std::exchange(flight.steps.back().far, *riser);
  const auto step = next_level(points.strips, points.segmentation, flight, false);
  if (!step) flight.steps.back().far = before;
  return step;
}

}  // namespace

std::vector<std::vector<Eigen::Vector2d>> points_on_steps(const StripPoints& points, const Flight& flight,
                                                          double band) {
  constexpr double kEdge = 0.04;  // m
  const Eigen::Vector2d across(-flight.direction.y(), flight.direction.x());
  std::vector<std::vector<Eigen::Vector2d>> treads(flight.steps.size());
  Strip all{flight.steps.front().near, flight.steps.front().far, flight.steps.front().left,
            flight.steps.front().right};
  for (const Step& step : flight.steps) {
    all = {std::min(all.from, step.near), std::max(all.to, step.far), std::min(all.left, step.left),
           std::max(all.right, step.right)};
  }
  points.for_each_on(flight.direction, all, [&](std::uint32_t k) {
    const Eigen::Vector3f& point = points.sorted()[k];
    const double z = point.z();
    if (z < flight.steps.front().z - band || z > flight.steps.back().z + band) return;
    const Eigen::Vector2d p = point.head<2>().cast<double>();
    const double s = flight.direction.dot(p), t = across.dot(p);
    for (std::size_t i = 0; i < flight.steps.size(); ++i) {
      const Step& step = flight.steps[i];
      // A riser is located where the next tread begins.
      const double begin = i > 0 ? 0.5 * (flight.steps[i - 1].far + step.near) + kEdge : step.near;
      const double end =
          i + 1 < flight.steps.size() ? 0.5 * (step.far + flight.steps[i + 1].near) - kEdge : step.far;
      if (s > begin && s < end && t > step.left && t < step.right && std::abs(z - step.z) < band)
        treads[i].emplace_back(s, z);
    }
  });
  return treads;
}

void refine_heights(const StripPoints& points, const Segmentation& segmentation, Flight& flight) {
  constexpr double kThick = 0.03, kBand = 0.06;  // m, thickness above which a surface contains a riser
  constexpr std::size_t kEnough = 15;            // points
  const std::vector<std::vector<Eigen::Vector2d>> treads = points_on_steps(points, flight, kBand);
  for (std::size_t i = 0; i < flight.steps.size(); ++i) {
    const std::uint32_t surface = flight.steps[i].horizontal;
    if (surface != kNoSurface && segmentation.horizontals[surface].thickness < kThick) continue;
    if (treads[i].size() < kEnough) continue;
    std::vector<double> heights;
    for (const Eigen::Vector2d& p : treads[i]) heights.push_back(p.y());
    flight.steps[i].z = median(heights);
  }
}

void extend(const StepPoints& points, Flight& flight) {
  for (const bool below : {true, false}) {
    while (flight.steps.size() < kMaxSteps) {
      auto step = next_level(points.strips, points.segmentation, flight, below);
      if (!step && !below) step = beyond_landing(points, flight);
      if (!step) step = next_on_profile(points, flight, below);
      if (!step) break;
      flight.steps.insert(below ? flight.steps.begin() : flight.steps.end(), *step);
      Step& added = below ? flight.steps.front() : flight.steps.back();
      const auto depth = depth_of(flight);
      // Only its riser was seen, from below.
      if (!below && depth && added.far - added.near < 0.5 * *depth) added.far = added.near + *depth;
    }
  }
}

}  // namespace parhelion::semantic
