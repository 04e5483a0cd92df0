#include "fusion/semantic/spread_voxels.hpp"

#include <oneapi/tbb/combinable.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "fusion/cloud/floor_index.hpp"
#include "fusion/cloud/parallel.hpp"
#include "fusion/cloud/symmetric3.hpp"
#include "fusion/cloud/voxel_index.hpp"
#include "fusion/semantic/occupied_cubes.hpp"
#include "protocols/model.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kFinest = 0.025, kCoarsest = 0.30;  ///< m
constexpr double kReach = 2.3;                       ///< voxels, of the neighbours of a plane
constexpr double kFlat = 0.25;                       ///< of the smallest to the middle variance
constexpr std::size_t kQueries = 600, kFewest = 500;
constexpr std::size_t kMaxSparse = 1'000'000;
constexpr std::size_t kCrowded = 256;  ///< points of a cube: where clouds are sparse there are fewer
constexpr double kDenseSide = 0.05, kSparsest = 0.13;  ///< m
constexpr double kJoined = 4.5;   ///< of the eight neighbours that a cube has in a closed surface
constexpr double kPitch = 0.018;  ///< m, between the points of a face

Eigen::Array3i cube_of(const Eigen::Vector3f& p, double side) {
  const Eigen::Array3d at = (p.cast<double>() / side).array().max(-1e6).min(1e6);
  return {cloud::floor_index(at.x()), cloud::floor_index(at.y()), cloud::floor_index(at.z())};
}

/// Numbers cubes in the order in which they are first asked for.
class CubeNumbers {
 public:
  std::uint32_t operator()(const Eigen::Array3i& cube) {
    std::uint32_t& number = index_[cube + kOrigin];
    if (number == cloud::VoxelIndex::kNone) {
      number = static_cast<std::uint32_t>(cubes_.size());
      cubes_.push_back(cube);
    }
    return number;
  }
  const std::vector<Eigen::Array3i>& cubes() const { return cubes_; }
  /// VoxelIndex::kNone where it was never asked for.
  std::uint32_t find(const Eigen::Array3i& cube) const { return index_.at(cube + kOrigin); }
  /// Calls visit(number) for the numbered cubes among the 27 at and around one.
  template <class Visit>
  void for_each_about(const Eigen::Array3i& cube, Visit&& visit) const {
    index_.for_each_about(cube + kOrigin, visit);
  }

 private:
  static constexpr int kOrigin = 1 << 20;  ///< indices must not be negative
  cloud::VoxelIndex index_;
  std::vector<Eigen::Array3i> cubes_;
};

/// Points by the cubes that they are in.
class Cubes {
 public:
  Cubes(std::span<const Eigen::Vector3f> points, double side) : points_(points), sorted_(points.size()) {
    std::vector<std::uint32_t> cube(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) cube[i] = numbers_(cube_of(points[i], side));
    begin_.assign(size() + 1, 0);
    for (const std::uint32_t c : cube) ++begin_[c + 1];
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    std::vector<std::uint32_t> next(begin_.begin(), begin_.end() - 1);
    for (std::uint32_t i = 0; i < points.size(); ++i) sorted_[next[cube[i]]++] = i;
  }
  std::size_t size() const { return numbers_.cubes().size(); }
  /// Of one cube: indices of its points, ascending.
  std::span<const std::uint32_t> in(std::size_t cube) const {
    return std::span(sorted_).subspan(begin_[cube], begin_[cube + 1] - begin_[cube]);
  }
  /// The points in the 27 cubes at and around one: by z, y and x of their cubes, so that sums over them do
  /// not depend on how cubes are stored. Of a crowded cube an even choice: a sensor that reports each missing
  /// return at one place fills one with all of them.
  void collect_about(std::size_t cube, std::vector<Eigen::Vector3f>& about) const {
    const Eigen::Array3i& at = numbers_.cubes()[cube];
    std::array<std::uint32_t, 27> number;
    number.fill(cloud::VoxelIndex::kNone);
    numbers_.for_each_about(at, [&](std::uint32_t n) {
      const Eigen::Array3i d = numbers_.cubes()[n] - at + 1;
      number[static_cast<std::size_t>(9 * d.z() + 3 * d.y() + d.x())] = n;
    });
    about.clear();
    for (const std::uint32_t n : number) {
      if (n == cloud::VoxelIndex::kNone) continue;
      const std::span<const std::uint32_t> inside = in(n);
      const std::size_t step = 1 + inside.size() / kCrowded;
      for (std::size_t k = 0; k < inside.size(); k += step) about.push_back(points_[inside[k]]);
    }
  }

