#include "fusion/cloud/surfels.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>

namespace parhelion {
namespace {

constexpr float least_slack = 1e-3f;  // Segal et al. 2009: variance along a plane's normal, of 1 within it
constexpr float flat_slack = 0.05f;   // up to here a surfel is a piece of plane
constexpr float least_points_of_plane = 6;  // three give a plane, but say nothing about its error
constexpr int bits = 21;                    // of a key, an axis

}  // namespace

double Surfels::noise() const {
  std::vector<float> flat;
  for (std::size_t i = 0; i < count(); ++i) {
    if (thickness[i] >= 0 && slack[i] < flat_slack) flat.push_back(thickness[i]);
  }
  if (flat.empty()) return 0;
  const auto middle = flat.begin() + static_cast<std::ptrdiff_t>(flat.size() / 2);
  std::nth_element(flat.begin(), middle, flat.end());
  return *middle;
}

VoxelMoments::Table::Table(std::size_t expected) {
  int log2 = 8;
  while ((std::size_t{1} << log2) < 2 * expected) ++log2;
  shift_ = 64 - log2;
  keys_.assign(std::size_t{1} << log2, ~std::uint64_t{0});
  slots_.resize(keys_.size());
}

std::uint32_t VoxelMoments::Table::find(std::uint64_t key) const {
  const std::size_t mask = keys_.size() - 1;
  for (std::size_t at = (key * 0x9E3779B97F4A7C15ull) >> shift_;; at = (at + 1) & mask) {
    if (keys_[at] == key) return slots_[at];
    if (keys_[at] == ~std::uint64_t{0}) return none_;
  }
}

std::uint32_t VoxelMoments::Table::find_or_insert(std::uint64_t key, std::uint32_t next) {
  if (2 * used_ >= keys_.size()) grow();
  const std::size_t mask = keys_.size() - 1;
  std::size_t at = (key * 0x9E3779B97F4A7C15ull) >> shift_;
  for (; keys_[at] != ~std::uint64_t{0}; at = (at + 1) & mask) {
    if (keys_[at] == key) return slots_[at];
  }
  keys_[at] = key;
  slots_[at] = next;
  ++used_;
  return next;
}

void VoxelMoments::Table::grow() {
  Table larger(keys_.size());
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    if (keys_[i] != ~std::uint64_t{0}) larger.find_or_insert(keys_[i], slots_[i]);
  }
  *this = std::move(larger);
}

std::uint64_t VoxelMoments::key(const Eigen::Vector3i& index) {
  const auto part = [](int i) { return static_cast<std::uint64_t>(i) & ((1u << bits) - 1); };
  return part(index.x()) | part(index.y()) << bits | part(index.z()) << (2 * bits);
}

void VoxelMoments::Cell::add(const Cell& other, const Eigen::Vector3f& offset) {
  const Eigen::Vector3f &o = offset, &s = other.sum;
  square += other.square + 2 * o.cwiseProduct(s) + other.n * o.cwiseProduct(o);
  cross += other.cross +
           Eigen::Vector3f(o.x() * s.y() + o.y() * s.x(), o.x() * s.z() + o.z() * s.x(),
                           o.y() * s.z() + o.z() * s.y()) +
           other.n * Eigen::Vector3f(o.x() * o.y(), o.x() * o.z(), o.y() * o.z());
  sum += s + other.n * o;
  n += other.n;
}

