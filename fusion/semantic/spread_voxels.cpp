#include "fusion/semantic/spread_voxels.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>
#include <utility>

#include "fusion/cloud/parallel.hpp"
#include "fusion/cloud/symmetric3.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kFinest = 0.025, kCoarsest = 0.30;  ///< m
constexpr double kReach = 2.3;                       ///< voxels, of the neighbours of a plane
constexpr double kFlat = 0.25;                       ///< of the smallest to the middle variance
constexpr std::size_t kQueries = 600, kFewest = 500;
constexpr std::size_t kMaxSparse = 1'000'000;
constexpr double kDenseSide = 0.05, kSparsest = 0.13;  ///< m
constexpr double kJoined = 4.5;   ///< of the eight neighbours that a cube has in a closed surface
constexpr double kPitch = 0.018;  ///< m, between the points of a face

/// Cells of a cube's side, sorted by key.
class Cells {
 public:
  Cells(std::span<const Eigen::Vector3f> points, double side) : points_(points), side_(side) {
    for (std::uint32_t i = 0; i < points.size(); ++i) sorted_.emplace_back(key(cell(points[i])), i);
    std::sort(sorted_.begin(), sorted_.end());
    for (std::uint32_t k = 0; k < sorted_.size(); ++k) first_.try_emplace(sorted_[k].first, k);
  }
  template <class Visit>
  void near(const Eigen::Vector3f& p, Visit&& visit) const {
    const Eigen::Array3i c = cell(p);
    for (int z = -1; z <= 1; ++z) {
      for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
          const std::uint64_t wanted = key(c + Eigen::Array3i(x, y, z));
          const auto found = first_.find(wanted);
          if (found == first_.end()) continue;
          for (std::uint32_t k = found->second; k < sorted_.size() && sorted_[k].first == wanted; ++k)
            visit(points_[sorted_[k].second]);
        }
      }
    }
  }

 private:
  Eigen::Array3i cell(const Eigen::Vector3f& p) const {
    return (p.cast<double>() / side_).array().floor().max(-1e6).min(1e6).cast<int>();
  }
  static std::uint64_t key(const Eigen::Array3i& c) {
    std::uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis)
      key = key << 21 | (static_cast<std::uint64_t>(c[axis] + (1 << 20)) & 0x1FFFFF);
    return key;
  }
  std::span<const Eigen::Vector3f> points_;
  double side_;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> sorted_;
  std::unordered_map<std::uint64_t, std::uint32_t> first_;
};

/// The points within `reach` (along each axis) of one of the queries, so that a large cloud needs no index.
std::vector<Eigen::Vector3f> around(const cloud::PointCloud<Cloud>& cloud,
                                    std::span<const Eigen::Vector3f> queries, double reach) {
  std::vector<Eigen::Vector3f> result;
  const Cells cells(queries, reach);
  for (const Eigen::Vector3f& p : cloud.points) {
    bool close = false;
    cells.near(p, [&](const Eigen::Vector3f& query) {
      close = close || (query - p).cwiseAbs().maxCoeff() <= static_cast<float>(reach);
    });
    if (close) result.push_back(p);
  }
  return result;
}

struct Plane {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::UnitZ();
};

std::optional<Plane> plane_at(const Cells& cells, const Eigen::Vector3f& p, double reach) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), squares = sum, beside = sum;
  double n = 0;
  cells.near(p, [&](const Eigen::Vector3f& q) {
    const Eigen::Vector3d d = (q - p).cast<double>();
    if (d.norm() > reach) return;
    n += 1, sum += d, squares += d.cwiseProduct(d);
    beside += Eigen::Vector3d(d.x() * d.y(), d.x() * d.z(), d.y() * d.z());
  });
  if (n < 5) return std::nullopt;
  const Eigen::Vector3d mean = sum / n;
  const cloud::SmallestEigen eigen = cloud::smallest_eigen(
      squares / n - mean.cwiseProduct(mean),
      beside / n - Eigen::Vector3d(mean.x() * mean.y(), mean.x() * mean.z(), mean.y() * mean.z()));
  if (eigen.smallest > kFlat * eigen.middle) return std::nullopt;
  return Plane{p.cast<double>() + mean, eigen.vector};
}

/// The points that replace one.
void spread(const Cells& cells, const Eigen::Vector3f& point, double spacing,
            std::vector<Eigen::Vector3f>& out) {
  const int count = std::max(2, static_cast<int>(std::lround(spacing / kPitch)));
  const auto offset = [&](int k) { return spacing * ((k + 0.5) / count - 0.5); };
  const Eigen::Vector3d p = point.cast<double>();
  const auto plane = plane_at(cells, point, kReach * spacing);
  if (!plane) {
    for (int k = 0; k < count; ++k) out.push_back((p + Eigen::Vector3d(0, 0, offset(k))).cast<float>());
    return;
  }
  // Along the axis that is nearest to the plane first, so that faces of neighbours meet.
  const Eigen::Vector3d& n = plane->normal;
  const Eigen::Vector3d on_plane = p - n.dot(p - plane->centre) * n;
  const Eigen::Vector3d u = (std::abs(n.z()) < 0.7 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitX());
  const Eigen::Vector3d a = (u - n.dot(u) * n).normalized(), b = n.cross(a);
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < count; ++k) out.push_back((on_plane + offset(i) * a + offset(k) * b).cast<float>());
  }
}

