// The normal-based pipeline: points with similar normals are grouped into patches, adjacent patches of one
// plane into surfaces (region growing).
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "fusion/cloud/normals.hpp"
#include "fusion/semantic/segmentation/segmentation.hpp"
#include "protocols/angle_units.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kCube = 0.15;                    // m; less than a riser is high
constexpr double kTilt = 20 * kRadiansPerDegree;  // of one point's normal from level or upright
constexpr double kTurn = 15 * kRadiansPerDegree;  // between a region and a patch that joins it
constexpr double kMinArea = 0.15;                 // m^2, as in the image-based pipeline
constexpr int kMinPoints = 3;                     // of a patch; fewer normals have no mean
constexpr double kCubeReach = 1e5;                // m; limit of a cube's index

enum class Facing : std::uint8_t { level, upright };

/// The points of one cube with similar normals.
struct Patch {
  std::array<std::int32_t, 3> cube{};
  Facing facing = Facing::level;
  std::uint32_t count = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< sum of the points', with consistent sign
  std::uint32_t region = kNoSurface;
};

/// An upright normal may point either way: its sign is chosen to agree with the others of its patch.
struct PatchIndex {
  std::vector<Patch> patches;
  std::vector<std::uint32_t> patch_of;  ///< per point
  std::unordered_map<std::uint64_t, std::array<std::uint32_t, 2>> at;

  static std::uint64_t key(const std::array<std::int32_t, 3>& c) {
    std::uint64_t key = 0;
    for (const std::int32_t v : c) key = key << 21 | (static_cast<std::uint64_t>(v + (1 << 20)) & 0x1FFFFF);
    return key;
  }
  std::uint32_t find(const std::array<std::int32_t, 3>& c, Facing facing) const {
    const auto it = at.find(key(c));
    return it == at.end() ? kNoSurface : it->second[static_cast<std::size_t>(facing)];
  }
};

PatchIndex make_patches(const std::vector<Eigen::Vector3f>& points,
                        const std::vector<Eigen::Vector3f>& normals) {
  PatchIndex index;
  index.patch_of.assign(points.size(), kNoSurface);
  const float level = static_cast<float>(std::cos(kTilt)), upright = static_cast<float>(std::sin(kTilt));
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f& n = normals[i];
    const float z = std::abs(n.z());
    if (n.isZero() || (z < level && z > upright) || !(points[i].cwiseAbs().maxCoeff() < kCubeReach)) continue;
    const Facing facing = z >= level ? Facing::level : Facing::upright;
    std::array<std::int32_t, 3> c;
    for (int axis = 0; axis < 3; ++axis)
      c[static_cast<std::size_t>(axis)] =
          static_cast<std::int32_t>(std::floor(static_cast<double>(points[i][axis]) / kCube));
    auto& slot = index.at.try_emplace(PatchIndex::key(c), std::array{kNoSurface, kNoSurface})
                     .first->second[static_cast<std::size_t>(facing)];
    if (slot == kNoSurface) {
      slot = static_cast<std::uint32_t>(index.patches.size());
      index.patches.push_back({c, facing});
    }
    Patch& patch = index.patches[slot];
    const Eigen::Vector3d p = points[i].cast<double>(), normal = n.cast<double>();
    ++patch.count;
    patch.mean += (p - patch.mean) / patch.count;
    patch.normal += patch.normal.dot(normal) < 0 ? Eigen::Vector3d(-normal) : normal;
    index.patch_of[i] = slot;
  }
  for (Patch& patch : index.patches) {
    if (patch.facing == Facing::upright) patch.normal.z() = 0;
    patch.normal = patch.facing == Facing::level ? Eigen::Vector3d::UnitZ() : patch.normal.normalized();
  }
  return index;
}

/// Plane of a region while it grows.
struct RegionPlane {
  double count = 0;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  void add(const Patch& patch) {
    count += patch.count;
    mean += (patch.mean - mean) * patch.count / count;
    normal += (normal.dot(patch.normal) < 0 ? -1.0 : 1.0) * patch.count * patch.normal;
  }
  bool fits(const Patch& patch, double near) const {
    const Eigen::Vector3d n = normal.normalized();
    return std::abs(n.dot(patch.normal)) > std::cos(kTurn) && std::abs(n.dot(patch.mean - mean)) < near;
  }
};

