#include "fusion/semantic/upside_down.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <optional>
#include <sstream>

#include "fusion/semantic/standing_things.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kClearly = 1.5;  // octaves, of standing_evidence: three times

/// Ratio of hanging to standing points above which a cloud counts as upside down. Scanners usually stand low,
/// so viewpoints in the upper half of the room lower the ratio.
double needed_fraction(const std::vector<Eigen::Vector3d>& viewpoints, const Eigen::Vector3d& up, double low,
                       double high) {
  if (viewpoints.empty()) return 1.5;
  double sum = 0;
  for (const Eigen::Vector3d& viewpoint : viewpoints) sum += (viewpoint.dot(up) - low) / (high - low);
  const double height = sum / static_cast<double>(viewpoints.size());
  return height < 0.45 ? 2 : height > 0.55 ? 1.2 : 1.5;
}

/// Things stand on floors and few hang from ceilings: the evidence for an upside-down cloud, or nothing.
/// Beams, ducts and lamps are up to 0.4 m high, seats and beds begin there; a lowered ceiling is no thing.
std::string what_hangs(const std::vector<PlanePatch>& patches, const std::vector<Eigen::Vector3d>& viewpoints,
                       const Eigen::Vector3d& up) {
  constexpr double beside = 0.2, beside_beams = 0.4;  // m
  const std::vector<PatchLayer> layers = layers_of(patches, up);
  if (layers.size() < 2) return "";
  const RoomHeights room = room_heights(layers);
  if (room.high - room.low < kLowestSpace) return "";
  const double needed = needed_fraction(viewpoints, up, room.low, room.high);
  const auto seems_flipped = [&](const ThingCounts& count) {
    return count.hanging >= 20 && count.hanging >= needed * count.standing;
  };
  const ThingCounts all = count_things(patches, {}, up, room, beside);
  if (!seems_flipped(all)) return "";
  const ThingCounts things =
      count_things(patches, in_long_surfaces(patches, up, room), up, room, beside_beams);
  if (!seems_flipped(things)) return "";
  std::ostringstream words;
  words << "the cloud seems to be upside down: " << all.hanging << " patches close below its top, "
        << all.standing << " close above its bottom; expected fewer at the top: give the up direction";
  return words.str();
}

/// How far level patches lie in a few thin layers, and how far apart the outermost planar patches are.
struct Layering {
  double in_layers = 0;  // sum of the squares of the numbers of patches
  double extent = 0;     // m
};

Layering layering_along(const std::vector<PlanePatch>& patches, const Eigen::Vector3d& axis) {
  constexpr double outliers = 0.02;
  Layering result;
  for (const PatchLayer& layer : layers_of(patches, axis)) result.in_layers += std::pow(layer.patches, 2);
  std::vector<double> places;
  for (const PlanePatch& patch : patches) {
    if (patch.planar) places.push_back(patch.mean.dot(axis));
  }
  if (places.empty()) return result;
  const auto [low, high] = quantile_range(places, outliers, 1 - outliers);
  result.extent = high - low;
  return result;
}

/// The direction perpendicular to `up` to which, or to its own perpendicular, the most upright patches are
/// normal; zero where there are few.
Eigen::Vector3d dominant_upright(const std::vector<PlanePatch>& patches, const Eigen::Vector3d& up) {
  constexpr int bins = 90, window = 4;  // of a degree
  const Eigen::Vector3d east = up.unitOrthogonal(), north = up.cross(east);
  std::vector<double> angles;  // degrees, modulo a right angle
  std::vector<int> count(bins);
  for (const PlanePatch& patch : patches) {
    if (!is_upright(patch, up)) continue;
    const double angle = std::atan2(patch.normal.dot(north), patch.normal.dot(east)) / kRadiansPerDegree;
    angles.push_back(angle - bins * std::floor(angle / bins));
    ++count[static_cast<std::size_t>(angles.back()) % bins];
  }
  if (angles.size() < 8) return Eigen::Vector3d::Zero();
  int best = 0, max_votes = 0;
  for (int bin = 0; bin < bins; ++bin) {
    int votes = 0;
    for (int k = -window; k <= window; ++k) votes += count[static_cast<std::size_t>((bin + k + bins) % bins)];
    if (votes > max_votes) best = bin, max_votes = votes;
  }
  double sum = 0;
  int used = 0;
  for (const double angle : angles) {
    const double off = std::remainder(angle - best - 0.5, bins);
    if (std::abs(off) <= window + 0.5) sum += off, ++used;
  }
  const double turn = (best + 0.5 + sum / used) * kRadiansPerDegree;
  return std::cos(turn) * east + std::sin(turn) * north;
}

