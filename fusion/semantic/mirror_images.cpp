#include "fusion/semantic/mirror_images.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>
#include <utility>

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
    if (measured_in(site, plane, s, s + kMirrorCube, floor + kLow, floor + kHigh) <= kUnmeasured) continue;
    if (begin && s - *begin > longest.second - longest.first) longest = {*begin, s};
    begin = s + kMirrorCube;
  }
  return longest;
}

/// Whether the plane was measured beside a hole at both sides, or over and under it: what only ends at the
/// plane, such as a wall across it, is narrower.
bool has_frame(const SampledSite& site, const MirrorPlane& plane, double from, double to,
               const VerticalSurface& surface) {
  constexpr double kWide = 0.3, kMeasured = 0.6, kBody = 1.2;  // m; of a strip; m over the foot
  const auto is_measured = [&](double left, double right, double bottom, double top) {
    return measured_in(site, plane, left, right, bottom, top) > kMeasured * site.shared;
  };
  double low = surface.z_low + kBody, high = low;
  while (low > surface.z_low && !is_measured(from, to, low - kMirrorCube, low)) low -= kMirrorCube;
  while (high < surface.z_high && !is_measured(from, to, high, high + kMirrorCube)) high += kMirrorCube;
  if (is_measured(from - kWide, from, low, high) && is_measured(to, to + kWide, low, high)) return true;
  const double over = std::min(high + kWide, surface.z_high), under = std::max(low - kWide, surface.z_low);
  return over - high > kMirrorCube && low - under > kMirrorCube && is_measured(from, to, high, over) &&
         is_measured(from, to, under, low);
}

/// Where the rays to what lies behind the plane cross it: m along the plane, and heights.
std::vector<Eigen::Vector2d> crossings(const SampledSite& site, const MirrorPlane& plane,
                                       const std::vector<SitePoint>& things) {
  std::vector<Eigen::Vector2d> found;
  for (const SitePoint& thing : things) {
    if (plane.depth_of(thing.p) < kNearestImage) continue;
    if (const auto at = crossing(site, plane, thing))
      found.emplace_back(plane.along().dot(at->head<2>() - plane.at), at->z());
  }
  return found;
}

