#include "fusion/semantic/net/find_inclined_planes.hpp"

#include <oneapi/tbb/combinable.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "fusion/cloud/parallel.hpp"
#include "fusion/cloud/voxel_index.hpp"
#include "protocols/model.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kGentlest = 0.07, kSteepest = 1.31;  // rad, 4 and 75 degrees
constexpr double kCube = 0.4;                         // m; noise of 3 cm leaves its points flat
constexpr double kTurned = 0.15;                      // rad, between a cube's plane and the region's
constexpr double kMinArea = 1.5, kMinRise = 0.25;     // m^2; m
constexpr double kHeadroom = 1.9;                     // m, as for level ceilings
constexpr double kOver = 0.3, kUnder = 0.5;           // m, of what lies over and under a plane
constexpr double kFromBelow = 0.6;                    // of a region's points or squares
constexpr int kFewest = 3, kFewOfCube = 8;            // points of a cell or a square; of a cube
constexpr std::uint32_t kNone = ~std::uint32_t{0};
constexpr std::size_t kSamples = 3'000'000;  // points that are measured against planes, of a dense cloud,
constexpr std::size_t kSamplesOfCube = 32;   // but so many of each cube, however large the site is
constexpr std::size_t kChunk = 16'384;       // points, of the work of one thread

using Label = EntityLabel;
using Place = InclinedPlane::Place;

/// Points of a cube of space, and the plane through them.
struct Cube {
  Eigen::Vector3i at = Eigen::Vector3i::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), mean = Eigen::Vector3d::Zero(),
                  normal = Eigen::Vector3d::UnitZ();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  int count = 0;
  bool flat = false, used = false;
};

bool is_inclined(const Eigen::Vector3d& normal) {
  const double inclination = std::acos(std::min(1.0, std::abs(normal.z())));
  return inclination > kGentlest && inclination < kSteepest;
}

/// What was measured in one square of the plan on, over and under a plane.
struct Column {
  int on = 0, over = 0, under = 0;
  double floor = std::numeric_limits<double>::lowest();  ///< m, the highest ground under it

  void add(const Column& o) {
    on += o.on, over += o.over, under += o.under;
    floor = std::max(floor, o.floor);
  }
};

/// What was measured around a plane: sums and extrema of any order.
struct Measured {
  std::map<Place, int> cells;
  std::map<Place, Column> columns;
  double from_below = 0, placed = 0;  ///< points on it that were seen from below; whose viewpoint is known
  Eigen::AlignedBox2d extent;

  void add(const Measured& o) {
    for (const auto& [cell, points] : o.cells) cells[cell] += points;
    for (const auto& [square, column] : o.columns) columns[square].add(column);
    from_below += o.from_below, placed += o.placed;
    extent.extend(o.extent);
  }
};

/// The lowest coordinate of any point along each axis, m.
Eigen::Vector3d lowest_of(const std::vector<Eigen::Vector3f>& points) {
  tbb::combinable<Eigen::Array3f> lowest(
      [] { return Eigen::Array3f::Constant(std::numeric_limits<float>::max()).eval(); });
  cloud::for_each_chunk(points.size(), kChunk, 0, [&](std::size_t, std::size_t begin, std::size_t end) {
    Eigen::Array3f& low = lowest.local();
    for (std::size_t i = begin; i < end; ++i) low = low.min(points[i].array());
  });
  return lowest.combine([](const Eigen::Array3f& a, const Eigen::Array3f& b) { return a.min(b).eval(); })
      .matrix()
      .cast<double>();
}

class PlaneFinder {
 public:
  PlaneFinder(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels)
      : cloud_(cloud), labels_(labels), low_(lowest_of(cloud.points)) {
    std::vector<float> heights;
    for (std::size_t i = 0; i < cloud.size(); i += 1 + cloud.size() / kSamples)
      heights.push_back(cloud.points[i].z());
    floor_ = static_cast<double>(quantile(heights, 0.005));
    const std::size_t candidates = fill_cubes();
    const std::size_t of_cube = candidates / (kSamplesOfCube * std::max<std::size_t>(1, cubes_.size()));
    stride_ = 1 + std::min(cloud.size() / kSamples, of_cube);
  }

  std::vector<InclinedPlane> find() {
    std::vector<InclinedPlane> found;
    for (std::uint32_t seed = 0; seed < cubes_.size(); ++seed) {
      if (cubes_[seed].used || !cubes_[seed].flat || !is_inclined(cubes_[seed].normal)) continue;
      if (auto plane = grow(seed)) found.push_back(std::move(*plane));
    }
    if (found.empty()) return found;
    std::vector<Measured> measured = measure(found);
    std::vector<InclinedPlane> ceilings;
    for (std::size_t r = 0; r < found.size(); ++r) {
      found[r].cells = std::move(measured[r].cells);
      found[r].extent = measured[r].extent;
      if (is_ceiling(measured[r], found[r])) ceilings.push_back(std::move(found[r]));
    }
    return ceilings;
  }

