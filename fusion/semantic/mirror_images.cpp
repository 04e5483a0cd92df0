#include "fusion/semantic/mirror_images.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "fusion/cloud/parallel.hpp"
#include "fusion/semantic/mirror_planes.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kUnmeasured = 0.34;  ///< of a strip of the plane: not measured

/// The longest stretch of the plane without points at the height of a body that ends at measured ones, m
/// along the plane.
std::pair<double, double> hole_of(const SampledSite& site, const MirrorPlane& plane, double floor) {
  constexpr double kReach = 6, kLow = 0.8, kHigh = 1.6;  // m; m over the floor
  std::pair<double, double> longest{0, 0};
  std::optional<double> begin;
  for (double s = -kReach; s < kReach; s += kMirrorCube) {
    if (measured_in(site, plane, s, s + kMirrorCube, floor + kLow, floor + kHigh) <=
        kUnmeasured * site.shared)
      continue;
    if (begin && s - *begin > longest.second - longest.first) longest = {*begin, s};
    begin = s + kMirrorCube;
  }
  return longest;
}

/// Where its plane was measured around a mirror: m along the plane, and heights.
using Opening = Eigen::AlignedBox2d;

/// Of a hole, the heights that were not measured, from that of a body on.
Opening heights_of_hole(const SampledSite& site, const MirrorPlane& plane, double from, double to,
                        const VerticalSurface& surface) {
  constexpr double kMeasured = 0.6, kBody = 1.2;  // of a strip; m over the foot
  const auto is_measured = [&](double bottom, double top) {
    return measured_in(site, plane, from, to, bottom, top) > kMeasured * site.shared;
  };
  double low = surface.z_low + kBody, high = low;
  while (low > surface.z_low && !is_measured(low - kMirrorCube, low)) low -= kMirrorCube;
  while (high < surface.z_high && !is_measured(high, high + kMirrorCube)) high += kMirrorCube;
  return {Eigen::Vector2d(from, low), Eigen::Vector2d(to, high)};
}

/// Whether the plane was measured beside a hole at both sides, or over and under it: what only ends at the
/// plane, such as a wall across it, is narrower.
bool has_frame(const SampledSite& site, const MirrorPlane& plane, const Opening& hole,
               const VerticalSurface& surface) {
  constexpr double kWide = 0.3, kMeasured = 0.6;  // m; of a strip
  const auto is_measured = [&](double left, double right, double bottom, double top) {
    return measured_in(site, plane, left, right, bottom, top) > kMeasured * site.shared;
  };
  const double from = hole.min().x(), to = hole.max().x(), low = hole.min().y(), high = hole.max().y();
  if (high - low <= kMirrorCube) return false;
  if (is_measured(from - kWide, from, low, high) && is_measured(to, to + kWide, low, high)) return true;
  const double over = std::min(high + kWide, surface.z_high), under = std::max(low - kWide, surface.z_low);
  return over - high > kMirrorCube && low - under > kMirrorCube && is_measured(from, to, high, over) &&
         is_measured(from, to, under, low);
}

/// Whether what is around an opening is what a mirror hangs on. Doorways reach the floor, and the face of a
/// screen or of a partition with panes is half its thickness before the plane about which two rooms are
/// symmetric: glass lies on its wall, or little behind its frame.
bool may_hold_mirror(const SampledSite& site, const MirrorPlane& plane, const Opening& hole,
                     const VerticalSurface& surface) {
  constexpr double kWide = 0.3, kNear = 0.1, kFoot = 0.1, kBefore = 0.005;  // m
  constexpr std::size_t kFewest = 10;
  if (hole.min().y() < surface.z_low + kFoot) return false;
  const Opening around(hole.min().array() - kWide, hole.max().array() + kWide);
  std::vector<double> depths;
  for (const SitePoint& thing : site.things) {
    const double depth = plane.depth_of(thing.p);
    if (std::abs(depth) > kNear) continue;
    const Eigen::Vector2d p(plane.along().dot(thing.p.head<2>() - plane.at), thing.p.z());
    if (around.contains(p) && !hole.contains(p)) depths.push_back(depth);
  }
  return depths.size() >= kFewest && quantile(depths, 0.5) > -kBefore;
}

/// Where the ray that measured a thing crosses the plane, m along it and height; nullopt: nowhere, or where
/// it was measured.
std::optional<Eigen::Vector2d> seen_through(const SampledSite& site, const MirrorPlane& plane,
                                            const SitePoint& thing) {
  const auto at = crossing(site, plane, thing);
  if (!at || measured_at(site, plane, *at)) return std::nullopt;
  return Eigen::Vector2d(plane.along().dot(at->head<2>() - plane.at), at->z());
}

