#include "fusion/semantic/upside_down.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <numbers>
#include <sstream>
#include <utility>

namespace parhelion::semantic {
namespace {

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

/// Patches of things close above the bottom and close below the top of a cloud, without those nearer than
/// `beside` (m) and the ones left out. Walls count as neither, nor do things too thin to be seen.
struct ThingCounts {
  int standing = 0, hanging = 0;
};

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
std::string what_hangs(const std::vector<PlanePatch>& patches, const std::vector<Eigen::Vector3d>& viewpoints,
                       const Eigen::Vector3d& up) {
  constexpr double room_height = 1.8, beside = 0.2, beside_beams = 0.4;  // m
  const std::vector<PatchLayer> layers = layers_of(patches, up);
  if (layers.size() < 2) return "";
  // The lowest and the highest of the wide layers.
  RoomHeights room{layers[0].height, layers[0].height};
  for (const PatchLayer& layer : layers) {
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

std::string why_upside_down(const cloud::PointCloud<Cloud>& cloud, const std::vector<PlanePatch>& patches,
                            const Eigen::Vector3d& up) {
  return saw_overhead(cloud, up) ? "" : what_hangs(patches, cloud.viewpoints, up);
}

}  // namespace parhelion::semantic
