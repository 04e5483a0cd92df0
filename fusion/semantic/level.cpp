// Finds the up direction: most planar patches of a building are level or upright, and its floors are wide.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <span>
#include <utility>

#include "fusion/semantic/level_patches.hpp"
#include "fusion/semantic/segmentation/segmentation.hpp"
#include "fusion/semantic/upside_down.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kMaxTilt = 40 * kRadiansPerDegree;

/// The direction within `kMaxTilt` of the hint to which the most planar patches are normal; zero where there
/// is none.
Eigen::Vector3d dominant_normal(const std::vector<PlanePatch>& patches, const Eigen::Vector3d& hint) {
  constexpr double width = 4 * kRadiansPerDegree;
  std::vector<Eigen::Vector3d> faced, planar;  // close together: each vote reads all of them
  for (const PlanePatch& patch : patches) {
    if (!patch.planar) continue;
    planar.push_back(patch.normal);
    const double along = patch.normal.dot(hint);
    if (std::abs(along) > std::cos(kMaxTilt)) faced.push_back(along > 0 ? patch.normal : -patch.normal);
  }
  // Upright patches vote with half weight, since many more directions are perpendicular to them.
  const auto votes = [&](const Eigen::Vector3d& up) {
    const auto level_ones = std::count_if(
        faced.begin(), faced.end(), [&](const Eigen::Vector3d& n) { return n.dot(up) > std::cos(width); });
    if (level_ones < 4) return std::ptrdiff_t{0};
    const auto upright = std::count_if(planar.begin(), planar.end(),
                                       [&](const Eigen::Vector3d& n) { return is_upright(n, up); });
    return 2 * level_ones + upright;
  };
  Eigen::Vector3d best = Eigen::Vector3d::Zero();
  std::ptrdiff_t max_count = 0;
  const std::size_t step = std::max<std::size_t>(1, faced.size() / 200);
  for (std::size_t i = 0; i < faced.size(); i += step) {
    const auto count = votes(faced[i]);
    if (count > max_count) {
      max_count = count;
      best = faced[i];
    }
  }
  for (int round = 0; round < 5 && max_count > 0; ++round) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& n : faced) {
      if (n.dot(best) > std::cos(width)) sum += n;
    }
    best = sum.normalized();
  }
  return best;
}

/// Slope (height per metre along two level axes) of the patches that lie in one square of the plan at about
/// one height; nullopt: too few, in a row, or with a step among them.
std::optional<Eigen::Vector2d> slope_of(std::span<const Eigen::Vector3d> patches) {
  constexpr std::size_t fewest = 8;
  if (patches.size() < fewest) return std::nullopt;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : patches) mean += p / static_cast<double>(patches.size());
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  Eigen::Vector2d with_height = Eigen::Vector2d::Zero();
  for (const Eigen::Vector3d& p : patches) {
    const Eigen::Vector3d d = p - mean;
    squares += d.head<2>() * d.head<2>().transpose();
    with_height += d.head<2>() * d.z();
  }
  const double min_spread = static_cast<double>(patches.size()) * kPatchSide * kPatchSide / 4;
  if (Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(squares).eigenvalues()[0] < min_spread)
    return std::nullopt;
  return squares.ldlt().solve(with_height);
}

/// The up direction by the median slope of level squares of a metre. Planes through whole floors would be
/// tilted by a step between two of them, such as a kerb; few squares hold one.
std::optional<Eigen::Vector3d> level_squares(const std::vector<PlanePatch>& patches,
                                             const Eigen::Vector3d& up) {
  constexpr double side = 1, apart = 0.06;  // m, of a square; between the heights of two floors
  constexpr std::size_t fewest = 6;         // squares
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
  std::map<std::pair<int, int>, std::vector<Eigen::Vector3d>> squares;
  for (const PlanePatch& patch : patches) {
    if (!patch.planar || std::abs(patch.normal.dot(up)) < std::cos(kLevelWithin)) continue;
    const Eigen::Vector3d p = turn * patch.mean;
    squares[{static_cast<int>(std::floor(p.x() / side)), static_cast<int>(std::floor(p.y() / side))}]
        .push_back(p);
  }
  std::vector<double> along_x, along_y;
  for (auto& [place, all] : squares) {
    std::sort(all.begin(), all.end(),
              [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return a.z() < b.z(); });
    for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
      for (end = begin + 1; end < all.size() && all[end].z() - all[end - 1].z() < apart;) ++end;
      const auto slope = slope_of(std::span(all).subspan(begin, end - begin));
      if (!slope) continue;
      along_x.push_back(slope->x());
      along_y.push_back(slope->y());
    }
  }
  if (along_x.size() < fewest) return std::nullopt;
  const Eigen::Vector3d normal(-quantile(along_x, 0.5), -quantile(along_y, 0.5), 1);
  return turn.conjugate() * normal.normalized();
}

/// How far level patches lie in a few thin layers: the sum of the squares of their numbers. A direction that
/// is right has the most.
double concentration(const std::vector<PlanePatch>& patches, const Eigen::Vector3d& up) {
  constexpr double thickness = 0.03;  // m
  double sum = 0;
  for (const PatchLayer& layer : layers_of(patches, up, thickness)) sum += std::pow(layer.patches, 2);
  return sum;
}

