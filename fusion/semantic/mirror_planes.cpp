#include "fusion/semantic/mirror_planes.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <utility>

#include "fusion/cloud/parallel.hpp"

namespace parhelion::semantic {

namespace {

constexpr std::size_t kMaxCubes = 250'000;   ///< points whose cubes are marked
constexpr std::size_t kMaxSamples = 40'000;  ///< points looked at

/// A scrambled index (the finalizer of splitmix64): every nth point of a file may be of one ring of a
/// scanner.
std::uint64_t scrambled(std::uint64_t i) {
  i = (i + 0x9E3779B97F4A7C15) * 0xBF58476D1CE4E5B9;
  i = (i ^ i >> 27) * 0x94D049BB133111EB;
  return i ^ i >> 31;
}

}  // namespace

Eigen::Array3i mirror_cube(const Eigen::Vector3d& p, const Eigen::Vector3d& origin) {
  constexpr double kFarthestCube = (1 << 20) - 8;  // OccupiedCubes
  return ((p - origin).array() / kMirrorCube).floor().max(-kFarthestCube).min(kFarthestCube).cast<int>();
}

SampledSite sampled_site(const cloud::PointCloud<Map>& cloud, const Segmentation& segmentation) {
  SampledSite site{{}, {}, {}, segmentation, cloud.viewpoints};
  if (!cloud.empty()) site.origin = cloud.points.front().cast<double>();
  // One viewpoint without numbers of scans may be that of a whole registered cloud.
  site.rays = !cloud.viewpoints.empty() && !cloud.scans.empty();
  const std::size_t step = 4 + cloud.size() / kMaxSamples;
  const auto stride = static_cast<std::uint32_t>(1 + cloud.size() / kMaxCubes);
  const auto is_level = [&](std::size_t i) {
    const std::uint32_t surface = segmentation.surface_of[i];
    return surface != kNoSurface && surface >= segmentation.verticals.size();
  };
  struct Chosen {
    std::vector<SitePoint> samples, things;
    std::vector<Eigen::Array3i> cubes;
  };
  constexpr std::size_t kChunk = 16'384;
  std::vector<Chosen> chunks((cloud.size() + kChunk - 1) / kChunk);
  cloud::for_each_chunk(cloud.size(), kChunk, 0, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    Chosen& chosen = chunks[chunk];
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint64_t choice = scrambled(i);
      if (choice % step != 0) {
        if (static_cast<std::uint32_t>(choice >> 32) % stride == 0 && !is_level(i))
          chosen.cubes.push_back(mirror_cube(cloud.points[i].cast<double>(), site.origin));
        continue;
      }
      chosen.samples.push_back(
          {cloud.points[i].cast<double>(), segmentation.surface_of[i], site.rays ? cloud.scans[i] : -1});
      if (!is_level(i)) chosen.things.push_back(chosen.samples.back());
    }
  });
  for (const Chosen& chosen : chunks) {
    for (const Eigen::Array3i& cube : chosen.cubes) site.cubes.add(cube);
    site.samples.insert(site.samples.end(), chosen.samples.begin(), chosen.samples.end());
    site.things.insert(site.things.end(), chosen.things.begin(), chosen.things.end());
  }
  std::size_t alike = 0;
  for (const SitePoint& thing : site.things)
    alike += site.cubes.contains(mirror_cube(thing.p, site.origin)) ? 1 : 0;
  site.shared =
      static_cast<double>(alike) / static_cast<double>(std::max<std::size_t>(site.things.size(), 1));
  return site;
}

namespace {

/// Walls across a mirror go on behind it as they do before it, whatever is there.
bool runs_across(const VerticalSurface& surface, const MirrorPlane& plane) {
  constexpr double kLong = 0.8, kAcross = 0.9;  // m; cosine
  const Eigen::Vector2d d = surface.end - surface.start;
  return d.norm() > kLong && std::abs(d.dot(plane.behind)) > kAcross * d.norm();
}

}  // namespace

std::vector<const SitePoint*> things_behind(const SampledSite& site, const MirrorPlane& plane,
                                            const Eigen::Vector2d& middle, std::size_t stride) {
  std::vector<const SitePoint*> found;
  for (std::size_t i = 0; i < site.things.size(); i += stride) {
    const SitePoint& thing = site.things[i];
    const double depth = plane.depth_of(thing.p);
    if (depth < kNearestImage || depth > kFarthestImage) continue;
    if (std::abs(plane.along().dot(thing.p.head<2>() - middle)) > kFarthestImage) continue;
    if (thing.surface == kNoSurface || !runs_across(site.segmentation.verticals[thing.surface], plane))
      found.push_back(&thing);
  }
  return found;
}

bool has_image(const SampledSite& site, const MirrorPlane& plane, const SitePoint& thing, double shift) {
  return site.cubes.contains(mirror_cube(plane.image_of(thing.p, shift), site.origin));
}