/// Starts from the patch with the most points and grows over touching cubes. Regions by patch lists.
std::vector<std::vector<std::uint32_t>> grow(PatchIndex& index, double near) {
  std::vector<std::uint32_t> fullest(index.patches.size());
  std::iota(fullest.begin(), fullest.end(), 0U);
  std::stable_sort(fullest.begin(), fullest.end(), [&](std::uint32_t a, std::uint32_t b) {
    return index.patches[a].count > index.patches[b].count;
  });
  std::vector<std::vector<std::uint32_t>> regions;
  for (const std::uint32_t seed : fullest) {
    if (index.patches[seed].region != kNoSurface || index.patches[seed].count < kMinPoints) continue;
    const auto number = static_cast<std::uint32_t>(regions.size());
    std::vector<std::uint32_t> members = {seed};
    index.patches[seed].region = number;
    RegionPlane plane;
    plane.add(index.patches[seed]);
    for (std::size_t next = 0; next < members.size(); ++next) {
      const Patch from = index.patches[members[next]];
      for (int step = 0; step < 27; ++step) {
        const std::array<std::int32_t, 3> c{from.cube[0] + step % 3 - 1, from.cube[1] + step / 3 % 3 - 1,
                                            from.cube[2] + step / 9 - 1};
        const std::uint32_t other = index.find(c, from.facing);
        if (other == kNoSurface || index.patches[other].region != kNoSurface ||
            index.patches[other].count < kMinPoints || !plane.fits(index.patches[other], near))
          continue;
        index.patches[other].region = number;
        plane.add(index.patches[other]);
        members.push_back(other);
      }
    }
    regions.push_back(std::move(members));
  }
  return regions;
}

/// Total least squares line through the region's points in the plan; false where it is too short.
bool make_vertical(const std::vector<Eigen::Vector3f>& points, double min_length, VerticalSurface& surface) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : points) mean += p.head<2>().cast<double>();
  mean /= static_cast<double>(points.size());
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  for (const auto& p : points) {
    const Eigen::Vector2d offset = p.head<2>().cast<double>() - mean;
    squares += offset * offset.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(squares / static_cast<double>(points.size()));
  const Eigen::Vector2d d = solver.eigenvectors().col(1);
  std::vector<double> along, heights;
  for (const auto& p : points) {
    along.push_back(d.dot(p.head<2>().cast<double>() - mean));
    heights.push_back(static_cast<double>(p.z()));
  }
  const double low = quantile(along, 0.002), high = quantile(along, 0.998);
  if (high - low < min_length) return false;
  surface.start = mean + low * d;
  surface.end = mean + high * d;
  surface.z_low = quantile(heights, 0.01);
  surface.z_high = quantile(heights, 0.99);
  surface.thickness = 2 * std::sqrt(std::max(0.0, solver.eigenvalues()[0]));
  surface.points = static_cast<std::uint32_t>(points.size());
  return surface.z_high - surface.z_low >= 0.1;
}

bool make_horizontal(const std::vector<Eigen::Vector3f>& points, double area, HorizontalSurface& surface) {
  surface.area = area;
  if (surface.area < kMinArea) return false;
  std::vector<double> heights;
  surface.low.setConstant(1e30);
  surface.high.setConstant(-1e30);
  for (const auto& p : points) {
    heights.push_back(static_cast<double>(p.z()));
    surface.low = surface.low.cwiseMin(p.head<2>().cast<double>());
    surface.high = surface.high.cwiseMax(p.head<2>().cast<double>());
  }
  surface.z = quantile(heights, 0.5);
  double squares = 0;
  for (const double z : heights) squares += (z - surface.z) * (z - surface.z);
  surface.thickness = 2 * std::sqrt(squares / static_cast<double>(heights.size()));
  surface.points = static_cast<std::uint32_t>(points.size());
  return true;
}