 private:
  std::span<const Eigen::Vector3f> points_;
  CubeNumbers numbers_;
  std::vector<std::uint32_t> begin_, sorted_;
};

struct Plane {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::UnitZ();
};

/// The largest number whose square root is not more than `root`.
double largest_square(double root) {
  double square = root * root;
  while (std::sqrt(square) > root) square = std::nextafter(square, 0);
  while (std::sqrt(std::nextafter(square, HUGE_VAL)) <= root) square = std::nextafter(square, HUGE_VAL);
  return square;
}

/// Points by coordinate, for loops over many at once.
struct Candidates {
  std::vector<float> x, y, z;
  std::vector<float> squares;            ///< m^2, scratch: about those of their distances from one point
  std::vector<Eigen::Vector3d> offsets;  ///< m, scratch: from that point

  void assign(const std::vector<Eigen::Vector3f>& points) {
    const std::size_t n = points.size();
    x.resize(n), y.resize(n), z.resize(n), squares.resize(n), offsets.resize(n);
    for (std::size_t i = 0; i < n; ++i) x[i] = points[i].x(), y[i] = points[i].y(), z[i] = points[i].z();
  }

  /// Those of a distance from p whose square is at most `reach2` (m^2), in their order.
  std::span<const Eigen::Vector3d> within(const Eigen::Vector3f& p, double reach2) {
    constexpr double kRounding = 1e-5;  // of the squares, more than a float's
    const auto largest = static_cast<float>((1 + kRounding) * reach2);
    const std::size_t n = x.size();
    // Plain pointers: loops with checked accesses are not vectorized.
    const float *const at_x = x.data(), *const at_y = y.data(), *const at_z = z.data();
    const float px = p.x(), py = p.y(), pz = p.z();
    float* const square = squares.data();
    for (std::size_t i = 0; i < n; ++i) {
      const float dx = at_x[i] - px, dy = at_y[i] - py, dz = at_z[i] - pz;
      square[i] = dx * dx + dy * dy + dz * dz;
    }
    // Free of branches: which are near cannot be predicted.
    std::size_t count = 0;
    for (std::size_t i = 0; i < n; ++i) {
      offsets[count] = (Eigen::Vector3f(x[i], y[i], z[i]) - p).cast<double>();
      count += squares[i] > largest ? 0 : 1;
    }
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (offsets[i].squaredNorm() > reach2) continue;
      offsets[kept++] = offsets[i];
    }
    return std::span(offsets).first(kept);
  }
};

/// Through points at these offsets from p.
std::optional<Plane> plane_at(std::span<const Eigen::Vector3d> offsets, const Eigen::Vector3f& p) {
  if (offsets.size() < 5) return std::nullopt;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), squares = sum, beside = sum;
  for (const Eigen::Vector3d& d : offsets) {
    sum += d, squares += d.cwiseProduct(d);
    beside += Eigen::Vector3d(d.x() * d.y(), d.x() * d.z(), d.y() * d.z());
  }
  const auto n = static_cast<double>(offsets.size());
  const Eigen::Vector3d mean = sum / n;
  const cloud::SmallestEigen eigen = cloud::smallest_eigen(
      squares / n - mean.cwiseProduct(mean),
      beside / n - Eigen::Vector3d(mean.x() * mean.y(), mean.x() * mean.z(), mean.y() * mean.z()));
  if (eigen.smallest > kFlat * eigen.middle) return std::nullopt;
  return Plane{p.cast<double>() + mean, eigen.vector};
}

