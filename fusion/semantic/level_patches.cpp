#include "fusion/semantic/level_patches.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "fusion/cloud/parallel.hpp"
#include "fusion/cloud/voxel_index.hpp"

namespace parhelion::semantic {
namespace {

constexpr std::size_t kEnoughPoints = 1'000'000;  // more points change the result by less than the noise
constexpr double kReach = 1e5;                    // m; a patch number still fits

/// From sums to the plane through the points.
void fit_plane(PlanePatch& patch) {
  const Eigen::Vector3d shift = patch.sum / patch.count;
  patch.mean += shift;
  patch.squares = patch.squares / patch.count - shift * shift.transpose();
  if (patch.count < 6) return;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(patch.squares);
  const Eigen::Vector3d lambda = solver.eigenvalues();
  // Wide in both directions (variance of a full cube: a twelfth of its side squared), and flat.
  patch.planar = lambda[1] > kPatchSide * kPatchSide / 100 && lambda[0] < 0.1 * lambda[1];
  patch.normal = solver.eigenvectors().col(0);
}

}  // namespace

std::vector<PlanePatch> patches_of(const std::vector<Eigen::Vector3f>& points) {
  std::vector<PlanePatch> patches;
  cloud::VoxelIndex number;
  Eigen::Vector3i last = Eigen::Vector3i::Constant(-1);  // cube; points in sequence often share it
  std::uint32_t index = cloud::VoxelIndex::kNone;
  const std::size_t step = std::max<std::size_t>(1, points.size() / kEnoughPoints);
  for (std::size_t i = 0; i < points.size(); i += step) {
    const Eigen::Vector3d p = points[i].cast<double>();
    if (!(p.cwiseAbs().maxCoeff() < kReach)) continue;
    const Eigen::Vector3i cube = ((p.array() + kReach) / kPatchSide).cast<int>();  // positive
    if (cube != last) {
      std::uint32_t& of_cube = number[cube];
      if (of_cube == cloud::VoxelIndex::kNone) {
        of_cube = static_cast<std::uint32_t>(patches.size());
        patches.emplace_back();
      }
      last = cube, index = of_cube;
    }
    PlanePatch& patch = patches[index];
    if (patch.count == 0) patch.mean = p;  // sums are relative to the first point, to keep squares small
    const Eigen::Vector3d offset = p - patch.mean;
    patch.sum += offset;
    patch.squares += offset * offset.transpose();
    ++patch.count;
  }
  constexpr std::size_t kChunk = 256;
  cloud::for_each_chunk(patches.size(), kChunk, 0, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) fit_plane(patches[i]);
  });
  return patches;
}

bool is_upright(const Eigen::Vector3d& normal, const Eigen::Vector3d& up) {
  return std::abs(normal.dot(up)) < std::sin(kUprightWithin);
}

bool is_upright(const PlanePatch& patch, const Eigen::Vector3d& up) {
  return patch.planar && is_upright(patch.normal, up);
}

std::vector<PatchLayer> layers_of(const std::vector<PlanePatch>& patches, const Eigen::Vector3d& up,
                                  double thickness) {
  std::vector<double> heights;
  for (const PlanePatch& patch : patches) {
    if (patch.planar && std::abs(patch.normal.dot(up)) > std::cos(kLevelWithin))
      heights.push_back(patch.mean.dot(up));
  }
  std::sort(heights.begin(), heights.end());
  std::vector<PatchLayer> layers;
  while (!heights.empty()) {
    std::size_t begin = 0, max_count = 0, from = 0;
    for (std::size_t end = 0; end < heights.size(); ++end) {
      while (heights[end] - heights[begin] > thickness) ++begin;
      if (end + 1 - begin > max_count) {
        max_count = end + 1 - begin;
        from = begin;
      }
    }
    if (max_count < 4) break;
    const auto first = heights.begin() + static_cast<std::ptrdiff_t>(from);
    layers.push_back({first[static_cast<std::ptrdiff_t>(max_count / 2)], static_cast<int>(max_count)});
    heights.erase(first, first + static_cast<std::ptrdiff_t>(max_count));
    if (layers.size() == 8) break;
  }
  return layers;
}

}  // namespace parhelion::semantic