/// The direction that is up if the cloud lies on its side with `up`: a building is layered by its storeys
/// more than by its walls, is lower than wide, and things stand on its floors. A stairwell, which is higher
/// than wide, has walls as wide as floors, but nothing stands on them.
std::optional<Eigen::Vector3d> up_if_on_side(const std::vector<PlanePatch>& patches,
                                             const Eigen::Vector3d& up) {
  constexpr double clearly = 1.5, lower = 0.5, sure = 2;  // octaves
  constexpr double few = 100;                             // the square of ten patches
  const Eigen::Vector3d along = dominant_upright(patches, up);
  if (along.isZero()) return std::nullopt;
  const Eigen::Vector3d across = up.cross(along);
  const Layering own = layering_along(patches, up), first = layering_along(patches, along),
                 second = layering_along(patches, across);
  const bool is_first = first.in_layers > second.in_layers;
  const Layering& other = is_first ? first : second;
  if (std::log2((other.in_layers + few) / (own.in_layers + few)) < clearly ||
      std::log2(own.extent / std::max(other.extent, kPatchSide)) < lower)
    return std::nullopt;
  const Eigen::Vector3d axis = is_first ? along : across;
  const double evidence = standing_evidence(patches, axis);
  if (std::abs(evidence) < sure) return std::nullopt;
  return evidence > 0 ? axis : -axis;
}

std::string with_axis_upwards(const Eigen::Vector3d& up) {
  Eigen::Index axis = 0;
  up.cwiseAbs().maxCoeff(&axis);
  return std::string("with its ") + (up[axis] < 0 ? "-" : "") + "xyz"[axis] + " axis upwards";
}

}  // namespace

bool has_y_upwards(const cloud::PointCloud<Cloud>& cloud) {
  constexpr std::size_t kFewest = 2;                              // scanners
  constexpr double kBeside = 1.5, kSame = 0.2, kDifferent = 0.7;  // m
  constexpr double kLowest = 0.3, kHighest = 2.5;                 // m, of a scanner over its floor
  constexpr std::size_t kMaxPoints = 300'000, kMaxViewpoints = 50;
  if (cloud.viewpoints.size() < kFewest) return false;
  std::vector<Eigen::Vector3f> points;
  const std::size_t stride = 1 + cloud.size() / kMaxPoints;
  for (std::size_t i = 0; i < cloud.size(); i += stride) points.push_back(cloud.points[i]);
  std::array<std::vector<double>, 2> heights;  // along y, along z
  const auto spread = [&](std::size_t axis) {
    return std::minmax_element(heights[axis].begin(), heights[axis].end());
  };
  const std::size_t next = 1 + cloud.viewpoints.size() / kMaxViewpoints;
  for (std::size_t v = 0; v < cloud.viewpoints.size(); v += next) {
    std::array<std::vector<double>, 2> below;
    for (const Eigen::Vector3f& p : points) {
      const double x = cloud.viewpoints[v].x() - static_cast<double>(p.x());
      if (!(std::abs(x) < kBeside)) continue;  // far along both axes: most points
      const double y = cloud.viewpoints[v].y() - static_cast<double>(p.y()),
                   z = cloud.viewpoints[v].z() - static_cast<double>(p.z());
      if (y > 0 && std::sqrt(x * x + z * z) < kBeside) below[0].push_back(y);
      // Along z only down to the storey's floor; what lies below that says nothing.
      if (z > 0 && z < kHighest && std::sqrt(x * x + y * y) < kBeside) below[1].push_back(z);
    }
    for (std::size_t axis = 0; axis < 2; ++axis) {
      if (below[axis].size() >= 20) heights[axis].push_back(quantile(below[axis], 0.95));
    }
    if (heights[0].empty()) continue;
    const auto [low, high] = spread(0);  // more scanners only widen it
    if (*low <= kLowest || *high >= kHighest || *high - *low >= kSame) return false;
  }
  if (heights[0].size() < kFewest || heights[1].size() < kFewest) return false;
  const auto [low, high] = spread(1);
  return *high - *low > kDifferent;
}