 private:
  /// The number of points in them.
  std::size_t fill_cubes() {
    std::size_t candidates = 0;
    Eigen::Vector3i last = Eigen::Vector3i::Constant(-1);  // points in sequence often share their cube
    std::uint32_t index = kNone;
    for (std::size_t i = 0; i < cloud_.size(); ++i) {
      if (!may_be_ceiling(labels_[i])) continue;
      const Eigen::Vector3d p = cloud_.points[i].cast<double>();
      const Eigen::Vector3i at = ((p - low_) / kCube).array().floor().cast<int>() + 1;
      if (at.maxCoeff() >= 1 << cloud::VoxelIndex::kBits) continue;
      if (at != last) {
        std::uint32_t& of_cube = number_[at];
        if (of_cube == cloud::VoxelIndex::kNone) {
          of_cube = static_cast<std::uint32_t>(cubes_.size());
          cubes_.emplace_back().at = at;
          cubes_.back().mean = p;
        }
        last = at, index = of_cube;
      }
      Cube& cube = cubes_[index];
      const Eigen::Vector3d d = p - cube.mean;
      cube.sum += d, cube.squares += d * d.transpose(), ++cube.count, ++candidates;
    }
    constexpr std::size_t kFits = 256;  // cubes, of the work of one thread
    cloud::for_each_chunk(cubes_.size(), kFits, 0, [&](std::size_t, std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) fit(cubes_[k]);
    });
    return candidates;
  }
  static void fit(Cube& cube) {
    const Eigen::Vector3d shift = cube.sum / cube.count;
    cube.mean += shift;
    cube.squares = cube.squares / cube.count - shift * shift.transpose();
    if (cube.count < kFewOfCube) return;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(cube.squares);
    const Eigen::Vector3d lambda = solver.eigenvalues();
    cube.flat = lambda[1] > kCube * kCube / 100 && lambda[0] < 0.1 * lambda[1];
    cube.normal = solver.eigenvectors().col(0);
    if (cube.normal.z() < 0) cube.normal = -cube.normal;
  }

  /// Takes the plane through the points of these cubes.
  void fit(const std::vector<std::uint32_t>& members, InclinedPlane& plane) const {
    double count = 0;
    plane.centre.setZero();
    for (const std::uint32_t i : members)
      plane.centre += cubes_[i].count * cubes_[i].mean, count += cubes_[i].count;
    plane.centre /= count;
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const std::uint32_t i : members) {
      const Eigen::Vector3d d = cubes_[i].mean - plane.centre;
      spread += cubes_[i].count * (cubes_[i].squares + d * d.transpose());
    }
    plane.normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0);
    if (plane.normal.z() < 0) plane.normal = -plane.normal;
  }

  /// The plane that goes on from cube to cube.
  std::optional<InclinedPlane> grow(std::uint32_t seed) {
    InclinedPlane plane;
    plane.centre = cubes_[seed].mean, plane.normal = cubes_[seed].normal;
    std::vector<std::uint32_t> members{seed};
    cubes_[seed].used = true;
    std::size_t refit = 8;
    for (std::size_t next = 0; next < members.size(); ++next) {
      number_.for_each_about(cubes_[members[next]].at, [&](std::uint32_t k) {
        Cube& cube = cubes_[k];
        if (cube.used || !cube.flat || std::abs(plane.off(cube.mean)) > InclinedPlane::kOn ||
            cube.normal.dot(plane.normal) < std::cos(kTurned))
          return;
        cube.used = true;
        members.push_back(k);
      });
      if (members.size() >= refit) fit(members, plane), refit *= 2;
    }
    constexpr double kCubesOfArea = 0.6;  // a plane cuts more cubes than its area has faces
    if (static_cast<double>(members.size()) * kCube * kCube < kCubesOfArea * kMinArea) return std::nullopt;
    fit(members, plane);
    if (!is_inclined(plane.normal)) return std::nullopt;
    plane.uphill = (Eigen::Vector3d::UnitZ() - plane.normal.z() * plane.normal).normalized();
    plane.left = plane.normal.cross(plane.uphill);
    for (const std::uint32_t i : members) plane.squares.insert(PlanesByPlace::square_of(cubes_[i].mean));
    return plane;
  }

  /// Of these planes the one that a point lies on, the nearest one; kNone: it lies on none.
  static std::uint32_t nearest(const std::vector<InclinedPlane>& planes, std::span<const std::uint32_t> here,
                               const Eigen::Vector3d& p) {
    std::uint32_t best = kNone;
    double off = InclinedPlane::kOn;
    for (const std::uint32_t r : here) {
      if (const double of_plane = std::abs(planes[r].off(p)); of_plane < off) best = r, off = of_plane;
    }
    return best;
  }

  /// What lies on, over and under each plane, and from where it was seen.
  std::vector<Measured> measure(const std::vector<InclinedPlane>& planes) const {
    const PlanesByPlace by_place(planes);
    tbb::combinable<std::vector<Measured>> of_threads([&] { return std::vector<Measured>(planes.size()); });
    const std::size_t samples = (cloud_.size() + stride_ - 1) / stride_;
    cloud::for_each_chunk(samples, kChunk, 0, [&](std::size_t, std::size_t begin, std::size_t end) {
      std::vector<Measured>& measured = of_threads.local();
      for (std::size_t k = begin; k < end; ++k) measure(k * stride_, planes, by_place, measured);
    });
    std::vector<Measured> sum(planes.size());
    of_threads.combine_each([&](const std::vector<Measured>& measured) {
      for (std::size_t r = 0; r < sum.size(); ++r) sum[r].add(measured[r]);
    });
    for (Measured& of_plane : sum)
      std::erase_if(of_plane.cells, [](const auto& c) { return c.second < kFewest; });
    return sum;
  }

  void measure(std::size_t i, const std::vector<InclinedPlane>& planes, const PlanesByPlace& by_place,
               std::vector<Measured>& measured) const {
    const Eigen::Vector3d p = cloud_.points[i].cast<double>();
    const Place square = PlanesByPlace::square_of(p);
    const std::span<const std::uint32_t> here = by_place.over(square);
    if (here.empty()) return;
    const std::uint32_t on = may_be_ceiling(labels_[i]) ? nearest(planes, here, p) : kNone;
    for (const std::uint32_t r : here) {
      Column& column = measured[r].columns[square];
      const double above = planes[r].off(p) / planes[r].normal.z();
      column.on += r == on ? 1 : 0;
      column.over += above > kOver ? 1 : 0;
      column.under += above < -kUnder ? 1 : 0;
      if (above < -kUnder && is_ground(static_cast<Label>(labels_[i])))
        column.floor = std::max(column.floor, p.z());
    }
    if (on == kNone) return;
    ++measured[on].cells[planes[on].cell_of(p)];
    measured[on].extent.extend(planes[on].at(p));
    if (cloud_.scans.size() != cloud_.size() || cloud_.scans[i] >= cloud_.viewpoints.size()) return;
    measured[on].placed += 1;
    measured[on].from_below += planes[on].off(cloud_.viewpoints[cloud_.scans[i]]) < 0 ? 1 : 0;
  }

  /// Fills in how sure it is.
  bool is_ceiling(const Measured& measured, InclinedPlane& plane) const {
    constexpr double kArea = InclinedPlane::kCell * InclinedPlane::kCell;
    if (static_cast<double>(plane.cells.size()) * kArea < kMinArea) return false;
    double seen = 0, overhangs = 0;
    std::vector<double> floors;
    for (const auto& [square, column] : measured.columns) {
      if (column.on < kFewest) continue;
      seen += 1;
      overhangs += column.under >= kFewest && 20 * column.over < column.on ? 1 : 0;
      if (column.floor > std::numeric_limits<double>::lowest()) floors.push_back(column.floor);
    }
    plane.confidence =
        measured.placed > 0 ? measured.from_below / measured.placed : overhangs / std::max(1.0, seen);
    if (plane.confidence < kFromBelow) return false;
    int lowest = std::numeric_limits<int>::max(), highest = std::numeric_limits<int>::min();
    for (const auto& [cell, points] : plane.cells)
      lowest = std::min(lowest, cell.second), highest = std::max(highest, cell.second + 1);
    const double floor = floors.empty() ? floor_ : quantile(floors, 0.5);
    return plane.height(highest) - plane.height(lowest) > kMinRise &&
           plane.height(highest) > floor + kHeadroom;
  }

  const cloud::PointCloud<Map>& cloud_;
  std::span<const std::uint8_t> labels_;
  std::size_t stride_ = 1;
  Eigen::Vector3d low_;
  double floor_ = 0;  ///< m, where no floor is known: the lower end of the cloud
  std::vector<Cube> cubes_;
  cloud::VoxelIndex number_;
};

}  // namespace

std::vector<InclinedPlane> find_inclined_planes(const cloud::PointCloud<Map>& cloud,
                                                std::span<const std::uint8_t> labels) {
  return PlaneFinder(cloud, labels).find();
}

}  // namespace parhelion::semantic
