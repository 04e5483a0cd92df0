#include "fusion/cloud/surfels.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "fusion/cloud/parallel.hpp"
#include "fusion/cloud/symmetric3.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::cloud {
namespace {

constexpr float kMinSlack = 1e-3f;     // Segal et al. 2009: variance along a plane's normal, of 1 within it
constexpr float kFlatSlack = 0.05f;    // up to here a surfel counts as planar
constexpr double kMinPlanePoints = 6;  // three give a plane, but not its error

}  // namespace

double Surfels::noise() const {
  std::vector<float> flat;
  for (std::size_t i = 0; i < count(); ++i) {
    if (thickness[i] >= 0 && slack[i] < kFlatSlack) flat.push_back(thickness[i]);
  }
  if (flat.empty()) return 0;
  return median(flat);
}

VoxelMoments::Cell& VoxelMoments::cell_at(const Eigen::Vector3i& index, std::uint32_t viewpoint) {
  std::uint32_t& number = index_[index];
  if (number == VoxelIndex::kNone) {
    number = static_cast<std::uint32_t>(cells_.size());
    cells_.push_back({Moments::Zero(), index, viewpoint});
  }
  return cells_[number];
}

VoxelMoments::VoxelMoments(std::span<const Eigen::Vector3f> points, double size,
                           std::span<const std::uint16_t> scans, std::span<const Eigen::Vector3d> viewpoints)
    : size_(size) {
  assert(size > 0);
  for (const Eigen::Vector3d& viewpoint : viewpoints) viewpoints_.push_back(viewpoint.cast<float>());
  Eigen::AlignedBox3f bounds;
  for (const Eigen::Vector3f& p : points) bounds.extend(p);
  if (points.empty()) return;
  // From index 1, so that a neighbour's index is never negative.
  size_ = std::max(size_, static_cast<double>(bounds.sizes().maxCoeff()) / ((1 << VoxelIndex::kBits) - 4));
  const auto side = static_cast<float>(size_);
  origin_ = bounds.min().array() - side;
  const float inverse = 1 / side;
  const Eigen::Vector3d origin = origin_.cast<double>();
  Eigen::Vector3i last = Eigen::Vector3i::Zero();  // an index that no point has
  Cell* cell = nullptr;
  for (std::size_t i = 0; i < points.size(); ++i) {
    // Rounding may place the lowest point just below 1.
    const Eigen::Vector3i index = ((points[i] - origin_) * inverse).cast<int>().cwiseMax(1);
    const Eigen::Vector3d p = points[i].cast<double>() - origin;
    if (index != last) cell = &cell_at(index, scans.empty() ? 0 : scans[i]);
    last = index;
    Moments& sum = cell->moments;
    sum[0] += 1;
    sum.segment<3>(1) += p.array();
    sum.segment<3>(4) += p.array().square();
    sum[7] += p.x() * p.y();
    sum[8] += p.x() * p.z();
    sum[9] += p.y() * p.z();
  }
}

VoxelMoments VoxelMoments::coarser() const {
  VoxelMoments result;
  result.size_ = 2 * size_;
  result.origin_ = origin_;
  result.viewpoints_ = viewpoints_;
  for (const Cell& cell : cells_) result.cell_at(cell.index / 2, cell.viewpoint).moments += cell.moments;
  return result;
}

VoxelMoments::Moments VoxelMoments::with_neighbours(const Cell& cell) const {
  std::array<std::uint32_t, 27> about;
  std::size_t count = 0;
  index_.for_each_about(cell.index, [&](std::uint32_t number) { about[count++] = number; });
  Moments sum = Moments::Zero();
  for (std::size_t i = 0; i < count; ++i) sum += cells_[about[i]].moments;
  return sum;
}

void VoxelMoments::make_surfel(std::size_t i, Surfels& surfels) const {
  const Cell& cell = cells_[i];
  const Eigen::Vector3d own = cell.moments.segment<3>(1) / cell.moments[0];
  const Eigen::Vector3f mean = (origin_.cast<double>() + own).cast<float>();
  surfels.means[i] = mean;
  const Moments about = with_neighbours(cell);
  const double n = about[0];
  if (n < kMinPlanePoints) return;
  const Eigen::Vector3d m = about.segment<3>(1) / n;
  const Eigen::Vector3d diagonal = about.segment<3>(4).matrix() / n - m.cwiseProduct(m);
  const Eigen::Vector3d beside =
      about.segment<3>(7).matrix() / n - Eigen::Vector3d(m.x() * m.y(), m.x() * m.z(), m.y() * m.z());
  const SmallestEigen eigen = smallest_eigen(diagonal.cwiseMax(0), beside);
  // Spread below the rounding error of floats counts as zero.
  if (!(eigen.middle > 1e-13 * m.squaredNorm())) return;
  const auto ratio = static_cast<float>(eigen.smallest / eigen.middle);
  surfels.slack[i] = std::clamp(ratio * ratio, kMinSlack, 1.0f);
  surfels.thickness[i] = static_cast<float>(std::sqrt(eigen.smallest));
  Eigen::Vector3f normal = eigen.vector.cast<float>();
  if (surfels.oriented && normal.dot(viewpoints_[cell.viewpoint] - mean) < 0) normal = -normal;
  surfels.normals[i] = normal;
}

Surfels VoxelMoments::surfels(int threads) const {
  constexpr std::size_t chunk = 1024;
  Surfels result;
  result.size = size_;
  result.oriented = !viewpoints_.empty();
  const std::size_t n = cells_.size();
  result.means.resize(n);
  result.normals.assign(n, Eigen::Vector3f::UnitZ());
  result.slack.assign(n, 1);
  result.thickness.assign(n, -1);
  for_each_chunk(n, chunk, threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) make_surfel(i, result);
  });
  return result;
}

}  // namespace parhelion::cloud