bool saw_overhead(const cloud::PointCloud<Cloud>& cloud, const Eigen::Vector3d& up) {
  constexpr double steep = 0.9, sideways = 0.3;  // sine of the angle to the level
  constexpr double seldom = 0.02, around = 0.1;  // of the steep rays; of all
  constexpr double enough = 100;                 // rays
  constexpr int sectors = 16, all_around = 14;   // of the horizon
  constexpr std::uint32_t everywhere = (1U << sectors) - 1;
  if (cloud.scans.empty() && cloud.viewpoints.size() > 1) return false;  // whose rays is not known
  struct View {
    double over = 0, under = 0, below = 0, all = 0;
    std::uint32_t seen = 0;  // a bit for each sector
  };
  std::vector<View> views(cloud.viewpoints.size());
  const Eigen::Vector3d east = up.unitOrthogonal(), north = up.cross(east);
  const std::size_t step = 1 + cloud.size() / 200'000;
  for (std::size_t i = 0; i < cloud.size(); i += step) {
    const std::size_t view = cloud.scans.empty() ? 0 : cloud.scans[i];
    if (view >= views.size()) continue;
    View& of_view = views[view];
    const Eigen::Vector3d ray = cloud.points[i].cast<double>() - cloud.viewpoints[view];
    const double sine = ray.dot(up) / std::max(ray.norm(), 1e-6);
    of_view.over += sine > steep, of_view.under += sine < -steep, of_view.below += sine < -sideways;
    of_view.all += 1;
    if (std::abs(sine) > steep || of_view.seen == everywhere) continue;
    const double turn = std::atan2(ray.dot(north), ray.dot(east)) / (2 * std::numbers::pi) + 0.5;
    of_view.seen |= 1U << std::min(static_cast<int>(turn * sectors), sectors - 1);
  }
  View sum;
  for (const View& view : views) {
    if (std::popcount(view.seen) < all_around) continue;
    sum.over += view.over, sum.under += view.under, sum.below += view.below, sum.all += view.all;
  }
  return sum.over > enough && sum.under < seldom * sum.over && sum.below > around * sum.all;
}

std::string why_upside_down(const cloud::PointCloud<Cloud>& cloud, const std::vector<PlanePatch>& patches,
                            const Eigen::Vector3d& up) {
  const std::string why = what_hangs(patches, cloud.viewpoints, up);
  // Ducts and lamps may be more than furniture, but few of them are level plates. Rays are looked at last:
  // there are far more of them than of patches.
  if (why.empty() || standing_evidence(patches, up) > kClearly || saw_overhead(cloud, up)) return "";
  const auto other = up_if_on_side(patches, up);
  return other
             ? "the cloud seems to lie on its side, " + with_axis_upwards(*other) + ": give the up direction"
             : why;
}

std::string doubt_of_up(const cloud::PointCloud<Cloud>& cloud, const std::vector<PlanePatch>& patches,
                        const Eigen::Vector3d& up) {
  if (const auto other = up_if_on_side(patches, up))
    return "the cloud may lie on its side, " + with_axis_upwards(*other);
  const double evidence = standing_evidence(patches, up);
  if (evidence < -kClearly && !saw_overhead(cloud, up))
    return "the cloud may be upside down: more hangs under its surfaces than stands on them";
  if (evidence <= 0 && saw_overhead(cloud, -up))
    return "the cloud may be upside down: its scanners saw nothing overhead and much steeply below them";
  return "";
}

}  // namespace parhelion::semantic