/// The opening that most rays pass: what was not measured around the place that most of them pass, as far as
/// they pass.
Opening opening_of(const SampledSite& site, const MirrorPlane& plane,
                   const std::vector<Eigen::Vector2d>& crossed) {
  constexpr double kCell = 2 * kMirrorCube;
  std::map<std::pair<int, int>, int> counts;
  for (const Eigen::Vector2d& at : crossed)
    ++counts[{static_cast<int>(std::floor(at.x() / kCell)), static_cast<int>(std::floor(at.y() / kCell))}];
  Opening bounds;
  for (const SitePoint& p : site.samples) {  // floor and ceiling, too
    if (plane.depth_of(p.p) < kNearestImage || plane.depth_of(p.p) > kFarthestImage) continue;
    if (const auto at = seen_through(site, plane, p)) bounds.extend(*at);
  }
  const auto densest = std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) {
                         return a.second < b.second;
                       })->first;
  const Eigen::Vector2d corner(densest.first * kCell, densest.second * kCell);
  Opening opening(corner, corner.array() + kCell);
  for (bool wider = true; wider;) {
    wider = false;
    for (const int axis : {0, 1}) {
      for (const bool up : {false, true}) {
        double& edge = up ? opening.max()[axis] : opening.min()[axis];
        if (up ? edge >= bounds.max()[axis] : edge <= bounds.min()[axis]) continue;
        Opening strip = opening;
        (up ? strip.min() : strip.max())[axis] = edge;
        (up ? strip.max() : strip.min())[axis] = edge + (up ? kMirrorCube : -kMirrorCube);
        if (measured_in(site, plane, strip.min().x(), strip.max().x(), strip.min().y(), strip.max().y()) >
            kUnmeasured * site.shared)
          continue;
        edge += up ? kMirrorCube : -kMirrorCube;
        wider = true;
      }
    }
  }
  return opening;
}

/// Heights of the floor and the ceiling before a mirror: level surfaces under and over a body there that
/// cover half of the plan; nullopt: they were not measured.
std::optional<std::pair<double, double>> heights_of_room(const SampledSite& site, const MirrorPlane& plane,
                                                         double from, double to, double body) {
  constexpr double kNear = 0.2, kFar = 3, kBeside = 1, kCell = 0.3, kLayer = 0.1,
                   kCovered = 0.5;  // m; of all
  using Cell = std::pair<int, int>;
  std::map<int, std::set<Cell>> layers;
  std::set<Cell> all;
  for (const SitePoint& p : site.samples) {
    const double before = -plane.depth_of(p.p), along = plane.along().dot(p.p.head<2>() - plane.at);
    if (before < kNear || before > kFar || along < from - kBeside || along > to + kBeside) continue;
    const Cell cell(static_cast<int>(before / kCell), static_cast<int>(std::floor(along / kCell)));
    all.insert(cell);
    if (p.surface == kNoSurface || p.surface < site.segmentation.verticals.size()) continue;
    const int layer = static_cast<int>(std::floor((p.p.z() - body) / kLayer));
    layers[layer].insert(cell), layers[layer + 1].insert(cell);
  }
  std::optional<double> floor, ceiling;
  for (const auto& [layer, cells] : layers) {
    if (static_cast<double>(cells.size()) < kCovered * static_cast<double>(all.size())) continue;
    if (layer <= 0) floor = body + (layer - 1) * kLayer;
    if (layer > 0 && !ceiling) ceiling = body + (layer + 1) * kLayer;
  }
  return floor && ceiling ? std::optional(std::pair(*floor, *ceiling)) : std::nullopt;
}

/// Not all of a room is seen in its mirror, and that from farther away; but all that is seen there is in the
/// room. Rooms that were built and scanned alike show as much on both sides.
bool is_part_of_room(const SampledSite& site, const MirrorPlane& plane, std::size_t things, double alike,
                     const Eigen::Vector2d& middle) {
  constexpr double kSure = 0.9, kMore = 0.05;  // fractions
  const MirrorPlane back{plane.at, -plane.behind};
  const std::vector<const SitePoint*> room = things_behind(site, back, middle, 1);
  return alike > kSure && alike > fraction_alike(site, back, room) + kMore && 2 * things < room.size();
}