/// Seen from below by most normals where they face a scanner; else where it is high above the lowest.
void find_facing(const cloud::PointCloud<Map>& cloud, const std::vector<Eigen::Vector3f>& normals,
                 Segmentation& result) {
  const auto verticals = static_cast<std::uint32_t>(result.verticals.size());
  std::vector<std::int64_t> from_above(result.horizontals.size(), 0);
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const std::uint32_t s = result.surface_of[i];
    if (s != kNoSurface && s >= verticals) from_above[s - verticals] += normals[i].z() > 0 ? 1 : -1;
  }
  const bool known = !cloud.viewpoints.empty() || !cloud.normals.empty();
  double lowest = 1e30;
  for (const HorizontalSurface& s : result.horizontals) lowest = std::min(lowest, s.z);
  for (std::size_t h = 0; h < result.horizontals.size(); ++h)
    result.horizontals[h].faces_down = known ? from_above[h] < 0 : result.horizontals[h].z > lowest + 1.8;
}

}  // namespace

Result<Segmentation> segment_by_normals(const cloud::PointCloud<Map>& cloud,
                                        const SegmentationOptions& options) {
  if (cloud.empty()) return Error{"segmentation: the cloud is empty; expected the points of a scan"};
  if (!(options.near > 0 && options.min_length > 0) || options.threads < 0)
    return Error{"segmentation: near and min_length must be positive, threads not negative"};
  std::vector<Eigen::Vector3f> normals = cloud.normals;
  if (normals.empty()) {
    cloud::NormalOptions settings;
    settings.method = cloud::NormalMethod::random_planes;
    settings.seed = options.seed;
    settings.threads = options.threads;
    auto estimated = cloud::estimate_normals(cloud.points, settings);
    if (!estimated) return estimated.error();
    normals = std::move(*estimated);
    cloud::face_viewpoints(cloud.points, cloud.scans, cloud.viewpoints, normals);
  }
  PatchIndex index = make_patches(cloud.points, normals);
  const auto regions = grow(index, options.near);

  std::vector<std::vector<std::uint32_t>> points_of(regions.size());
  for (std::uint32_t i = 0; i < cloud.size(); ++i) {
    const std::uint32_t patch = index.patch_of[i];
    if (patch != kNoSurface && index.patches[patch].region != kNoSurface)
      points_of[index.patches[patch].region].push_back(i);
  }
  Segmentation result;
  result.surface_of.assign(cloud.size(), kNoSurface);
  std::vector<std::uint32_t> horizontal_regions;
  const auto points_in = [&](std::size_t r) {
    std::vector<Eigen::Vector3f> points;
    for (const std::uint32_t i : points_of[r]) points.push_back(cloud.points[i]);
    return points;
  };
  for (std::uint32_t r = 0; r < regions.size(); ++r) {
    if (index.patches[regions[r].front()].facing == Facing::level) {
      horizontal_regions.push_back(r);
      continue;
    }
    VerticalSurface surface;
    if (!make_vertical(points_in(r), options.min_length, surface)) continue;
    for (const std::uint32_t i : points_of[r])
      result.surface_of[i] = static_cast<std::uint32_t>(result.verticals.size());
    result.verticals.push_back(surface);
  }
  for (const std::uint32_t r : horizontal_regions) {
    HorizontalSurface surface;
    // A region may pass through a cube's border; its columns count once.
    std::vector<std::pair<std::int32_t, std::int32_t>> columns;
    for (const std::uint32_t patch : regions[r])
      columns.emplace_back(index.patches[patch].cube[0], index.patches[patch].cube[1]);
    std::sort(columns.begin(), columns.end());
    const auto distinct = std::unique(columns.begin(), columns.end()) - columns.begin();
    if (!make_horizontal(points_in(r), static_cast<double>(distinct) * kCube * kCube, surface)) continue;
    for (const std::uint32_t i : points_of[r])
      result.surface_of[i] = static_cast<std::uint32_t>(result.verticals.size() + result.horizontals.size());
    result.horizontals.push_back(surface);
  }
  find_facing(cloud, normals, result);
  return result;
}

}  // namespace parhelion::semantic
