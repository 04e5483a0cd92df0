#include "fusion/semantic/net/find_ramps.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <string>

#include "fusion/semantic/net/ground_layers.hpp"
#include "fusion/semantic/net/measure_ramp.hpp"
#include "protocols/quantile.hpp"

namespace parhelion::semantic {
namespace {

constexpr double kGentlest = 0.05, kSteepest = 0.364;  // m of height per metre: 1:20, 20 degrees
constexpr double kUneven = 0.03;                       // m, RMS of a plane
constexpr double kBend = 0.07;                         // change of slope from cell to cell
constexpr double kShortest = 0.5, kNarrowest = 0.4, kLowest = 0.08;  // m
constexpr double kLevel = 0.04;                                      // slope of a floor
constexpr double kFilled = 0.55;                                     // of the ramp's rectangle
constexpr double kWellFilled = 0.75;                                 // then its plane may be uneven
constexpr double kOverUneven = 15;   // else its rise, in RMS of its plane: streets are uneven
constexpr double kJoined = 0.4;      // of an end's width that must meet a floor
constexpr double kBeyond = 0.8;      // m, from the inclined cells to the end of the ramp
constexpr double kOnPlate = 0.3;     // m, from the upper end
constexpr std::size_t kFewest = 12;  // inclined cells, of 1/16 m^2
constexpr double kThick = 0.10;      // m, of its box

using Layers = std::vector<std::uint32_t>;

/// Coordinates on a plane: u goes uphill, v to the left of it; m, in the plan, from its centre.
struct RampFrame {
  SlopedPlane plane;
  Eigen::Vector2d uphill, left;

  explicit RampFrame(const SlopedPlane& through)
      : plane(through), uphill(through.slope.normalized()), left(-uphill.y(), uphill.x()) {}
  Eigen::Vector2d at(const Eigen::Vector2d& p) const {
    const Eigen::Vector2d from = p - plane.centre.head<2>();
    return {uphill.dot(from), left.dot(from)};
  }
  Eigen::Vector2d place(double u, double v) const { return plane.centre.head<2>() + u * uphill + v * left; }
  double slope() const { return plane.slope.norm(); }
  double height(double u) const { return plane.centre.z() + slope() * u; }
  double u_of(double height) const { return (height - plane.centre.z()) / slope(); }
};

struct Range {
  double low = std::numeric_limits<double>::max(), high = std::numeric_limits<double>::lowest();
  void add(double v) { low = std::min(low, v), high = std::max(high, v); }
  double size() const { return high - low; }
  bool contains(double v) const { return v > low && v < high; }
};

struct Ramp {
  RampFrame frame;
  Range u, v;
  double filled = 0;
  int joined_ends = 0;
  double floor = 0;                        ///< m, height of the floor at its lower end, else at its upper one
  std::optional<Eigen::Vector3d> landing;  ///< on a level plate at its upper end that is not called floor
};

class RampFinder {
 public:
  RampFinder(const cloud::PointCloud<Map>& cloud, std::span<const std::uint8_t> labels, double voxel)
      : ground_(cloud, labels),
        region_of_(ground_.layers().size(), kNone),
        visited_(ground_.layers().size(), kNone),
        taken_(ground_.layers().size()),
        shortest_(std::max(kShortest, 12 * voxel)),
        lowest_(std::max(kLowest, 2.5 * voxel)) {}

  /// The largest first: what lies across the edge of one is none.
  std::vector<Ramp> find() {
    std::vector<Layers> regions;
    for (std::uint32_t seed = 0; seed < region_of_.size(); ++seed) {
      if (region_of_[seed] == kNone && is_inclined(layer(seed))) regions.push_back(grow(seed));
    }
    std::stable_sort(regions.begin(), regions.end(),
                     [](const Layers& a, const Layers& b) { return a.size() > b.size(); });
    std::vector<Ramp> ramps;
    for (Layers& region : regions) {
      std::erase_if(region, [&](std::uint32_t i) { return taken_[i]; });
      if (region.size() < kFewest) continue;
      if (auto ramp = ramp_of(region)) ramps.push_back(*ramp);
    }
    return ramps;
  }

 private:
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};
  using Layer = GroundLayers::Layer;
  const Layer& layer(std::uint32_t i) const { return ground_.layers()[i]; }

  static bool is_inclined(const Layer& layer) {
    if (!layer.around) return false;
    const double slope = layer.around->slope.norm();
    return slope > kGentlest && slope < kSteepest && layer.around->rms < kUneven;
  }