/// A few things tell for most planes that nothing is behind them, or other things than before them.
bool may_be_mirror(const SampledSite& site, const MirrorPlane& plane) {
  constexpr std::size_t kFew = 10, kStride = 16;
  constexpr double kMaybeByRays = 0.1, kMaybe = 0.25, kOff = 0.03;  // of the things; m
  // Rays may pass other openings, too.
  std::vector<const SitePoint*> some = things_behind(site, plane, plane.at, kStride);
  if (site.rays)
    std::erase_if(some, [&](const SitePoint* thing) { return !seen_through(site, plane, *thing); });
  if (some.size() < kFew) return false;
  const auto alike = [&](double shift) { return fraction_alike(site, plane, some, shift); };
  return std::max({alike(-kOff), alike(0), alike(kOff)}) > (site.rays ? kMaybeByRays : kMaybe);
}

/// Whether so much is alike only about this very plane, and at several depths. A single wall that stands as
/// far behind as another one before is none.
bool are_images(const SampledSite& site, const MirrorPlane& plane,
                const std::vector<const SitePoint*>& things, double alike) {
  constexpr double kAlike = 0.85, kByChance = 0.5, kOfLayers = 0.7;  // fractions
  constexpr int kFewest = 3;
  constexpr std::array<double, 6> kShifts = {-0.5, -0.35, -0.2, 0.2, 0.35, 0.5};  // m
  if (alike < kAlike) return false;
  double by_chance = 0;
  for (const double shift : kShifts)
    by_chance += fraction_alike(site, plane, things, shift) / static_cast<double>(kShifts.size());
  const ImageLayers layers = image_layers(site, plane, things);
  return by_chance < kByChance * alike && layers.alike >= kFewest && layers.alike >= kOfLayers * layers.all;
}

/// Whether the rays to images come from before the plane, and did not meet it.
bool are_seen_through(const SampledSite& site, const MirrorPlane& plane,
                      const std::vector<const SitePoint*>& things) {
  constexpr double kThrough = 0.9;  // of the rays
  std::size_t all = 0, through = 0;
  for (const SitePoint* thing : things) {
    if (!has_image(site, plane, *thing)) continue;
    ++all, through += seen_through(site, plane, *thing) ? 1 : 0;
  }
  return static_cast<double>(through) >= kThrough * static_cast<double>(all);
}

/// A mirror about the plane that fits the things best, with where its images end; nullopt: they are none.
/// Its opening is not set.
std::optional<Mirror> mirror_of(const SampledSite& site, const MirrorPlane& plane,
                                const std::vector<const SitePoint*>& things) {
  constexpr double kEnds = 0.01, kOff = 0.025;  // quantile; m
  const MirrorPlane fit = fitted(site, plane, things);
  Mirror mirror;
  mirror.at = fit.at, mirror.behind = fit.behind;
  mirror.alike = fraction_alike(site, fit, things);
  if (std::abs(plane.behind.dot(fit.at - plane.at)) > kOff || !are_images(site, fit, things, mirror.alike))
    return std::nullopt;
  std::vector<double> depths, places;
  for (const SitePoint* thing : things) {
    if (!has_image(site, fit, *thing)) continue;
    depths.push_back(fit.depth_of(thing->p));
    places.push_back(fit.along().dot(thing->p.head<2>() - fit.at));
  }
  std::tie(mirror.images_from, mirror.images_to) = quantile_range(places, kEnds, 1 - kEnds);
  mirror.depth = quantile(depths, 1 - kEnds);
  mirror.rays = site.rays;
  return mirror;
}

/// Sets a mirror's opening, and whether it is certain.
void set_opening(const SampledSite& site, const Opening& opening, const VerticalSurface& surface,
                 std::size_t things, const Eigen::Vector2d& middle, Mirror& mirror) {
  constexpr double kDense = 0.6;  // of the things in cubes with other points: else too little is alike
  const MirrorPlane plane{mirror.at, mirror.behind};
  mirror.from = opening.min().x(), mirror.to = opening.max().x();
  mirror.low = opening.min().y(), mirror.high = opening.max().y();
  mirror.certain = site.shared >= kDense && has_frame(site, plane, opening, surface) &&
                   may_hold_mirror(site, plane, opening, surface) &&
                   is_part_of_room(site, plane, things, mirror.alike, middle);
}

constexpr std::size_t kFewestThings = 150;
constexpr double kNarrowest = 0.4;  ///< m

