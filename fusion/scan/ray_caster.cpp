// Bodies: for each shape the beams that can meet it, then exact intersection with only those. Building:
// Embree's tree.
#include "fusion/scan/ray_caster.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "fusion/scan/beam_window.hpp"
#include "fusion/scan/building_tree.hpp"
#include "fusion/scan/mesh_intersection.hpp"
#include "fusion/scan/shape_intersection.hpp"
#include "fusion/scan/sweep_rays.hpp"

namespace parhelion::scan {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kNone = std::numeric_limits<double>::infinity();

/// A body's motion in the laser's middle frame: the centres of its shapes stay within `drift + spin *
/// |offset|` of their middle positions.
struct SeenBody {
  Matrix3d A;    ///< mean of the start's and the end's rotation, into the laser's middle frame
  Vector3d t;    ///< middle of the body's origin relative to the laser
  double drift;  ///< m, half of the relative path
  double spin;   ///< m per m from the body's origin: half chord of the turn
};

SeenBody seen(const BodyMotion& motion, const SweepRays& rays) {
  const Matrix3d R_start = motion.T_map_body_start.rotation(), R_end = motion.T_map_body_end.rotation();
  const Vector3d from = motion.T_map_body_start.translation() - rays.start();
  const Vector3d to = motion.T_map_body_end.translation() - rays.end();
  const Matrix3d R_middle_map = rays.R_map_middle().transpose();
  // |R_end - R_start| (Frobenius) = 2 sqrt(2) sin(angle / 2). An arc of at most half a turn lies within the
  // ball on its chord, whose radius is sin(angle / 2) * |offset|.
  return {R_middle_map * (0.5 * (R_start + R_end)), R_middle_map * (0.5 * (from + to)),
          0.5 * (to - from).norm(), (R_end - R_start).norm() / (2 * std::numbers::sqrt2)};
}

/// m, extent of a shape from its centre along a direction of the body's frame (length at most 1).
double reach_along(const Shape& shape, const Vector3d& direction) {
  if (shape.kind != ShapeKind::box) return bounding_radius(shape.kind, shape.size);
  return 0.5 * (shape.T_body_shape.isometry().linear().transpose() * direction).cwiseAbs().dot(shape.size);
}

/// Without a finite pose and finite bearings there are no hits.
bool can_cast(const LaserMotion& laser, const BeamSet& beams) {
  return laser.T_map_laser_start.finite() && laser.T_map_laser_end.finite() &&
         std::isfinite(beams.angle_min) && std::isfinite(beams.angle_increment) &&
         std::all_of(beams.angles.begin(), beams.angles.end(),
                     [](float angle) { return std::isfinite(angle); });
}

}  // namespace

struct RayCaster::State {
  SweepRays rays;
  std::shared_ptr<const BuildingTree> building = std::make_shared<const BuildingTree>();

  // Nearest hit of each beam.
  std::vector<double> range;
  std::vector<std::int32_t> body;
  std::vector<float> reflectivity;

  // Bodies by distance from the laser, each with its view.
  std::vector<std::pair<double, std::int32_t>> by_distance;
  std::vector<SeenBody> seen_bodies;

  // Rays in the frame of the current body, computed on demand: valid where `ray_of` names that body.
  std::vector<std::int32_t> ray_of;
  std::vector<Vector3d> origin_body, direction_body;

  void start(std::size_t beams) {
    range.assign(beams, kNone);
    body.assign(beams, -1);
    reflectivity.assign(beams, 0);
    ray_of.assign(beams, -1);
    origin_body.resize(beams);
    direction_body.resize(beams);
  }

  /// Computes the rays of the sweep, and casts them against the bodies.
  void cast_all(const LaserMotion& laser, const BeamSet& beams, std::span<const BodyMotion> bodies,
                double max_range);
  /// The same for groups of bodies.
  void cast_groups(const LaserMotion& laser, const BeamSet& beams, std::span<const BodyMotion> bodies,
                   std::span<const BodyGroup> groups, double max_range);
  /// Whether something nearer than `nearest` blocks all these beams.
  bool hidden(const BeamRanges& ranges, double nearest) const;
  /// Nearest first, so that hidden bodies are skipped early.
  void order(std::span<const BodyMotion> bodies);
  void cast(const BodyMotion& motion, const SeenBody& view, std::int32_t index, const BeamWindow& window);
  void cast(const Shape& shape, std::int32_t index, const BeamRange& beams, double nearest);
  void bring_rays(const BodyMotion& motion, const RotationSweep& rotation, std::int32_t index,
                  const BeamRange& beams, double nearest);
  void write(double max_range, std::span<RangeHit> hits) const;
};