  /// Cells around the seed whose slope is about that of the region so far.
  Layers grow(std::uint32_t seed) {
    Layers region{seed};
    region_of_[seed] = seed;
    Eigen::Vector2d sum = layer(seed).around->slope;
    for (std::size_t next = 0; next < region.size(); ++next) {
      const Layer& from = layer(region[next]);
      ground_.for_each_beside(from, [&](std::uint32_t k) {
        const Layer& to = layer(k);
        if (region_of_[k] != kNone || !is_inclined(to)) return;
        const Eigen::Vector2d mean = sum / static_cast<double>(region.size());
        const Eigen::Vector3d apart = to.sums.mean() - from.sums.mean();
        if ((to.around->slope - mean).norm() > kBend ||
            std::abs(apart.z() - mean.dot(apart.head<2>())) > kUneven)
          return;
        region_of_[k] = seed;
        region.push_back(k);
        sum += to.around->slope;
      });
    }
    return region;
  }

  std::optional<Ramp> ramp_of(const Layers& region) {
    const auto plane = fitted(region);
    if (!plane || plane->slope.norm() < kGentlest || plane->slope.norm() > kSteepest) return std::nullopt;
    Ramp ramp{RampFrame(*plane), {}, {}, 0, 0, 0, {}};
    for (const std::uint32_t i : region) {
      const Eigen::Vector2d at = ramp.frame.at(layer(i).sums.mean().head<2>());
      ramp.u.add(at.x());
      ramp.v.add(at.y());
    }
    const auto foot = level_at(ramp, region, false, kFloorsOnly);
    auto head = level_at(ramp, region, true, kFloorsOnly);
    if (!foot && !head) return std::nullopt;
    ramp.floor = foot ? *foot : *head;
    const bool no_floor = !head;
    if (no_floor) head = level_at(ramp, region, true, kAnyPlate);
    ramp.joined_ends = (foot ? 1 : 0) + (head ? 1 : 0);
    const Layers cells = extend(ramp, region, foot, head);
    if (no_floor && head) {
      const Eigen::Vector2d p = ramp.frame.place(ramp.u.high + kOnPlate, 0.5 * (ramp.v.low + ramp.v.high));
      ramp.landing = Eigen::Vector3d(p.x(), p.y(), *head);
    }
    const double rise = ramp.frame.slope() * ramp.u.size();
    if (ramp.u.size() < shortest_ || ramp.v.size() < kNarrowest || rise < lowest_ || ramp.filled < kFilled)
      return std::nullopt;
    if (ramp.filled < kWellFilled && rise < kOverUneven * plane->rms) return std::nullopt;
    for (const std::uint32_t i : cells) {
      taken_[i] = true;
      ground_.for_each_beside(layer(i), [&](std::uint32_t k) { taken_[k] = true; });
    }
    return ramp;
  }

  /// The plane through the region's cells, without those that lie off it; nullopt: none, or two levels with a
  /// step between them describe the region better.
  std::optional<SlopedPlane> fitted(const Layers& region) const {
    std::optional<SlopedPlane> plane;
    for (int round = 0; round < 3; ++round) {
      PlaneSums sums;
      for (const std::uint32_t i : region) {
        const Eigen::Vector3d p = layer(i).sums.mean();
        if (!plane || std::abs(p.z() - plane->height(p.head<2>())) < kOnRamp) sums += layer(i).sums;
      }
      plane = plane_through(sums);
      if (!plane) return std::nullopt;
    }
    if (plane->rms > kUneven || is_step(region, *plane)) return std::nullopt;
    return plane;
  }