/// By what was seen through each of up to three openings.
void add_mirrors_by_rays(const SampledSite& site, const VerticalSurface& surface, const MirrorPlane& plane,
                         std::vector<Mirror>& mirrors) {
  constexpr int kMaxOpenings = 3;
  const std::vector<const SitePoint*> all = things_behind(site, plane, plane.at, 1);
  std::vector<const SitePoint*> left = all;
  for (int k = 0; k < kMaxOpenings; ++k) {
    std::vector<Eigen::Vector2d> crossed;
    std::vector<const SitePoint*> through, other, things;
    for (const SitePoint* thing : left) {
      const auto at = seen_through(site, plane, *thing);
      if (at) crossed.push_back(*at), through.push_back(thing);
    }
    if (crossed.size() < kFewestThings) return;
    const Opening opening = opening_of(site, plane, crossed);
    for (std::size_t i = 0; i < through.size(); ++i)
      (opening.contains(crossed[i]) ? things : other).push_back(through[i]);
    left = std::move(other);
    if (things.size() < kFewestThings || opening.sizes().x() <= kNarrowest) continue;
    auto mirror = mirror_of(site, plane, things);
    if (!mirror || !are_seen_through(site, {mirror->at, mirror->behind}, all)) continue;
    set_opening(site, opening, surface, things.size(), plane.at, *mirror);
    mirrors.push_back(*mirror);
  }
}

/// By the hole in the plane alone.
void add_mirror_by_hole(const SampledSite& site, const VerticalSurface& surface, const MirrorPlane& plane,
                        std::vector<Mirror>& mirrors) {
  constexpr int kFewestLayers = 4;
  const std::vector<const SitePoint*> things = things_behind(site, plane, plane.at, 1);
  if (things.size() < kFewestThings) return;
  auto mirror = mirror_of(site, plane, things);
  if (!mirror) return;
  const MirrorPlane fit{mirror->at, mirror->behind};
  const auto [from, to] = hole_of(site, fit, surface.z_low);
  const Opening hole = heights_of_hole(site, fit, from, to, surface);
  if (to - from <= kNarrowest || image_layers(site, fit, things).alike < kFewestLayers ||
      !has_frame(site, fit, hole, surface))
    return;
  set_opening(site, hole, surface, things.size(), plane.at, *mirror);
  const auto heights = heights_of_room(site, fit, from, to, 0.5 * (mirror->low + mirror->high));
  if (heights) std::tie(mirror->floor, mirror->ceiling) = *heights;
  mirror->certain = mirror->certain && heights;
  mirrors.push_back(*mirror);
}

void add_mirrors_in(const SampledSite& site, const VerticalSurface& surface, double side,
                    std::vector<Mirror>& mirrors) {
  const Eigen::Vector2d d = (surface.end - surface.start).normalized();
  const MirrorPlane plane{0.5 * (surface.start + surface.end), side * Eigen::Vector2d(d.y(), -d.x())};
  if (!may_be_mirror(site, plane)) return;
  if (site.rays)
    add_mirrors_by_rays(site, surface, plane, mirrors);
  else
    add_mirror_by_hole(site, surface, plane, mirrors);
}

bool is_better(const Mirror& a, const Mirror& b) {
  return std::pair(a.certain, a.alike) > std::pair(b.certain, b.alike);
}

/// Whether both are in one plane, whatever the side, and their openings overlap.
bool is_same(const Mirror& a, const Mirror& b) {
  constexpr double kNear = 0.15;  // m
  const auto end_of_b = [&](double along) { return Eigen::Vector2d(b.at + along * b.along()); };
  const Eigen::Vector2d p = end_of_b(b.from), q = end_of_b(b.to);
  if (std::abs(a.depth_of(p)) > kNear || std::abs(a.depth_of(q)) > kNear) return false;
  const auto [first, last] = std::minmax({a.along().dot(p - a.at), a.along().dot(q - a.at)});
  return first < a.to && last > a.from && b.low < a.high && b.high > a.low;
}

/// Whether a certain mirror in the surface's plane was found by what is up to 15 m beside the surface.
bool is_examined(const Mirror& mirror, const VerticalSurface& surface) {
  constexpr double kNear = 0.15;  // m
  const Eigen::Vector2d middle = 0.5 * (surface.start + surface.end);
  return mirror.certain && std::abs(mirror.depth_of(surface.start)) < kNear &&
         std::abs(mirror.depth_of(surface.end)) < kNear &&
         std::abs(mirror.along().dot(middle - mirror.at)) + 0.5 * (surface.end - surface.start).norm() <
             kFarthestImage;
}

}  // namespace

bool Mirror::has_image_at(const Eigen::Vector2d& p) const {
  constexpr double kMargin = 0.3;  // m
  const double behind_it = depth_of(p), beside = along().dot(p - at);
  return behind_it > 0 && behind_it < depth + kMargin && beside > images_from - kMargin &&
         beside < images_to + kMargin;
}

