#include "fusion/cloud/normals.hpp"

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "fusion/cloud/bucket_grid.hpp"
#include "fusion/scan/philox.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::cloud {
namespace {

constexpr double kWantedInBucket = 8;  // of 27, about nine lie on a surface: some seventy neighbours
constexpr double kSmallestBucket = 0.01, kLargestBucket = 0.5;  // m; beyond, neighbours share no surface
Eigen::AlignedBox3f without_strays(std::span<const Eigen::Vector3f> points) {
  Eigen::AlignedBox3f box;
  std::vector<float> values;
  const std::size_t step = std::max<std::size_t>(1, points.size() / 100'000);
  for (int axis = 0; axis < 3; ++axis) {
    values.clear();
    for (std::size_t i = 0; i < points.size(); i += step) values.push_back(points[i][axis]);
    const float low = quantile(values, 0.001), high = quantile(values, 0.999);
    const float margin = std::max(1.0F, high - low);
    box.min()[axis] = low - margin;
    box.max()[axis] = high + margin;
  }
  return box;
}

/// The bucket size at which the median point has about the wanted number of neighbours; on surfaces this
/// number grows with the square of the side.
double fitted_bucket(std::span<const Eigen::Vector3f> points) {
  double side = 0.1;
  for (int round = 0; round < 2; ++round) {
    const BucketGrid grid(points, side);
    std::vector<std::uint32_t> counts;
    const std::size_t step = std::max<std::size_t>(1, points.size() / 2'000);
    for (std::size_t i = 0; i < points.size(); i += step) {
      std::uint32_t count = 0;
      grid.for_each_run(grid.bucket_of(points[i]),
                        [&](BucketGrid::Range run) { count += run.end - run.begin; });
      counts.push_back(count);
    }
    const double in_bucket = std::max(1.0, median(counts) / 9.0);
    side = std::clamp(grid.bucket_size() * std::sqrt(kWantedInBucket / in_bucket), kSmallestBucket,
                      kLargestBucket);
  }
  return side;
}

/// The points of the 27 buckets; evenly thinned where there are too many.
void collect(const BucketGrid& grid, const Eigen::Vector3f& p, int max_points,
             std::vector<Eigen::Vector3f>& list) {
  list.clear();
  const Eigen::Vector3i bucket = grid.bucket_of(p);
  std::uint32_t count = 0;
  grid.for_each_run(bucket, [&](BucketGrid::Range run) { count += run.end - run.begin; });
  const auto limit = static_cast<std::uint32_t>(max_points);
  const std::uint32_t step = (count + limit - 1) / limit;
  std::uint32_t skip = 0;
  grid.for_each_run(bucket, [&](BucketGrid::Range run) {
    std::uint32_t i = run.begin + skip;
    for (; i < run.end; i += step) list.push_back(grid.sorted()[i] - p);
    skip = i - run.end;
  });
}

Eigen::Vector3f upwards(const Eigen::Vector3f& normal) {
  const bool down = normal.z() != 0 ? normal.z() < 0 : normal.y() != 0 ? normal.y() < 0 : normal.x() < 0;
  return down ? Eigen::Vector3f(-normal) : normal;
}

/// Algorithm 2. The random numbers depend only on the point and the plane.
Eigen::Vector3f best_random_plane(const std::vector<Eigen::Vector3f>& list, std::size_t point,
                                  const NormalOptions& options) {
  const scan::PhiloxKey key{static_cast<std::uint32_t>(options.seed),
                            static_cast<std::uint32_t>(options.seed >> 32)};
  Eigen::Vector3f best = Eigen::Vector3f::Zero();
  float smallest = 0;
  for (int plane = 0; plane < options.planes; ++plane) {
    const scan::PhiloxCounter words = scan::philox4x32(
        {static_cast<std::uint32_t>(point), static_cast<std::uint32_t>(std::uint64_t{point} >> 32),
         static_cast<std::uint32_t>(plane), 0},
        key);
    const auto drawn = [&](std::size_t k) -> const Eigen::Vector3f& {
      return list[static_cast<std::size_t>(std::uint64_t{words[k]} * list.size() >> 32)];
    };
    const Eigen::Vector3f &a = drawn(0), &b = drawn(1), &c = drawn(2);
    const Eigen::Vector3f cross = (b - a).cross(c - a);
    const float size = cross.norm();
    // Three collinear points define no plane.
    if (!(size > 1e-3F * (b - a).norm() * (c - a).norm()) || size <= 0) continue;
    const Eigen::Vector3f normal = cross / size;
    float sum = 0;
    for (const Eigen::Vector3f& p : list) sum += std::abs(normal.dot(p - a));
    if (best.isZero() || sum < smallest) {
      smallest = sum;
      best = normal;
    }
  }
  return best;
}

Eigen::Vector3f min_variance_direction(const std::vector<Eigen::Vector3f>& list) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  Eigen::Matrix3f squares = Eigen::Matrix3f::Zero();
  for (const Eigen::Vector3f& p : list) {
    sum += p;
    squares += p * p.transpose();
  }
  const auto count = static_cast<float>(list.size());
  const Eigen::Vector3f mean = sum / count;
  const Eigen::Matrix3d covariance = (squares / count - mean * mean.transpose()).cast<double>();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(covariance);
  const Eigen::Vector3d lambda = solver.eigenvalues();
  // Collinear or coincident points have no preferred direction.
  if (!(lambda[1] > 1e-4 * lambda[2]) || lambda[2] <= 0) return Eigen::Vector3f::Zero();
  return solver.eigenvectors().col(0).cast<float>();
}

std::vector<Eigen::Vector3f> run(std::span<const Eigen::Vector3f> points, const NormalOptions& options) {
  std::vector<Eigen::Vector3f> normals(points.size(), Eigen::Vector3f::Zero());
  const Eigen::AlignedBox3f box = without_strays(points);
  std::vector<Eigen::Vector3f> near;
  std::vector<std::uint32_t> index;  // empty where all points are near
  const bool all = std::all_of(points.begin(), points.end(), [&](const auto& p) { return box.contains(p); });
  for (std::uint32_t i = 0; !all && i < points.size(); ++i) {
    if (!box.contains(points[i])) continue;
    near.push_back(points[i]);
    index.push_back(i);
  }
  const std::span<const Eigen::Vector3f> used = all ? points : std::span<const Eigen::Vector3f>(near);
  const BucketGrid grid(used, options.bucket_size > 0 ? options.bucket_size : fitted_bucket(used));
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, used.size(), 1024), [&](const auto& range) {
    std::vector<Eigen::Vector3f> list;
    // In the order of the buckets, so that neighbours are in the cache.
    for (std::size_t k = range.begin(); k < range.end(); ++k) {
      const std::uint32_t i = grid.order()[k];
      collect(grid, grid.sorted()[k], options.max_neighbours, list);
      if (list.size() < 3) continue;
      const std::uint32_t point = all ? i : index[i];
      normals[point] =
          upwards(options.method == NormalMethod::principal ? min_variance_direction(list)
                                                            : best_random_plane(list, point, options));
    }
  });
  return normals;
}

}  // namespace

Result<std::vector<Eigen::Vector3f>> estimate_normals(std::span<const Eigen::Vector3f> points,
                                                      const NormalOptions& options) {
  if (points.empty()) return Error{"normals: the cloud is empty; expected the points of a scan"};
  if (!(options.bucket_size >= 0)) return Error{"normals: bucket_size must not be negative"};
  if (options.planes < 1 || options.max_neighbours < 3 || options.threads < 0)
    return Error{"normals: expected planes >= 1, max_neighbours >= 3, threads >= 0"};
  tbb::task_arena arena(options.threads == 0 ? tbb::task_arena::automatic : options.threads);
  return arena.execute([&] { return run(points, options); });
}

void face_viewpoints(std::span<const Eigen::Vector3f> points, std::span<const std::uint16_t> scans,
                     std::span<const Eigen::Vector3d> viewpoints, std::span<Eigen::Vector3f> normals) {
  if (viewpoints.empty()) return;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Eigen::Vector3f from = viewpoints[scans.empty() ? 0 : scans[i]].cast<float>();
    if (normals[i].dot(from - points[i]) < 0) normals[i] = -normals[i];
  }
}

}  // namespace parhelion::cloud