  bool is_step(const Layers& region, const SlopedPlane& plane) const {
    if (plane.slope.norm() < 1e-6) return false;
    const RampFrame frame(plane);
    std::vector<std::pair<double, PlaneSums>> along;
    PlaneSums all;
    for (const std::uint32_t i : region) {
      along.emplace_back(frame.at(layer(i).sums.mean().head<2>()).x(), layer(i).sums);
      all += layer(i).sums;
    }
    std::sort(along.begin(), along.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    const auto residual = [](const PlaneSums& s) {
      return s.count > 0 ? s.squares(2, 2) - s.sum.z() * s.sum.z() / s.count : 0;
    };
    const double of_plane = plane.rms * plane.rms * all.count;
    PlaneSums below, above = all;
    for (const auto& [u, sums] : along) {
      below += sums;
      above.count -= sums.count, above.sum -= sums.sum, above.squares -= sums.squares;
      if (residual(below) + residual(above) < of_plane) return true;
    }
    return false;
  }

  enum Plates : std::uint8_t { kFloorsOnly, kAnyPlate };
  /// Height of what the region's lower or upper end leads onto, if most of its width does: a level floor, or
  /// any level plate.
  std::optional<double> level_at(const Ramp& ramp, const Layers& region, bool head, Plates plates) const {
    std::vector<double> heights;
    int joined = 0, all = 0;
    const double end = head ? ramp.u.high : ramp.u.low, outwards = head ? 1 : -1;
    for (double v = ramp.v.low; v <= ramp.v.high + 1e-9; v += GroundLayers::kCell) {
      ++all;
      bool found = false;
      for (double d = GroundLayers::kCell; d < 1.1; d += GroundLayers::kCell) {
        const Eigen::Vector2d p = ramp.frame.place(end + outwards * d, v);
        const Eigen::Vector2i cell = GroundLayers::cell_of(p);
        const auto [first, last] = ground_.in_cell(cell.x(), cell.y());
        for (std::uint32_t i = first; i < last; ++i) {
          const Layer& l = layer(i);
          if ((plates == kFloorsOnly && !l.is_floor()) || region_of_[i] == region_of_[region.front()] ||
              !l.around || l.around->slope.norm() > kLevel)
            continue;
          const double u = ramp.frame.u_of(l.z());
          if (std::abs(u - end) > kBeyond || outwards * (u - end) < -GroundLayers::kCell) continue;
          heights.push_back(l.z());
          found = true;
        }
      }
      joined += found ? 1 : 0;
    }
    if (heights.empty() || joined < kJoined * all) return std::nullopt;
    return quantile(heights, 0.5);
  }

  /// Its extent up to the floors at its ends, and sideways as far as cells lie on the plane.
  Layers extend(Ramp& ramp, const Layers& region, std::optional<double> foot, std::optional<double> head) {
    const RampFrame& frame = ramp.frame;
    const double low = foot ? *foot + kOnRamp : std::numeric_limits<double>::lowest(),
                 high = head ? *head - kOnRamp : std::numeric_limits<double>::max();
    // Further out than the cells at its rim, it is another surface that the plane cuts.
    constexpr double rim = 1.5 * GroundLayers::kCell;
    const Range u{ramp.u.low - kBeyond, ramp.u.high + kBeyond}, v{ramp.v.low - rim, ramp.v.high + rim};
    Layers cells = region;
    const std::uint32_t number = region.front();
    for (const std::uint32_t i : region) visited_[i] = number;
    for (std::size_t next = 0; next < cells.size(); ++next) {
      ground_.for_each_beside(layer(cells[next]), [&](std::uint32_t k) {
        const Eigen::Vector3d p = layer(k).sums.mean();
        if (visited_[k] == number || p.z() < low || p.z() > high) return;
        const Eigen::Vector2d at = frame.at(p.head<2>());
        if (!u.contains(at.x()) || !v.contains(at.y())) return;
        if (std::abs(p.z() - frame.plane.height(p.head<2>())) > kOnRamp) return;
        visited_[k] = number;
        cells.push_back(k);
      });
    }
    ramp.u = ramp.v = {};
    for (const std::uint32_t i : cells) {
      const PlaneSums& sums = layer(i).sums;
      const Eigen::Vector3d mean = sums.mean();
      const Eigen::Vector2d at = frame.at(mean.head<2>());
      // The points of a cell reach to both sides of their mean by the root of three of their deviations.
      const Eigen::Matrix2d spread =
          (sums.squares / sums.count - mean * mean.transpose()).topLeftCorner<2, 2>();
      const double du = std::sqrt(3 * std::max(0.0, frame.uphill.dot(spread * frame.uphill))),
                   dv = std::sqrt(3 * std::max(0.0, frame.left.dot(spread * frame.left)));
      ramp.u.add(at.x() - du), ramp.u.add(at.x() + du);
      ramp.v.add(at.y() - dv), ramp.v.add(at.y() + dv);
    }
    if (foot) ramp.u.low = frame.u_of(*foot);
    if (head) ramp.u.high = frame.u_of(*head);
    const double area = ramp.u.size() * ramp.v.size();
    ramp.filled = std::min(1.0, static_cast<double>(cells.size()) * GroundLayers::kCell *
                                    GroundLayers::kCell / std::max(area, 1e-6));
    return cells;
  }

  GroundLayers ground_;
  std::vector<std::uint32_t> region_of_;  // per layer: the seed of its region
  std::vector<std::uint32_t> visited_;    // per layer: the last region that was extended over it
  std::vector<bool> taken_;               // per layer: it lies on a ramp, or beside it
  double shortest_, lowest_;              // m, of a ramp
};

ModelEntity entity_of(const Ramp& ramp) {
  const RampFrame& frame = ramp.frame;
  const double pitch = std::atan(frame.slope()), yaw = std::atan2(frame.uphill.y(), frame.uphill.x());
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(-pitch, Eigen::Vector3d::UnitY()));
  const double u = 0.5 * (ramp.u.low + ramp.u.high), v = 0.5 * (ramp.v.low + ramp.v.high);
  const Eigen::Vector2d p = frame.place(u, v);
  ModelEntity entity;
  entity.label = EntityLabel::ramp;
  entity.T_map_body = Transform<Map, Body>(
      turn, Eigen::Vector3d(p.x(), p.y(), frame.height(u)) - turn * Eigen::Vector3d(0, 0, kThick / 2));
  entity.size = {ramp.u.size() / std::cos(pitch), ramp.v.size(), kThick};
  entity.observed = ramp.filled;
  entity.confidence = ramp.filled * (ramp.joined_ends == 2 ? 1 : 0.8);
  return entity;
}

}  // namespace

