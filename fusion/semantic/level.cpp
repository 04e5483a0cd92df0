// Finds the up direction: most planar patches of a building are level or upright, and its floors are wide.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <span>
#include <sstream>
#include <utility>

#include "fusion/cloud/parallel.hpp"
#include "fusion/cloud/voxel_index.hpp"
#include "fusion/semantic/segmentation/segmentation.hpp"
#include "protocols/angle_units.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr std::size_t kEnoughPoints = 1'000'000;  // more points change the result by less than the noise
constexpr double kPatchSide = 0.25;               // m; less than the tread of a step
constexpr double kReach = 1e5;                    // m; a patch number still fits
constexpr double kLevelWithin = 6 * kRadiansPerDegree;
constexpr double kUprightWithin = 4 * kRadiansPerDegree;
constexpr double kMaxTilt = 40 * kRadiansPerDegree;

struct Patch {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  int count = 0;

  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), normal = Eigen::Vector3d::Zero();
  bool planar = false;
};

/// From sums to the plane through the points.
void fit_plane(Patch& patch) {
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

/// Cubes of the cloud with the plane through the points of each; in the order of first appearance.
std::vector<Patch> patches_of(const std::vector<Eigen::Vector3f>& points) {
  std::vector<Patch> patches;
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
    Patch& patch = patches[index];
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

bool is_upright(const Patch& patch, const Eigen::Vector3d& up) {
  return patch.planar && is_upright(patch.normal, up);
}

/// The direction within `kMaxTilt` of the hint to which the most planar patches are normal; zero where there
/// is none.
Eigen::Vector3d dominant_normal(const std::vector<Patch>& patches, const Eigen::Vector3d& hint) {
  constexpr double width = 4 * kRadiansPerDegree;
  std::vector<Eigen::Vector3d> faced, planar;  // close together: each vote reads all of them
  for (const Patch& patch : patches) {
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
std::optional<Eigen::Vector3d> level_squares(const std::vector<Patch>& patches, const Eigen::Vector3d& up) {
  constexpr double side = 1, apart = 0.06;  // m, of a square; between the heights of two floors
  constexpr std::size_t fewest = 6;         // squares
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
  std::map<std::pair<int, int>, std::vector<Eigen::Vector3d>> squares;
  for (const Patch& patch : patches) {
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

struct Layer {
  double height = 0;  ///< m
  int patches = 0;
};

/// Heights of level patches, those with the most patches first.
std::vector<Layer> layers_of(const std::vector<Patch>& patches, const Eigen::Vector3d& up,
                             double thickness = 0.10) {
  std::vector<double> heights;
  for (const Patch& patch : patches) {
    if (patch.planar && std::abs(patch.normal.dot(up)) > std::cos(kLevelWithin))
      heights.push_back(patch.mean.dot(up));
  }
  std::sort(heights.begin(), heights.end());
  std::vector<Layer> layers;
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

/// How far level patches lie in a few thin layers: the sum of the squares of their numbers. A direction that
/// is right has the most.
double concentration(const std::vector<Patch>& patches, const Eigen::Vector3d& up) {
  constexpr double thickness = 0.03;  // m
  double sum = 0;
  for (const Layer& layer : layers_of(patches, up, thickness)) sum += std::pow(layer.patches, 2);
  return sum;
}

/// One plane direction for all layers together, each about its own centre, perpendicular to upright patches:
/// wide layers decide, and walls where there are none. The band that counts as a layer narrows to the noise.
Eigen::Vector3d fit_layers(const std::vector<Patch>& patches, Eigen::Vector3d up) {
  constexpr double noise_height = 0.02;  // m, of a patch's centre: floors are not more accurate
  constexpr double noise_turn = 3 * kRadiansPerDegree;  // of its normal
  for (const double band : {0.15, 0.08, 0.05, 0.05, 0.05}) {
    Eigen::Matrix3d together = Eigen::Matrix3d::Zero();  // both kinds in units of their own noise
    for (const Patch& patch : patches) {
      if (is_upright(patch, up))
        together += patch.normal * patch.normal.transpose() / (noise_turn * noise_turn);
    }
    for (const Layer& layer : layers_of(patches, up)) {
      Patch all;
      for (const Patch& patch : patches) {
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
Eigen::Vector3d up_of(const std::vector<Patch>& patches, const Eigen::Vector3d& faced) {
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
Eigen::Vector3d pivot_of(const std::vector<Patch>& patches, const Eigen::Vector3d& up) {
  Eigen::Vector3d pivot;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<std::pair<double, int>> values;
    std::int64_t total = 0, passed = 0;
    for (const Patch& patch : patches) {
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

/// Ratio of hanging to standing points above which a cloud counts as upside down. Scanners usually stand low,
/// so viewpoints in the upper half of the room lower the ratio.
double needed_fraction(const std::vector<Eigen::Vector3d>& viewpoints, const Eigen::Vector3d& up, double low,
                       double high) {
  if (viewpoints.empty()) return 1.5;
  double sum = 0;
  for (const Eigen::Vector3d& viewpoint : viewpoints) sum += (viewpoint.dot(up) - low) / (high - low);
  const double height = sum / static_cast<double>(viewpoints.size());
  return height < 0.45 ? 2 : height > 0.55 ? 1.2 : 1.5;
}

/// m along up: the lowest and the highest wide layer of a cloud.
struct RoomHeights {
  double low = 0, high = 0;
};

/// Whether each patch is part of a level surface that is longer than furniture: a lowered ceiling, a landing.
std::vector<bool> in_long_surfaces(const std::vector<Patch>& patches, const Eigen::Vector3d& up,
                                   const RoomHeights& room) {
  constexpr double kLong = 4, kMargin = 0.15, kStep = 0.1;  // m
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
  std::map<std::pair<int, int>, std::vector<std::size_t>> cells;
  std::vector<Eigen::Vector3d> places(patches.size());
  const auto cell_of = [](const Eigen::Vector3d& p) {
    return std::pair(static_cast<int>(std::floor(p.x() / kPatchSide)),
                     static_cast<int>(std::floor(p.y() / kPatchSide)));
  };
  for (std::size_t i = 0; i < patches.size(); ++i) {
    places[i] = turn * patches[i].mean;
    if (patches[i].planar && std::abs(patches[i].normal.dot(up)) > std::cos(kLevelWithin) &&
        places[i].z() > room.low + kMargin && places[i].z() < room.high - kMargin)
      cells[cell_of(places[i])].push_back(i);
  }
  std::vector<bool> seen(patches.size()), long_ones(patches.size());
  for (const auto& [cell, members] : cells) {
    for (const std::size_t seed : members) {
      if (seen[seed]) continue;
      std::vector<std::size_t> part{seed};
      seen[seed] = true;
      Eigen::AlignedBox2d plan;
      for (std::size_t k = 0; k < part.size(); ++k) {
        const Eigen::Vector3d p = places[part[k]];
        plan.extend(p.head<2>().eval());
        const auto [x, y] = cell_of(p);
        for (int n = 0; n < 9; ++n) {
          const auto found = cells.find({x + n % 3 - 1, y + n / 3 - 1});
          if (found == cells.end()) continue;
          for (const std::size_t next : found->second) {
            if (seen[next] || std::abs(places[next].z() - p.z()) > kStep) continue;
            seen[next] = true;
            part.push_back(next);
          }
        }
      }
      for (const std::size_t i : part) long_ones[i] = plan.sizes().maxCoeff() > kLong;
    }
  }
  return long_ones;
}

/// Patches of things close above the bottom and close below the top of a cloud, without those nearer than
/// `beside` (m) and the ones left out. Walls count as neither, nor do things too thin to be seen.
struct ThingCounts {
  int standing = 0, hanging = 0;
};

ThingCounts count_things(const std::vector<Patch>& patches, const std::vector<bool>& left_out,
                         const Eigen::Vector3d& up, const RoomHeights& room, double beside) {
  constexpr double tall = 1.2;  // m
  const double reach = std::min(tall, (room.high - room.low) / 2);
  ThingCounts count;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const Patch& patch = patches[i];
    if (patch.count < 6 ||
        (patch.planar && std::abs(patch.normal.dot(up)) < std::sin(10 * kRadiansPerDegree)) ||
        (!left_out.empty() && left_out[i]))
      continue;
    const double height = patch.mean.dot(up);
    count.standing += height > room.low + beside && height < room.low + reach;
    count.hanging += height < room.high - beside && height > room.high - reach;
  }
  return count;
}

/// Whether the scanners stood: they saw what is over them, and nothing under their tripods but the ground
/// around. Upside down it is the other way round. Scanners that see both, or that look down from above, tell
/// nothing, nor do cameras: where one looks is no property of the building.
bool saw_overhead(const cloud::PointCloud<Cloud>& cloud, const Eigen::Vector3d& up) {
  constexpr double steep = 0.9, sideways = 0.3;  // sine of the angle to the level
  constexpr double seldom = 0.02, around = 0.1;  // of the steep rays; of all
  constexpr double enough = 100;                 // rays
  constexpr int sectors = 16, all_around = 14;   // of the horizon
  struct View {
    double over = 0, under = 0, below = 0, all = 0;
    std::uint32_t seen = 0;  // a bit for each sector
  };
  std::vector<View> views(cloud.viewpoints.size());
  const Eigen::Vector3d east = up.unitOrthogonal(), north = up.cross(east);
  const std::size_t step = 1 + cloud.size() / 200'000;
  for (std::size_t i = 0; i < cloud.size(); i += step) {
    const std::size_t view = cloud.scans.empty() ? 0 : cloud.scans[i];
    if (view >= views.size()) continue;
    View& of_view = views[view];
    const Eigen::Vector3d ray = cloud.points[i].cast<double>() - cloud.viewpoints[view];
    const double sine = ray.dot(up) / std::max(ray.norm(), 1e-6);
    of_view.over += sine > steep, of_view.under += sine < -steep, of_view.below += sine < -sideways;
    of_view.all += 1;
    if (std::abs(sine) > steep) continue;
    const double turn = std::atan2(ray.dot(north), ray.dot(east)) / (2 * std::numbers::pi) + 0.5;
    of_view.seen |= 1U << std::min(static_cast<int>(turn * sectors), sectors - 1);
  }
  View sum;
  for (const View& view : views) {
    if (std::popcount(view.seen) < all_around) continue;
    sum.over += view.over, sum.under += view.under, sum.below += view.below, sum.all += view.all;
  }
  return sum.over > enough && sum.under < seldom * sum.over && sum.below > around * sum.all;
}

/// Things stand on floors and few hang from ceilings: the evidence for an upside-down cloud, or nothing.
/// Beams, ducts and lamps are up to 0.4 m high, seats and beds begin there; a lowered ceiling is no thing.
std::string what_hangs(const std::vector<Patch>& patches, const std::vector<Eigen::Vector3d>& viewpoints,
                       const Eigen::Vector3d& up) {
  constexpr double room_height = 1.8, beside = 0.2, beside_beams = 0.4;  // m
  const std::vector<Layer> layers = layers_of(patches, up);
  if (layers.size() < 2) return "";
  // The lowest and the highest of the wide layers.
  RoomHeights room{layers[0].height, layers[0].height};
  for (const Layer& layer : layers) {
    if (4 * layer.patches < layers[0].patches) continue;
    room.low = std::min(room.low, layer.height);
    room.high = std::max(room.high, layer.height);
  }
  if (room.high - room.low < room_height) return "";
  const double needed = needed_fraction(viewpoints, up, room.low, room.high);
  const auto seems_flipped = [&](const ThingCounts& count) {
    return count.hanging >= 20 && count.hanging >= needed * count.standing;
  };
  const ThingCounts all = count_things(patches, {}, up, room, beside);
  if (!seems_flipped(all)) return "";
  const ThingCounts things =
      count_things(patches, in_long_surfaces(patches, up, room), up, room, beside_beams);
  if (!seems_flipped(things)) return "";
  std::ostringstream words;
  words << "the cloud seems to be upside down: " << all.hanging << " patches close below its top, "
        << all.standing << " close above its bottom; expected fewer at the top: give the up direction";
  return words.str();
}

}  // namespace

Result<Transform<Map, Cloud>> level(const cloud::PointCloud<Cloud>& cloud, const Eigen::Vector3d& up_hint,
                                    bool trust_hint, bool* upside_down) {
  if (cloud.empty()) return Error{"levelling: the cloud is empty; expected the points of a scan"};
  if (!(std::abs(up_hint.norm() - 1) < 1e-3))
    return Error{"levelling: the up direction has length " + std::to_string(up_hint.norm()) + "; expected 1"};
  const std::vector<Patch> patches = patches_of(cloud.points);
  const Eigen::Vector3d faced = dominant_normal(patches, up_hint);
  if (faced.isZero()) {
    const auto planar =
        std::count_if(patches.begin(), patches.end(), [](const Patch& p) { return p.planar; });
    return Error{"levelling: no level surface within 40 degrees of the up direction; saw " +
                 std::to_string(planar) + " planar patches of " + std::to_string(patches.size()) +
                 " (0.25 m cubes): give the up direction of an accelerometer, or check the unit (metres)"};
  }
  const Eigen::Vector3d up = up_of(patches, faced);
  if (!trust_hint && !saw_overhead(cloud, up)) {
    const std::string why = what_hangs(patches, cloud.viewpoints, up);
    if (upside_down != nullptr) *upside_down = !why.empty();
    if (!why.empty()) return Error{"levelling: " + why};
  }
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d pivot = pivot_of(patches, up);
  return Transform<Map, Cloud>(turn, pivot - turn * pivot);
}

}  // namespace parhelion::semantic