/// Widens the part of the plane through which images were seen as long as it was not measured there and
/// images were seen through it, floor and ceiling included.
void widen(const SampledSite& site, const MirrorPlane& plane, Mirror& mirror) {
  constexpr std::size_t kFewest = 2;
  const std::vector<Eigen::Vector2d> through = crossings(site, plane, site.samples);
  const auto is_open = [&](double from, double to, double low, double high) {
    const Eigen::AlignedBox2d strip(Eigen::Vector2d(from, low), Eigen::Vector2d(to, high));
    const auto rays = std::count_if(through.begin(), through.end(),
                                    [&](const Eigen::Vector2d& at) { return strip.contains(at); });
    return static_cast<std::size_t>(rays) >= kFewest &&
           measured_in(site, plane, from, to, low, high) <= kUnmeasured;
  };
  for (bool wider = true; wider;) {
    wider = false;
    if (is_open(mirror.from - kMirrorCube, mirror.from, mirror.low, mirror.high))
      mirror.from -= kMirrorCube, wider = true;
    if (is_open(mirror.to, mirror.to + kMirrorCube, mirror.low, mirror.high))
      mirror.to += kMirrorCube, wider = true;
    if (is_open(mirror.from, mirror.to, mirror.low - kMirrorCube, mirror.low))
      mirror.low -= kMirrorCube, wider = true;
    if (is_open(mirror.from, mirror.to, mirror.high, mirror.high + kMirrorCube))
      mirror.high += kMirrorCube, wider = true;
  }
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
  constexpr double kMaybe = 0.25, kOff = 0.03;  // of the things; m
  const std::vector<const SitePoint*> some = things_behind(site, plane, plane.at, kStride);
  if (some.size() < kFew) return false;
  const auto alike = [&](double shift) { return fraction_alike(site, plane, some, shift); };
  return std::max({alike(-kOff), alike(0), alike(kOff)}) > kMaybe;
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

/// Measures where a mirror's images end, and through what rays saw them; false: rays met the plane there, or
/// came from behind.
bool measure(const SampledSite& site, const MirrorPlane& plane, const std::vector<const SitePoint*>& things,
             Mirror& mirror) {
  constexpr double kEnds = 0.01, kThrough = 0.9;  // quantile; of the rays
  std::vector<double> depths, places, crossed, heights;
  std::size_t open = 0, known = 0;
  for (const SitePoint* thing : things) {
    if (!has_image(site, plane, *thing)) continue;
    depths.push_back(plane.depth_of(thing->p));
    places.push_back(mirror.along().dot(thing->p.head<2>() - mirror.at));
    known += thing->viewpoint >= 0 ? 1 : 0;
    const auto at = crossing(site, plane, *thing);
    if (!at) continue;
    open += measured_at(site, plane, *at) ? 0 : 1;
    crossed.push_back(mirror.along().dot(at->head<2>() - mirror.at));
    heights.push_back(at->z());
  }
  std::tie(mirror.images_from, mirror.images_to) = quantile_range(places, kEnds, 1 - kEnds);
  mirror.depth = quantile(depths, 1 - kEnds);
  mirror.rays = known > 0;
  if (!mirror.rays) return true;
  if (crossed.empty() || static_cast<double>(open) < kThrough * static_cast<double>(known)) return false;
  std::tie(mirror.from, mirror.to) = quantile_range(crossed, kEnds, 1 - kEnds);
  std::tie(mirror.low, mirror.high) = quantile_range(heights, kEnds, 1 - kEnds);
  return true;
}

std::optional<Mirror> mirror_in(const SampledSite& site, const VerticalSurface& surface, double side) {
  constexpr std::size_t kFewest = 150;
  constexpr double kOff = 0.025, kNarrowest = 0.4;  // m
  constexpr int kFewestLayers = 4;                  // without rays
  const Eigen::Vector2d d = (surface.end - surface.start).normalized();
  const MirrorPlane plane{0.5 * (surface.start + surface.end), side * Eigen::Vector2d(d.y(), -d.x())};
  if (!may_be_mirror(site, plane)) return std::nullopt;
  const std::vector<const SitePoint*> things = things_behind(site, plane, plane.at, 1);
  if (things.size() < kFewest) return std::nullopt;
  const MirrorPlane fit = fitted(site, plane, things);
  Mirror mirror;
  mirror.at = fit.at, mirror.behind = fit.behind;
  mirror.alike = fraction_alike(site, fit, things);
  if (std::abs(plane.behind.dot(fit.at - plane.at)) > kOff || !are_images(site, fit, things, mirror.alike) ||
      !measure(site, fit, things, mirror))
    return std::nullopt;
  if (mirror.rays) {
    widen(site, fit, mirror);
    mirror.certain = true;
  } else {
    std::tie(mirror.from, mirror.to) = hole_of(site, fit, surface.z_low);
    mirror.low = surface.z_low, mirror.high = surface.z_high;
    if (image_layers(site, fit, things).alike < kFewestLayers ||
        !has_frame(site, fit, mirror.from, mirror.to, surface))
      return std::nullopt;
    mirror.certain = is_part_of_room(site, fit, things.size(), mirror.alike, plane.at);
  }
  return mirror.to - mirror.from > kNarrowest ? std::optional(mirror) : std::nullopt;
}

bool same_plane(const Mirror& mirror, const VerticalSurface& surface) {
  constexpr double kNear = 0.15;  // m
  return std::abs(mirror.depth_of(surface.start)) < kNear && std::abs(mirror.depth_of(surface.end)) < kNear;
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
  for (const VerticalSurface& surface : segmentation.verticals) {
    const bool known = std::any_of(mirrors.begin(), mirrors.end(),
                                   [&](const Mirror& mirror) { return same_plane(mirror, surface); });
    if (surface.curve != kNoCurve || known) continue;
    const auto left = mirror_in(site, surface, 1), right = mirror_in(site, surface, -1);
    if (left || right) mirrors.push_back(!right || (left && left->alike >= right->alike) ? *left : *right);
  }
  return mirrors;
}

std::vector<bool> seen_in_mirrors(const cloud::PointCloud<Map>& cloud, const std::vector<Mirror>& mirrors) {
  constexpr double kBehind = 0.03, kMargin = 0.06;  // m
  const auto through = [&](const Mirror& mirror, std::size_t i) {
    const std::size_t viewpoint = cloud.scans.empty() ? 0 : cloud.scans[i];
    if (viewpoint >= cloud.viewpoints.size()) return false;
    const Eigen::Vector3d &from = cloud.viewpoints[viewpoint], p = cloud.points[i].cast<double>();
    const double before = mirror.depth_of(from.head<2>()), after = mirror.depth_of(p.head<2>());
    if (before >= 0 || after < kBehind) return false;
    const Eigen::Vector3d at = from + before / (before - after) * (p - from);
    const double along = mirror.along().dot(at.head<2>() - mirror.at);
    return along > mirror.from - kMargin && along < mirror.to + kMargin && at.z() > mirror.low - kMargin &&
           at.z() < mirror.high + kMargin;
  };
  std::vector<bool> images;
  for (const Mirror& mirror : mirrors) {
    if (!mirror.certain) continue;
    images.resize(cloud.size());
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (images[i]) continue;
      images[i] = mirror.rays ? through(mirror, i)
                              : mirror.depth_of(cloud.points[i].head<2>().cast<double>()) > kBehind &&
                                    mirror.has_image_at(cloud.points[i].head<2>().cast<double>());
    }
  }
  return images;
}

}  // namespace parhelion::semantic