FoundRamps find_ramps(const cloud::PointCloud<Map>& cloud, std::vector<std::uint8_t>& labels, double voxel) {
  const std::vector<Ramp> candidates = RampFinder(cloud, labels, voxel).find();
  if (candidates.empty()) return {};
  std::vector<ModelEntity> ramps;
  for (const Ramp& candidate : candidates) ramps.push_back(entity_of(candidate));
  const auto around = points_around_ramps(cloud, labels, ramps);
  FoundRamps found;
  std::vector<std::uint32_t> on_ramps;
  for (std::size_t r = 0; r < ramps.size(); ++r) {
    ModelEntity& ramp = ramps[r];
    const double rise = ramp.T_map_body.rotation()(2, 0) * ramp.size.x(),
                 error = height_error(cloud, labels, around[r], ramp, candidates[r].floor);
    if (rise <= error) continue;
    if (rise < 2 * error) ramp.confidence *= 0.5 * rise / error;
    fit_width(cloud, around[r], ramp);
    for (const std::uint32_t i : around[r]) {
      if (is_on_ramp(ramp, cloud.points[i].cast<double>())) on_ramps.push_back(i);
    }
    ramp.name = "ramp " + std::to_string(found.ramps.size() + 1);
    found.ramps.push_back(std::move(ramp));
    if (candidates[r].landing) found.landings.push_back(*candidates[r].landing);
  }
  for (const std::uint32_t i : on_ramps) labels[i] = static_cast<std::uint8_t>(EntityLabel::ramp);
  return found;
}

void add_landings(const Segmentation& segmentation, const FoundRamps& found, SemanticNet& net) {
  constexpr double level = 0.08, beside = 0.3, min_area = 1.0;  // m, m, m^2
  auto floors = static_cast<std::size_t>(
      std::count_if(net.entities.begin(), net.entities.end(),
                    [](const ModelEntity& entity) { return entity.label == EntityLabel::floor; }));
  std::vector<bool> added(segmentation.horizontals.size());
  for (const Eigen::Vector3d& landing : found.landings) {
    for (std::size_t h = 0; h < added.size(); ++h) {
      const HorizontalSurface& plate = segmentation.horizontals[h];
      const Eigen::AlignedBox2d plan(plate.low, plate.high);
      if (added[h] || plate.faces_down || plate.area < min_area || std::abs(plate.z - landing.z()) > level ||
          plan.exteriorDistance(landing.head<2>().eval()) > beside)
        continue;
      added[h] = true;
      ModelEntity& floor = net.entities.emplace_back();
      floor.name = "floor " + std::to_string(++floors);
      floor.label = EntityLabel::floor;
      floor.T_map_body =
          Transform<Map, Body>::planar(plan.center().x(), plan.center().y(), 0, plate.z - kThick / 2);
      floor.size = {plan.sizes().x(), plan.sizes().y(), kThick};
      floor.observed = std::min(1.0, plate.area / std::max(plan.volume(), 1e-6));
      const auto surface = static_cast<std::uint32_t>(segmentation.verticals.size() + h);
      for (std::size_t i = 0; i < net.labels.size(); ++i) {
        if (segmentation.surface_of[i] == surface &&
            net.labels[i] == static_cast<std::uint8_t>(EntityLabel::unknown))
          net.labels[i] = static_cast<std::uint8_t>(EntityLabel::floor);
      }
    }
  }
}

}  // namespace parhelion::semantic