double fraction_alike(const SampledSite& site, const MirrorPlane& plane,
                      const std::vector<const SitePoint*>& things, double shift) {
  const auto alike = std::count_if(things.begin(), things.end(), [&](const SitePoint* thing) {
    return has_image(site, plane, *thing, shift);
  });
  const double expected = site.shared * static_cast<double>(things.size());
  return expected > 0 ? std::min(static_cast<double>(alike) / expected, 1.0) : 0;
}

namespace {

/// Of -`steps` to `steps`, the middle of those that are nearly as good as the best: a cube is wider than a
/// step.
template <class Quality>
double best_step(int steps, Quality&& quality) {
  constexpr double kNearly = 0.8;
  std::vector<double> qualities;
  for (int k = -steps; k <= steps; ++k) qualities.push_back(quality(k));
  const double max_quality = *std::max_element(qualities.begin(), qualities.end());
  double sum = 0, mean = 0;
  for (int k = -steps; k <= steps; ++k) {
    const double weight =
        std::max(0.0, qualities[static_cast<std::size_t>(k + steps)] - kNearly * max_quality);
    sum += weight, mean += weight * k;
  }
  return sum > 0 ? mean / sum : 0;
}

}  // namespace

MirrorPlane fitted(const SampledSite& site, const MirrorPlane& plane,
                   const std::vector<const SitePoint*>& things) {
  constexpr double kStep = 0.01, kTurn = 0.002;  // m, rad
  constexpr std::size_t kEnough = 800;           // things
  std::vector<const SitePoint*> some;
  for (std::size_t i = 0; i < things.size(); i += 1 + things.size() / kEnough) some.push_back(things[i]);
  MirrorPlane best = plane;
  for (int pass = 0; pass < 2; ++pass) {
    const MirrorPlane base = best;
    const double steps =
        best_step(8, [&](int k) { return fraction_alike(site, base.moved(k * kStep, 0), some); });
    const MirrorPlane moved = base.moved(steps * kStep, 0);
    const double turns =
        best_step(4, [&](int k) { return fraction_alike(site, moved.moved(0, k * kTurn), some); });
    best = moved.moved(0, turns * kTurn);
  }
  return best;
}

ImageLayers image_layers(const SampledSite& site, const MirrorPlane& plane,
                         const std::vector<const SitePoint*>& things) {
  constexpr double kLayer = 0.25, kAlike = 0.5;  // m; of a layer
  constexpr int kFewest = 4;
  // m: a plane is fitted to that, and a layer that is one flat thing may be at the edge of cubes
  constexpr std::array<double, 3> kShifts = {-0.015, 0, 0.015};
  struct Count {
    int all = 0;
    std::array<int, kShifts.size()> alike{};
  };
  std::map<int, Count> counts;
  for (const SitePoint* thing : things) {
    Count& count = counts[static_cast<int>(plane.depth_of(thing->p) / kLayer)];
    ++count.all;
    for (std::size_t k = 0; k < kShifts.size(); ++k)
      count.alike[k] += has_image(site, plane, *thing, kShifts[k]) ? 1 : 0;
  }
  ImageLayers layers;
  for (const auto& [depth, count] : counts) {
    if (count.all < kFewest) continue;
    const int alike = *std::max_element(count.alike.begin(), count.alike.end());
    ++layers.all, layers.alike += alike > kAlike * site.shared * count.all ? 1 : 0;
  }
  return layers;
}

std::optional<Eigen::Vector3d> crossing(const SampledSite& site, const MirrorPlane& plane,
                                        const SitePoint& thing) {
  if (thing.viewpoint < 0 || static_cast<std::size_t>(thing.viewpoint) >= site.viewpoints.size())
    return std::nullopt;
  const Eigen::Vector3d& from = site.viewpoints[static_cast<std::size_t>(thing.viewpoint)];
  const double before = plane.depth_of(from), after = plane.depth_of(thing.p);
  if (before >= 0 || after <= 0) return std::nullopt;
  return Eigen::Vector3d(from + before / (before - after) * (thing.p - from));
}

bool measured_at(const SampledSite& site, const MirrorPlane& plane, const Eigen::Vector3d& p) {
  const Eigen::Vector3d off(kMirrorCube * plane.behind.x(), kMirrorCube * plane.behind.y(), 0);
  const auto has_points = [&](const Eigen::Vector3d& at) {
    return site.cubes.contains(mirror_cube(at, site.origin));
  };
  return has_points(p) || has_points(p - off) || has_points(p + off);
}

double measured_in(const SampledSite& site, const MirrorPlane& plane, double from, double to, double low,
                   double high) {
  int all = 0, measured = 0;
  for (double s = from + 0.5 * kMirrorCube; s < to; s += kMirrorCube) {
    const Eigen::Vector2d p = plane.at + s * plane.along();
    for (double z = low + 0.5 * kMirrorCube; z < high; z += kMirrorCube)
      ++all, measured += measured_at(site, plane, {p.x(), p.y(), z}) ? 1 : 0;
  }
  return static_cast<double>(measured) / std::max(all, 1);
}

}  // namespace parhelion::semantic
