#include "fusion/semantic/standing_things.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace parhelion::semantic {
namespace {

constexpr double kStrongest = 3;       // octaves
constexpr double kUnconfirmed = 0.75;  // of the octaves, where one kind of evidence is all

bool is_level(const PlanePatch& patch, const Eigen::Vector3d& up) {
  return patch.planar && std::abs(patch.normal.dot(up)) > std::cos(kLevelWithin);
}

/// Of a thing, and large enough to be seen: not of a wall.
bool is_thing(const PlanePatch& patch, const Eigen::Vector3d& up) {
  return patch.count >= 6 &&
         !(patch.planar && std::abs(patch.normal.dot(up)) < std::sin(10 * kRadiansPerDegree));
}

/// log2 of a ratio of counts; a few more or less are no evidence.
double octaves(int standing, int hanging, double strongest) {
  constexpr double few = 10;
  return std::clamp(std::log2((standing + few) / (hanging + few)), -strongest, strongest);
}

/// Level plates at the height of seats and tables over the floor, and as far below the ceiling.
ThingCounts count_plates(const std::vector<PlanePatch>& patches, const std::vector<bool>& left_out,
                         const Eigen::Vector3d& up, const RoomHeights& room) {
  constexpr double lowest = 0.35, highest = 1.1;  // m
  const double reach = std::min(highest, (room.high - room.low) / 2);
  ThingCounts count;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    if (left_out[i] || !is_level(patches[i], up)) continue;
    const double height = patches[i].mean.dot(up);
    count.standing += height > room.low + lowest && height < room.low + reach;
    count.hanging += height < room.high - lowest && height > room.high - reach;
  }
  return count;
}

/// Cells of the plan, the size of a patch, in which a surface lies.
class Footprint {
 public:
  void add(double x, double y) { cells_.emplace_back(cell(y), cell(x)); }
  void sort() { std::sort(cells_.begin(), cells_.end()); }
  /// Whether the surface lies in the cell of a place or in one beside it.
  bool reaches(double x, double y) const {
    for (int row = cell(y) - 1; row <= cell(y) + 1; ++row) {
      const auto next = std::lower_bound(cells_.begin(), cells_.end(), std::pair(row, cell(x) - 1));
      if (next != cells_.end() && next->first == row && next->second <= cell(x) + 1) return true;
    }
    return false;
  }

 private:
  static int cell(double v) { return static_cast<int>(std::floor(v / kPatchSide)); }
  std::vector<std::pair<int, int>> cells_;  // y, x
};

/// Of a cloud without a ceiling, or without a floor; no table tops confirm it. Things
/// stand on the ground and are close to it; what is under a ceiling is farther away the more the lower it is.
double evidence_beside_surfaces(const std::vector<PlanePatch>& patches, const std::vector<bool>& left_out,
                                const Eigen::Vector3d& up, const std::vector<PatchLayer>& layers) {
  constexpr double same = 0.1, nearest = 0.2, near = 0.8, far = 1.2, farthest = 2.4;  // m from the surface
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
  ThingCounts close, away;
  for (const PatchLayer& layer : layers) {
    if (4 * layer.patches < layers[0].patches) continue;
    Footprint footprint;
    for (const PlanePatch& patch : patches) {
      const Eigen::Vector3d p = turn * patch.mean;
      if (is_level(patch, up) && std::abs(p.z() - layer.height) < same) footprint.add(p.x(), p.y());
    }
    footprint.sort();
    for (std::size_t i = 0; i < patches.size(); ++i) {
      if (left_out[i] || !is_thing(patches[i], up)) continue;
      const Eigen::Vector3d p = turn * patches[i].mean;
      const double height = p.z() - layer.height, distance = std::abs(height);
      if (distance < nearest || distance > farthest || !footprint.reaches(p.x(), p.y())) continue;
      ThingCounts& count = distance < near ? close : away;
      if (distance >= near && distance < far) continue;
      count.standing += height > 0, count.hanging += height < 0;
    }
  }
  const bool down = close.hanging > close.standing;
  const int beside = down ? close.hanging : close.standing, beyond = down ? away.hanging : away.standing;
  return 2 * beside < beyond ? 0 : kUnconfirmed * octaves(close.standing, close.hanging, 2 * kStrongest);
}

}  // namespace

RoomHeights room_heights(const std::vector<PatchLayer>& layers) {
  RoomHeights room{layers[0].height, layers[0].height};
  for (const PatchLayer& layer : layers) {
    if (4 * layer.patches < layers[0].patches) continue;
    room.low = std::min(room.low, layer.height);
    room.high = std::max(room.high, layer.height);
  }
  return room;
}

std::vector<bool> in_long_surfaces(const std::vector<PlanePatch>& patches, const Eigen::Vector3d& up,
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

ThingCounts count_things(const std::vector<PlanePatch>& patches, const std::vector<bool>& left_out,
                         const Eigen::Vector3d& up, const RoomHeights& room, double beside) {
  constexpr double tall = 1.2;  // m
  const double reach = std::min(tall, (room.high - room.low) / 2);
  ThingCounts count;
  for (std::size_t i = 0; i < patches.size(); ++i) {
    const PlanePatch& patch = patches[i];
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

double standing_evidence(const std::vector<PlanePatch>& patches, const Eigen::Vector3d& up) {
  constexpr double beside_beams = 0.4;  // m
  const std::vector<PatchLayer> layers = layers_of(patches, up);
  if (layers.empty()) return 0;
  const RoomHeights room = room_heights(layers);
  const std::vector<bool> left_out = in_long_surfaces(patches, up, room);
  if (room.high - room.low < kLowestSpace) return evidence_beside_surfaces(patches, left_out, up, layers);
  const ThingCounts things = count_things(patches, left_out, up, room, beside_beams),
                    plates = count_plates(patches, left_out, up, room);
  return octaves(things.standing, things.hanging, kStrongest) +
         octaves(plates.standing, plates.hanging, kStrongest);
}

}  // namespace parhelion::semantic