VoxelMoments::VoxelMoments(std::span<const Eigen::Vector3f> points, double size,
                           std::span<const std::uint16_t> scans, std::span<const Eigen::Vector3d> viewpoints)
    : size_(size), table_(4096) {
  assert(size > 0);
  for (const Eigen::Vector3d& viewpoint : viewpoints) viewpoints_.push_back(viewpoint.cast<float>());
  Eigen::AlignedBox3f bounds;
  for (const Eigen::Vector3f& p : points) bounds.extend(p);
  if (points.empty()) return;
  // Index 1 and up, so that a neighbour's index is never negative.
  size_ = std::max(size_, static_cast<double>(bounds.sizes().maxCoeff()) / ((1 << bits) - 4));
  const auto side = static_cast<float>(size_);
  origin_ = bounds.min().array() - side;
  const float inverse = 1 / side;
  cell_of_point_.resize(points.size());
  std::uint64_t last_key = ~std::uint64_t{0};
  std::uint32_t slot = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3f p = points[i] - origin_;
    const Eigen::Vector3i index = (p * inverse).cast<int>();
    const std::uint64_t k = key(index);
    if (k != last_key) {
      slot = table_.find_or_insert(k, static_cast<std::uint32_t>(cells_.size()));
      last_key = k;
      if (slot == cells_.size()) {
        cells_.push_back({.index = index});
        if (!scans.empty()) cells_.back().viewpoint = scans[i];
      }
    }
    Cell& cell = cells_[slot];
    const Eigen::Vector3f d = p - centre(index);
    cell.n += 1;
    cell.sum += d;
    cell.square += d.cwiseProduct(d);
    cell.cross += Eigen::Vector3f(d.x() * d.y(), d.x() * d.z(), d.y() * d.z());
    cell_of_point_[i] = slot;
  }
}

VoxelMoments VoxelMoments::coarser() const {
  VoxelMoments result;
  result.size_ = 2 * size_;
  result.origin_ = origin_;
  result.viewpoints_ = viewpoints_;
  for (const Cell& cell : cells_) {
    const Eigen::Vector3i index = cell.index / 2;
    const std::uint32_t slot =
        result.table_.find_or_insert(key(index), static_cast<std::uint32_t>(result.cells_.size()));
    if (slot == result.cells_.size()) result.cells_.push_back({.index = index, .viewpoint = cell.viewpoint});
    result.cells_[slot].add(cell, centre(cell.index) - result.centre(index));
  }
  return result;
}

double VoxelMoments::points() const {
  double points = 0;
  for (const Cell& cell : cells_) points += cell.n;
  return points;
}

VoxelMoments::Cell VoxelMoments::with_neighbours(const Cell& cell) const {
  Cell sum{.index = cell.index};
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const Eigen::Vector3i step(dx, dy, dz);
        const std::uint32_t slot = table_.find(key(cell.index + step));
        if (slot != none_) sum.add(cells_[slot], step.cast<float>() * static_cast<float>(size_));
      }
    }
  }
  return sum;
}

Surfels VoxelMoments::surfels() const {
  Surfels result;
  result.size = size_;
  result.oriented = !viewpoints_.empty();
  const std::size_t n = cells_.size();
  result.means.resize(n);
  result.normals.assign(n, Eigen::Vector3f::UnitZ());
  result.slack.assign(n, 1);
  result.counts.resize(n);
  result.thickness.assign(n, -1);
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
  for (std::size_t i = 0; i < n; ++i) {
    const Cell& cell = cells_[i];
    const Eigen::Vector3f mean = origin_ + centre(cell.index) + cell.sum / cell.n;
    result.means[i] = mean;
    result.counts[i] = cell.n;
    const Cell about = with_neighbours(cell);
    if (about.n < least_points_of_plane) continue;
    const Eigen::Vector3f m = about.sum / about.n;
    Eigen::Matrix3f C;
    C.diagonal() = about.square / about.n - m.cwiseProduct(m);
    C(0, 1) = C(1, 0) = about.cross.x() / about.n - m.x() * m.y();
    C(0, 2) = C(2, 0) = about.cross.y() / about.n - m.x() * m.z();
    C(1, 2) = C(2, 1) = about.cross.z() / about.n - m.y() * m.z();
    solver.computeDirect(C);
    const Eigen::Vector3f variances = solver.eigenvalues().cwiseMax(0);
    if (!(variances.y() > 0)) continue;
    const float ratio = variances.x() / variances.y();
    result.slack[i] = std::clamp(ratio * ratio, least_slack, 1.0f);
    result.thickness[i] = std::sqrt(variances.x());
    Eigen::Vector3f normal = solver.eigenvectors().col(0);
    if (result.oriented && normal.dot(viewpoints_[cell.viewpoint] - mean) < 0) normal = -normal;
    result.normals[i] = normal;
  }
  return result;
}

}  // namespace parhelion