std::vector<Mirror> find_mirrors(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation) {
  std::vector<Mirror> mirrors;
  const SampledSite site = sampled_site(cloud, segmentation);
  // All at once, though few are not asked for in the end: beside a certain mirror.
  std::vector<std::vector<Mirror>> of_surface(segmentation.verticals.size());
  cloud::for_each_chunk(of_surface.size(), 1, 0, [&](std::size_t k, std::size_t, std::size_t) {
    if (segmentation.verticals[k].curve != kNoCurve) return;
    for (const double side : {1.0, -1.0})
      add_mirrors_in(site, segmentation.verticals[k], side, of_surface[k]);
  });
  for (std::size_t k = 0; k < of_surface.size(); ++k) {
    const VerticalSurface& surface = segmentation.verticals[k];
    const bool known = std::any_of(mirrors.begin(), mirrors.end(),
                                   [&](const Mirror& mirror) { return is_examined(mirror, surface); });
    if (known) continue;
    for (const Mirror& mirror : of_surface[k]) {
      const auto same = std::find_if(mirrors.begin(), mirrors.end(),
                                     [&](const Mirror& other) { return is_same(other, mirror); });
      if (same == mirrors.end())
        mirrors.push_back(mirror);
      else if (is_better(mirror, *same))
        *same = mirror;
    }
  }
  return mirrors;
}

namespace {

/// Whether a point was measured through a mirror.
bool was_seen_in(const Mirror& mirror, const cloud::PointCloud<Map>& cloud, std::size_t i) {
  constexpr double kMargin = 0.06;  // m
  const std::size_t viewpoint = cloud.scans[i];
  if (viewpoint >= cloud.viewpoints.size()) return false;
  const Eigen::Vector3d &from = cloud.viewpoints[viewpoint], p = cloud.points[i].cast<double>();
  const double before = mirror.depth_of(from.head<2>()), after = mirror.depth_of(p.head<2>());
  if (before >= 0 || after <= 0) return false;
  const Eigen::Vector3d at = from + before / (before - after) * (p - from);
  const double along = mirror.along().dot(at.head<2>() - mirror.at);
  return along > mirror.from - kMargin && along < mirror.to + kMargin && at.z() > mirror.low - kMargin &&
         at.z() < mirror.high + kMargin;
}

/// The cubes before a mirror in which its images would be.
OccupiedCubes cubes_before(const Mirror& mirror, const cloud::PointCloud<Map>& cloud) {
  constexpr double kMargin = 0.5;  // m
  OccupiedCubes cubes;
  for (const Eigen::Vector3f& point : cloud.points) {
    const Eigen::Vector3d p = point.cast<double>();
    const double before = -mirror.depth_of(p.head<2>());
    if (before > 0 && before < mirror.depth + kMargin)
      cubes.add(mirror_cube(p, cloud.points.front().cast<double>()));
  }
  return cubes;
}

bool has_points_about(const OccupiedCubes& cubes, const Eigen::Array3i& cube) {
  for (int k = 0; k < 27; ++k) {
    if (cubes.contains(cube + Eigen::Array3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1))) return true;
  }
  return false;
}

}  // namespace

std::vector<bool> seen_in_mirrors(const cloud::PointCloud<Map>& cloud, const std::vector<Mirror>& mirrors) {
  constexpr double kBehind = 0.03, kOtherFace = 0.15, kMargin = 0.3;  // m
  std::vector<bool> images;
  for (const Mirror& mirror : mirrors) {
    if (!mirror.certain) continue;
    images.resize(cloud.size());
    const OccupiedCubes cubes = cubes_before(mirror, cloud);
    const MirrorPlane plane{mirror.at, mirror.behind};
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const Eigen::Vector3d p = cloud.points[i].cast<double>();
      const double depth = plane.depth_of(p);
      // Without rays the other face of the wall is no image.
      if (images[i] || depth < (mirror.rays ? kBehind : kOtherFace) || depth > mirror.depth + kMargin)
        continue;
      const bool seen = mirror.rays
                            ? was_seen_in(mirror, cloud, i)
                            : mirror.has_image_at(p.head<2>()) && p.z() > mirror.floor - kMirrorCube &&
                                  p.z() < mirror.ceiling + kMirrorCube;
      images[i] = seen && has_points_about(
                              cubes, mirror_cube(plane.image_of(p), cloud.points.front().cast<double>()));
    }
  }
  return images;
}

}  // namespace parhelion::semantic
