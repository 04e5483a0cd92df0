#include "fusion/semantic/net/ground_layers.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <tuple>

#include "fusion/cloud/floor_index.hpp"
#include "fusion/cloud/parallel.hpp"
#include "fusion/cloud/voxel_index.hpp"
#include "protocols/model.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kSlice = 0.10;  // m, of height
constexpr int kMaxSlices = 2;
constexpr std::size_t kSamples = 3'000'000;  // points used
constexpr double kStray = 0.05;              // of a column's fullest slice: fewer points are outliers
constexpr double kFewest = 8;                // points of a plane
constexpr double kReach = 2e5;               // m: a cell number still fits
constexpr double kSteepest = 0.45;           // m of height per metre, between neighbouring layers

struct Slice {
  int x = 0, y = 0, z = 0;
  PlaneSums sums;
  double floor = 0;
};

/// Slices that hold points, by cell and height.
std::vector<Slice> slices_of(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels) {
  std::vector<Slice> slices;
  cloud::VoxelIndex number;
  Eigen::Vector3i last = Eigen::Vector3i::Zero();  // cube; points in sequence often share it
  std::uint32_t index = 0;
  const std::size_t stride = 1 + cloud.size() / kSamples;
  for (std::size_t i = 0; i < cloud.size(); i += stride) {
    const bool floor = labels[i] == static_cast<std::uint8_t>(EntityLabel::floor);
    if (!floor && labels[i] != static_cast<std::uint8_t>(EntityLabel::unknown)) continue;
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    if (!(p.cwiseAbs().maxCoeff() < kReach)) continue;
    const Eigen::Vector3i cube(cloud::floor_index(p.x() / GroundLayers::kCell),
                               cloud::floor_index(p.y() / GroundLayers::kCell),
                               cloud::floor_index(p.z() / kSlice));
    // Negative indices are not allowed; a site is smaller than this shift.
    constexpr int shift = 1 << (cloud::VoxelIndex::kBits - 1);
    if (cube.cwiseAbs().maxCoeff() >= shift) continue;
    if (slices.empty() || cube != last) {
      std::uint32_t& of_cube = number[cube.array() + shift];
      if (of_cube == cloud::VoxelIndex::kNone) {
        of_cube = static_cast<std::uint32_t>(slices.size());
        slices.push_back({cube.x(), cube.y(), cube.z(), {}, 0});
      }
      last = cube, index = of_cube;
    }
    slices[index].sums.add(p);
    slices[index].floor += floor ? 1 : 0;
  }
  std::sort(slices.begin(), slices.end(),
            [](const Slice& a, const Slice& b) { return std::tie(a.y, a.x, a.z) < std::tie(b.y, b.x, b.z); });
  return slices;
}

}  // namespace

void PlaneSums::add(const Eigen::Vector3d& p) {
  count += 1;
  sum += p;
  squares += p * p.transpose();
}

PlaneSums& PlaneSums::operator+=(const PlaneSums& other) {
  count += other.count;
  sum += other.sum;
  squares += other.squares;
  return *this;
}

std::optional<SlopedPlane> plane_through(const PlaneSums& sums) {
  constexpr double row = 0.03;  // m, least spread across a row of points
  if (sums.count < kFewest) return std::nullopt;
  const Eigen::Vector3d mean = sums.mean();
  const Eigen::Matrix3d spread = sums.squares / sums.count - mean * mean.transpose();
  const Eigen::Matrix2d plan = spread.topLeftCorner<2, 2>();
  const double trace = plan.trace(), determinant = plan.determinant();
  const double min_variance = trace / 2 - std::sqrt(std::max(0.0, trace * trace / 4 - determinant));
  if (!(min_variance > row * row)) return std::nullopt;
  SlopedPlane plane;
  plane.centre = mean;
  plane.slope = plan.ldlt().solve(spread.topRightCorner<2, 1>());
  plane.rms = std::sqrt(std::max(0.0, spread(2, 2) - plane.slope.dot(spread.topRightCorner<2, 1>())));
  return plane;
}

GroundLayers::GroundLayers(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels) {
  const std::vector<Slice> slices = slices_of(cloud, labels);
  for (std::size_t begin = 0, end = 0; begin < slices.size(); begin = end) {
    double fullest = 0;
    for (end = begin;
         end < slices.size() && slices[end].x == slices[begin].x && slices[end].y == slices[begin].y; ++end)
      fullest = std::max(fullest, slices[end].sums.count);
    const auto first = static_cast<std::uint32_t>(layers_.size());
    int top = 0, high = 0;  // of the layer that is being joined: its last slice, its number of slices
    for (std::size_t k = begin; k < end; ++k) {
      const Slice& slice = slices[k];
      if (slice.sums.count < kStray * fullest) continue;
      if (high > 0 && slice.z == top + 1) {
        layers_.back().sums += slice.sums;
        layers_.back().floor += slice.floor;
        ++high;
      } else {
        if (high > kMaxSlices) layers_.pop_back();
        layers_.push_back({slice.x, slice.y, slice.sums, slice.floor, {}});
        high = 1;
      }
      top = slice.z;
    }
    if (high > kMaxSlices) layers_.pop_back();
    if (layers_.size() > first)
      cells_[key(slices[begin].x, slices[begin].y)] = {first, static_cast<std::uint32_t>(layers_.size())};
  }
  find_slopes();
}

std::pair<std::uint32_t, std::uint32_t> GroundLayers::in_cell(int x, int y) const {
  const auto found = cells_.find(key(x, y));
  return found == cells_.end() ? std::pair<std::uint32_t, std::uint32_t>(0, 0) : found->second;
}

void GroundLayers::find_slopes() {
  constexpr int fewest = 5;  // layers around one
  constexpr std::size_t chunk = 256;
  cloud::for_each_chunk(layers_.size(), chunk, 0, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Layer& layer = layers_[i];
      PlaneSums sums = layer.sums;
      int around = 0;
      for_each_beside(layer, [&](std::uint32_t k) {
        const Layer& other = layers_[k];
        const Eigen::Vector3d apart = other.sums.mean() - layer.sums.mean();
        if (std::abs(apart.z()) > kSteepest * apart.head<2>().norm()) return;
        sums += other.sums;
        ++around;
      });
      if (around >= fewest) layer.around = plane_through(sums);
    }
  });
}

}  // namespace parhelion::semantic