/// One plane direction for all layers together, each about its own centre, perpendicular to upright patches:
/// wide layers decide, and walls where there are none. The band that counts as a layer narrows to the noise.
Eigen::Vector3d fit_layers(const std::vector<PlanePatch>& patches, Eigen::Vector3d up) {
  constexpr double noise_height = 0.02;  // m, of a patch's centre: floors are not more accurate
  constexpr double noise_turn = 3 * kRadiansPerDegree;  // of its normal
  for (const double band : {0.15, 0.08, 0.05, 0.05, 0.05}) {
    Eigen::Matrix3d together = Eigen::Matrix3d::Zero();  // both kinds in units of their own noise
    for (const PlanePatch& patch : patches) {
      if (is_upright(patch, up))
        together += patch.normal * patch.normal.transpose() / (noise_turn * noise_turn);
    }
    for (const PatchLayer& layer : layers_of(patches, up)) {
      PlanePatch all;
      for (const PlanePatch& patch : patches) {
        if (!patch.planar || std::abs(patch.normal.dot(up)) < std::cos(kLevelWithin) ||
            std::abs(patch.mean.dot(up) - layer.height) > band)
          continue;
        all.sum += patch.mean;
        all.squares += patch.mean * patch.mean.transpose();
        ++all.count;
      }
      if (all.count >= 4) {
        together += (all.squares - all.sum * all.sum.transpose() / all.count) / (noise_height * noise_height);
      }
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(together);
    if (solver.eigenvalues()[1] <= 0) return up;  // a single row of patches: no plane
    const Eigen::Vector3d normal = solver.eigenvectors().col(0);
    if (std::abs(normal.dot(up)) < std::cos(kLevelWithin)) return up;
    up = normal.dot(up) > 0 ? normal : -normal;
  }
  return up;
}

/// The fit to whole layers is the most accurate, but a step too low for two layers tilts it; then the fit
/// that starts at the slope of squares, or this slope itself, puts clearly more patches into thin layers.
Eigen::Vector3d up_of(const std::vector<PlanePatch>& patches, const Eigen::Vector3d& faced) {
  constexpr double clearly = 1.15;
  Eigen::Vector3d best = fit_layers(patches, faced);
  const auto by_squares = level_squares(patches, faced);
  if (!by_squares) return best;
  double max_value = concentration(patches, best);
  for (const Eigen::Vector3d& up : {fit_layers(patches, *by_squares), *by_squares}) {
    const double value = concentration(patches, up);
    if (value > clearly * max_value) best = up, max_value = value;
  }
  return best;
}

/// The centre of the level points: heights there are unchanged.
Eigen::Vector3d pivot_of(const std::vector<PlanePatch>& patches, const Eigen::Vector3d& up) {
  Eigen::Vector3d pivot;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<std::pair<double, int>> values;
    std::int64_t total = 0, passed = 0;
    for (const PlanePatch& patch : patches) {
      if (!patch.planar || std::abs(patch.normal.dot(up)) < std::cos(kLevelWithin)) continue;
      values.emplace_back(patch.mean[axis], patch.count);
      total += patch.count;
    }
    std::sort(values.begin(), values.end());
    std::size_t i = 0;
    while (i + 1 < values.size() && 2 * (passed + values[i].second) < total) passed += values[i++].second;
    pivot[axis] = values.empty() ? 0 : values[i].first;
  }
  return pivot;
}

}  // namespace

Result<Transform<Map, Cloud>> level(const cloud::PointCloud<Cloud>& cloud, const Eigen::Vector3d& up_hint,
                                    bool trust_hint, UpDoubt* doubt) {
  if (cloud.empty()) return Error{"levelling: the cloud is empty; expected the points of a scan"};
  if (!(std::abs(up_hint.norm() - 1) < 1e-3))
    return Error{"levelling: the up direction has length " + std::to_string(up_hint.norm()) + "; expected 1"};
  const std::vector<PlanePatch> patches = patches_of(cloud.points);
  const Eigen::Vector3d faced = dominant_normal(patches, up_hint);
  if (faced.isZero()) {
    const auto planar =
        std::count_if(patches.begin(), patches.end(), [](const PlanePatch& p) { return p.planar; });
    return Error{"levelling: no level surface within 40 degrees of the up direction; saw " +
                 std::to_string(planar) + " planar patches of " + std::to_string(patches.size()) +
                 " (0.25 m cubes): give the up direction of an accelerometer, or check the unit (metres)"};
  }
  const Eigen::Vector3d up = up_of(patches, faced);
  if (!trust_hint) {
    const std::string why = why_upside_down(cloud, patches, up);
    if (doubt != nullptr) {
      doubt->refused = !why.empty();
      doubt->note = why.empty() ? doubt_of_up(cloud, patches, up) : "";
    }
    if (!why.empty()) return Error{"levelling: " + why};
  }
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d pivot = pivot_of(patches, up);
  return Transform<Map, Cloud>(turn, pivot - turn * pivot);
}

}  // namespace parhelion::semantic