/// Mean number of occupied cubes around an occupied one: eight on a closed surface.
double joined(const std::vector<Eigen::Vector3f>& points, double side) {
  std::unordered_map<std::uint64_t, bool> occupied;
  const auto cube = [&](const Eigen::Vector3f& p) {
    return Eigen::Array3i((p.cast<double>() / side).array().floor().max(-1e6).min(1e6).cast<int>());
  };
  const auto key = [](const Eigen::Array3i& c) {
    std::uint64_t number = 0;
    for (int axis = 0; axis < 3; ++axis)
      number = number << 21 | (static_cast<std::uint64_t>(c[axis] + (1 << 20)) & 0x1FFFFF);
    return number;
  };
  std::size_t neighbours = 0, cubes = 0;
  for (const Eigen::Vector3f& p : points) occupied[key(cube(p))] = false;
  for (const Eigen::Vector3f& p : points) {
    const Eigen::Array3i c = cube(p);
    bool& done = occupied[key(c)];
    if (std::exchange(done, true)) continue;
    ++cubes;
    for (int n = 0; n < 27; ++n)
      neighbours +=
          n != 13 && occupied.contains(key(c + Eigen::Array3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)));
  }
  return static_cast<double>(neighbours) / static_cast<double>(cubes);
}

}  // namespace

std::optional<double> voxel_spacing(const cloud::PointCloud<Cloud>& cloud) {
  if (cloud.size() < kFewest) return std::nullopt;
  std::vector<Eigen::Vector3f> queries;
  for (std::size_t k = 0; k < kQueries; ++k) queries.push_back(cloud.points[k * cloud.size() / kQueries]);
  const std::vector<Eigen::Vector3f> neighbours = around(cloud, queries, kCoarsest);
  const Cells cells(neighbours, kCoarsest);
  std::vector<double> distances;
  for (const Eigen::Vector3f& query : queries) {
    double nearest = kCoarsest;
    cells.near(query, [&](const Eigen::Vector3f& q) {
      const double d = (q - query).cast<double>().norm();
      if (d > 0) nearest = std::min(nearest, d);
    });
    distances.push_back(nearest);
  }
  const double middle = quantile(distances, 0.5), low = quantile(distances, 0.1),
               high = quantile(distances, 0.9);
  if (middle < kFinest || middle >= kCoarsest || low < 0.55 * middle || high > 1.6 * middle)
    return std::nullopt;
  return middle;
}

std::optional<double> sparse_spacing(const cloud::PointCloud<Cloud>& cloud) {
  if (cloud.size() < kFewest || cloud.size() > kMaxSparse) return std::nullopt;
  if (joined(cloud.points, kDenseSide) > kJoined) return std::nullopt;
  for (const double side : {0.07, 0.10}) {
    if (joined(cloud.points, side) > kJoined) return side;
  }
  return kSparsest;
}

SpreadCloud spread_voxels(const cloud::PointCloud<Cloud>& cloud, double spacing, int threads) {
  constexpr std::size_t kChunk = 4096;
  const Cells cells(cloud.points, kReach * spacing);
  std::vector<std::vector<Eigen::Vector3f>> points((cloud.size() + kChunk - 1) / kChunk);
  std::vector<std::vector<std::uint32_t>> parents(points.size());
  cloud::for_each_chunk(cloud.size(), kChunk, threads,
                        [&](std::size_t chunk, std::size_t begin, std::size_t end) {
                          for (std::size_t i = begin; i < end; ++i) {
                            spread(cells, cloud.points[i], spacing, points[chunk]);
                            parents[chunk].resize(points[chunk].size(), static_cast<std::uint32_t>(i));
                          }
                        });
  SpreadCloud result;
  result.cloud.viewpoints = cloud.viewpoints;
  for (std::size_t c = 0; c < points.size(); ++c) {
    result.cloud.points.insert(result.cloud.points.end(), points[c].begin(), points[c].end());
    result.parent.insert(result.parent.end(), parents[c].begin(), parents[c].end());
  }
  if (!cloud.scans.empty()) {
    for (const std::uint32_t parent : result.parent) result.cloud.scans.push_back(cloud.scans[parent]);
  }
  return result;
}

std::vector<std::uint8_t> labels_of_parents(const SpreadCloud& spread, std::span<const std::uint8_t> labels,
                                            std::size_t parents) {
  std::vector<std::array<std::uint16_t, 10>> votes(parents);
  for (std::size_t i = 0; i < labels.size(); ++i)
    ++votes[spread.parent[i]][std::min<std::uint8_t>(labels[i], 9)];
  std::vector<std::uint8_t> result;
  for (const auto& vote : votes)
    result.push_back(static_cast<std::uint8_t>(std::max_element(vote.begin(), vote.end()) - vote.begin()));
  return result;
}

}  // namespace parhelion::semantic