void RayCaster::State::order(std::span<const BodyMotion> bodies) {
  by_distance.clear();
  seen_bodies.clear();
  for (const BodyMotion& motion : bodies) {
    seen_bodies.push_back(seen(motion, rays));
    const double distance = seen_bodies.back().t.squaredNorm();
    if (!motion.T_map_body_start.finite() || !motion.T_map_body_end.finite()) continue;
    by_distance.emplace_back(distance, static_cast<std::int32_t>(seen_bodies.size() - 1));
  }
  std::sort(by_distance.begin(), by_distance.end());
}

void RayCaster::State::cast_all(const LaserMotion& laser, const BeamSet& beams,
                                std::span<const BodyMotion> bodies, double max_range) {
  rays.set(laser, beams);
  if (bodies.empty()) return;
  const BeamWindow window(beams, rays.half_turn(), rays.half_tilt(), max_range);
  order(bodies);
  for (const auto& [distance, b] : by_distance) {
    const auto at = static_cast<std::size_t>(b);
    cast(bodies[at], seen_bodies[at], b, window);
  }
}

bool RayCaster::State::hidden(const BeamRanges& ranges, double nearest) const {
  return std::all_of(ranges.begin(), ranges.end(), [&](const BeamRange& beams) {
    return std::all_of(range.begin() + static_cast<std::ptrdiff_t>(beams.first),
                       range.begin() + static_cast<std::ptrdiff_t>(beams.last),
                       [nearest](double hit) { return hit < nearest; });
  });
}

void RayCaster::State::cast_groups(const LaserMotion& laser, const BeamSet& beams,
                                   std::span<const BodyMotion> bodies, std::span<const BodyGroup> groups,
                                   double max_range) {
  rays.set(laser, beams);
  if (groups.empty()) return;
  const BeamWindow window(beams, rays.half_turn(), rays.half_tilt(), max_range);
  const Vector3d middle = 0.5 * (rays.start() + rays.end());
  const Matrix3d R_middle_map = rays.R_map_middle().transpose();
  const double half_travel = 0.5 * (rays.end() - rays.start()).norm();
  by_distance.clear();
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const double nearest = (groups[g].center - middle).norm() - groups[g].radius - half_travel;
    if (nearest <= max_range) by_distance.emplace_back(nearest, static_cast<std::int32_t>(g));
  }
  std::sort(by_distance.begin(), by_distance.end());
  for (const auto& [nearest, g] : by_distance) {
    const BodyGroup& group = groups[static_cast<std::size_t>(g)];
    if (hidden(window.meet(R_middle_map * (group.center - middle), group.radius + half_travel), nearest))
      continue;
    for (std::uint32_t b = group.first; b < group.last; ++b) {
      const BodyMotion& motion = bodies[b];
      if (!motion.T_map_body_start.finite() || !motion.T_map_body_end.finite()) continue;
      cast(motion, seen(motion, rays), static_cast<std::int32_t>(b), window);
    }
  }
}

void RayCaster::State::cast(const BodyMotion& motion, const SeenBody& view, std::int32_t index,
                            const BeamWindow& window) {
  RotationSweep rotation;
  bool has_rotation = false;
  const Vector3d up = view.A.row(2);  // normal of the laser's plane, in the body
  for (const Shape& shape : motion.body->shapes) {
    const Vector3d offset = shape.T_body_shape.isometry().translation();
    const double farthest = offset.lpNorm<1>() + shape.size.lpNorm<1>();
    const double reach = reach_along(shape, up) + view.drift + view.spin * farthest;
    if (window.misses_plane(up.dot(offset) + view.t.z(), reach)) continue;
    const Vector3d center = view.A * offset + view.t;
    const double radius =
        bounding_radius(shape.kind, shape.size) + view.drift + view.spin * offset.lpNorm<1>();
    for (const BeamRange& beams : window.meet(center, radius)) {
      if (!has_rotation) {
        rotation = RotationSweep(motion.T_map_body_start.rotation(), motion.T_map_body_end.rotation());
        has_rotation = true;
      }
      const double nearest = center.norm() - radius;
      bring_rays(motion, rotation, index, beams, nearest);
      cast(shape, index, beams, nearest);
    }
  }
}

void RayCaster::State::bring_rays(const BodyMotion& motion, const RotationSweep& rotation, std::int32_t index,
                                  const BeamRange& beams, double nearest) {
  const Vector3d from = motion.T_map_body_start.translation();
  const Vector3d moved = motion.T_map_body_end.translation() - from;
  for (std::size_t i = beams.first; i < beams.last; ++i) {
    if (ray_of[i] == index || range[i] < nearest) continue;
    ray_of[i] = index;
    const double s = rays.time(i);
    const Matrix3d R_body_map = rotation.at(s).transpose();
    origin_body[i] = R_body_map * (rays.origin(i) - from - s * moved);
    direction_body[i] = R_body_map * rays.direction(i);
  }
}