/// Of each point, through its neighbours.
std::vector<std::optional<Plane>> planes_of(std::span<const Eigen::Vector3f> points, double reach,
                                            int threads) {
  constexpr std::size_t kChunk = 256;  // cubes
  const Cubes cubes(points, reach);
  const double reach2 = largest_square(reach);
  std::vector<std::optional<Plane>> planes(points.size());
  cloud::for_each_chunk(cubes.size(), kChunk, threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    std::vector<Eigen::Vector3f> about;
    Candidates candidates;
    for (std::size_t c = begin; c < end; ++c) {
      cubes.collect_about(c, about);
      candidates.assign(about);
      for (const std::uint32_t i : cubes.in(c))
        planes[i] = plane_at(candidates.within(points[i], reach2), points[i]);
    }
  });
  return planes;
}

/// How many points are along a side of the square that replaces one.
int side_of_square(double spacing) { return std::max(2, static_cast<int>(std::lround(spacing / kPitch))); }

/// The fields of one colour on a chessboard: every row and every column has points, by half of them.
bool is_filled(int row, int column) { return (row + column) % 2 == 0; }

std::size_t points_of_square(int side) { return static_cast<std::size_t>((side * side + 1) / 2); }

/// The points that replace one: a column of them, or a square on its plane.
void spread(const Eigen::Vector3f& point, const std::optional<Plane>& plane, double spacing,
            std::span<Eigen::Vector3f> out) {
  const int count = side_of_square(spacing);
  const auto offset = [&](int k) { return spacing * ((k + 0.5) / count - 0.5); };
  const Eigen::Vector3d p = point.cast<double>();
  auto next = out.begin();
  if (!plane) {
    for (int k = 0; k < count; ++k) *next++ = (p + Eigen::Vector3d(0, 0, offset(k))).cast<float>();
    return;
  }
  // Along the axis that is nearest to the plane first, so that faces of neighbours meet.
  const Eigen::Vector3d& n = plane->normal;
  const Eigen::Vector3d on_plane = p - n.dot(p - plane->centre) * n;
  const Eigen::Vector3d u = (std::abs(n.z()) < 0.7 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitX());
  const Eigen::Vector3d a = (u - n.dot(u) * n).normalized(), b = n.cross(a);
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < count; ++k) {
      if (is_filled(i, k)) *next++ = (on_plane + offset(i) * a + offset(k) * b).cast<float>();
    }
  }
}

/// Mean number of occupied cubes around an occupied one: eight on a closed surface.
double joined(const std::vector<Eigen::Vector3f>& points, double side) {
  OccupiedCubes cubes;
  for (const Eigen::Vector3f& p : points) cubes.add(cube_of(p, side));
  return static_cast<double>(cubes.count_neighbours()) / static_cast<double>(cubes.count());
}