void RayCaster::State::cast(const Shape& shape, std::int32_t index, const BeamRange& beams, double nearest) {
  const Matrix3d R_shape_body = shape.T_body_shape.rotation().transpose();
  const Vector3d center = shape.T_body_shape.translation();
  const double bound = bounding_radius(shape.kind, shape.size) * (1 + 1e-9);
  for (std::size_t i = beams.first; i < beams.last; ++i) {
    if (range[i] < nearest) continue;
    const Vector3d to_origin = origin_body[i] - center;
    const double along = to_origin.dot(direction_body[i]);
    if (to_origin.squaredNorm() - along * along > bound * bound + 1e-9) continue;
    const Vector3d origin = R_shape_body * to_origin, direction = R_shape_body * direction_body[i];
    const double t = shape.kind == ShapeKind::mesh
                         ? mesh_range(*shape.mesh, origin, direction)
                         : shape_chord(shape.kind, shape.size, origin, direction).range();
    if (t > range[i] || (t == range[i] && index >= body[i])) continue;
    range[i] = t;
    body[i] = index;
    reflectivity[i] = shape.material.laser_reflectivity;
  }
}

void RayCaster::State::write(double max_range, std::span<RangeHit> hits) const {
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const bool hit = range[i] <= max_range;
    hits[i] = hit ? RangeHit{static_cast<float>(range[i]), body[i], reflectivity[i]}
                  : RangeHit{std::numeric_limits<float>::infinity(), -1, 0};
  }
}

RayCaster::RayCaster() : state_(std::make_unique<State>()) {}
RayCaster::~RayCaster() = default;
RayCaster::RayCaster(RayCaster&&) noexcept = default;
RayCaster& RayCaster::operator=(RayCaster&&) noexcept = default;

void RayCaster::set_building(const SemanticModel& model) { set_building(BuildingTree(model)); }

void RayCaster::set_building(BuildingTree tree) {
  state_->building = std::make_shared<const BuildingTree>(std::move(tree));
}

void RayCaster::share_building(const RayCaster& other) { state_->building = other.state_->building; }

void RayCaster::cast_bodies(const LaserMotion& laser, const BeamSet& beams,
                            std::span<const BodyMotion> bodies, double max_range, std::span<RangeHit> hits) {
  assert(hits.size() == beams.time.size());
  State& state = *state_;
  state.start(hits.size());
  if (can_cast(laser, beams)) state.cast_all(laser, beams, bodies, max_range);
  state.write(max_range, hits);
}

void RayCaster::cast_groups(const LaserMotion& laser, const BeamSet& beams,
                            std::span<const BodyMotion> bodies, std::span<const BodyGroup> groups,
                            double max_range, std::span<RangeHit> hits) {
  assert(hits.size() == beams.time.size());
  State& state = *state_;
  state.start(hits.size());
  if (can_cast(laser, beams)) state.cast_groups(laser, beams, bodies, groups, max_range);
  state.write(max_range, hits);
}

void RayCaster::cast_building(const LaserMotion& laser, const BeamSet& beams, double max_range,
                              std::span<RangeHit> hits) {
  cast_building(laser, beams, {}, max_range, hits);
}

void RayCaster::cast_nearer_building(std::span<const RangeHit> nearer, const LaserMotion& laser,
                                     const BeamSet& beams, double max_range, std::span<RangeHit> hits) {
  assert(hits.size() == beams.time.size() && nearer.size() == hits.size());
  State& state = *state_;
  state.start(hits.size());
  if (can_cast(laser, beams)) {
    state.rays.set(laser, beams);
    for (std::size_t i = 0; i < hits.size(); ++i) {
      const double range_limit = std::min(max_range, double{nearer[i].range});
      const BuildingTree::Hit hit =
          state.building->cast(state.rays.origin(i), state.rays.direction(i), range_limit);
      state.range[i] = hit.range;
      state.reflectivity[i] = hit.reflectivity;
    }
  }
  state.write(max_range, hits);
}

void RayCaster::cast_building(const LaserMotion& laser, const BeamSet& beams,
                              std::span<const BodyMotion> doors, double max_range, std::span<RangeHit> hits) {
  assert(hits.size() == beams.time.size());
  State& state = *state_;
  state.start(hits.size());
  if (can_cast(laser, beams)) {
    state.cast_all(laser, beams, doors, max_range);
    for (std::size_t i = 0; i < hits.size(); ++i) {
      const BuildingTree::Hit hit =
          state.building->cast(state.rays.origin(i), state.rays.direction(i), max_range);
      state.body[i] = -1;
      if (!(hit.range < state.range[i])) continue;
      state.range[i] = hit.range;
      state.reflectivity[i] = hit.reflectivity;
    }
  }
  state.write(max_range, hits);
}

}  // namespace parhelion::scan