/// Of each query the distance (m) to the nearest point in another place, at most `reach`.
std::vector<double> nearest_distances(const std::vector<Eigen::Vector3f>& points,
                                      const std::vector<Eigen::Vector3f>& queries, double reach) {
  // The queries at and around each cube: one look-up for a point.
  const double per_metre = 1 / reach;  // cubes need not be the same to the bit as others of that size
  const auto place_of = [&](const Eigen::Vector3f& p) {
    const Eigen::Array3d at = (p.cast<double>() * per_metre).array().max(-1e6).min(1e6);
    return Eigen::Array3i(cloud::floor_index(at.x()), cloud::floor_index(at.y()), cloud::floor_index(at.z()));
  };
  CubeNumbers numbers;
  std::vector<std::vector<std::uint32_t>> queries_about;
  for (std::uint32_t q = 0; q < queries.size(); ++q) {
    for (int n = 0; n < 27; ++n) {
      const std::uint32_t cube =
          numbers(place_of(queries[q]) + Eigen::Array3i(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1));
      queries_about.resize(numbers.cubes().size());
      queries_about[cube].push_back(q);
    }
  }
  using Squares = std::vector<double>;
  tbb::combinable<Squares> of_threads(
      [&] { return Squares(queries.size(), std::numeric_limits<double>::infinity()); });
  constexpr std::size_t kChunk = 16'384;
  cloud::for_each_chunk(points.size(), kChunk, 0, [&](std::size_t, std::size_t begin, std::size_t end) {
    Squares& squares = of_threads.local();
    Eigen::Array3i last = Eigen::Array3i::Constant(std::numeric_limits<int>::min());
    std::uint32_t cube = cloud::VoxelIndex::kNone;
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3f& p = points[i];
      const Eigen::Array3i place = place_of(p);
      if ((place != last).any())
        last = place, cube = numbers.find(place);  // points in sequence often share it
      if (cube == cloud::VoxelIndex::kNone) continue;
      for (const std::uint32_t q : queries_about[cube]) {
        const double square = (p - queries[q]).cast<double>().squaredNorm();
        if (square > 0) squares[q] = std::min(squares[q], square);
      }
    }
  });
  Squares squares(queries.size(), std::numeric_limits<double>::infinity());
  of_threads.combine_each([&](const Squares& some) {
    for (std::size_t q = 0; q < squares.size(); ++q) squares[q] = std::min(squares[q], some[q]);
  });
  std::vector<double> distances;
  for (const double square : squares) distances.push_back(std::min(reach, std::sqrt(square)));
  return distances;
}

}  // namespace

std::optional<double> voxel_spacing(const cloud::PointCloud<Cloud>& cloud) {
  if (cloud.size() < kFewest) return std::nullopt;
  std::vector<Eigen::Vector3f> queries;
  for (std::size_t k = 0; k < kQueries; ++k) queries.push_back(cloud.points[k * cloud.size() / kQueries]);
  std::vector<double> distances = nearest_distances(cloud.points, queries, kCoarsest);
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
  const std::vector<std::optional<Plane>> planes = planes_of(cloud.points, kReach * spacing, threads);
  const int side = side_of_square(spacing);
  const auto points_of = [&](std::size_t i) {
    return planes[i] ? points_of_square(side) : static_cast<std::size_t>(side);
  };
  std::vector<std::size_t> first{0};  // of each chunk
  for (std::size_t begin = 0; begin < cloud.size(); begin += kChunk) {
    std::size_t points = 0;
    for (std::size_t i = begin; i < std::min(cloud.size(), begin + kChunk); ++i) points += points_of(i);
    first.push_back(first.back() + points);
  }
  SpreadCloud result;
  result.cloud.viewpoints = cloud.viewpoints;
  result.cloud.points.resize(first.back());
  result.parent.resize(first.back());
  if (!cloud.scans.empty()) result.cloud.scans.resize(first.back());
  cloud::for_each_chunk(
      cloud.size(), kChunk, threads, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
        std::size_t at = first[chunk];
        for (std::size_t i = begin; i < end; ++i) {
          const std::size_t points = points_of(i);
          spread(cloud.points[i], planes[i], spacing, std::span(result.cloud.points).subspan(at, points));
          std::fill_n(result.parent.begin() + static_cast<std::ptrdiff_t>(at), points,
                      static_cast<std::uint32_t>(i));
          if (!cloud.scans.empty())
            std::fill_n(result.cloud.scans.begin() + static_cast<std::ptrdiff_t>(at), points, cloud.scans[i]);
          at += points;
        }
      });
  return result;
}

std::vector<std::uint8_t> labels_of_parents(const SpreadCloud& spread, std::span<const std::uint8_t> labels,
                                            std::size_t parents) {
  std::vector<std::array<std::uint16_t, kEntityLabels>> votes(parents);
  for (std::size_t i = 0; i < labels.size(); ++i)
    ++votes[spread.parent[i]][std::min<std::uint8_t>(labels[i], 9)];
  std::vector<std::uint8_t> result;
  for (const auto& vote : votes)
    result.push_back(static_cast<std::uint8_t>(std::max_element(vote.begin(), vote.end()) - vote.begin()));
  return result;
}

}  // namespace parhelion::semantic
