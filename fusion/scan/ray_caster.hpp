// Casts the beams of a sweep against moving bodies and the building: each beam at its own time, from the
// laser's pose at that time.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "fusion/scan/building_tree.hpp"
#include "protocols/model.hpp"
#include "protocols/world.hpp"

namespace parhelion::scan {

/// Motion of a rigid body over a sweep: poses at its start and end; in between the position is interpolated
/// linearly and the rotation by slerp.
struct BodyMotion {
  const BodyDefinition* body = nullptr;
  Transform<Map, Body> T_map_body_start;
  Transform<Map, Body> T_map_body_end;
};

/// Bodies [first, last) of a list over a sweep, and a sphere in the map that contains them throughout.
struct BodyGroup {
  std::uint32_t first = 0, last = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< m
  double radius = 0;                                 ///< m
};

/// Motion of the laser over a sweep, interpolated likewise.
struct LaserMotion {
  Transform<Map, Laser> T_map_laser_start;
  Transform<Map, Laser> T_map_laser_end;
};

/// The beams to cast: angles from the scan, times normalized to [0, 1] over the sweep.
struct BeamSet {
  float angle_min = 0, angle_increment = 0;  ///< rad; the increment is a mean where there are `angles`
  std::span<const float> time;               ///< per beam: 0 at the sweep's start, 1 at its end
  std::span<const float> angles = {};        ///< rad: empty, or one per beam where they are not evenly spaced

  double angle(std::size_t i) const {
    return angles.empty() ? double{angle_min} + static_cast<double>(i) * double{angle_increment}
                          : double{angles[i]};
  }
};

/// Exact range of the nearest surface along each beam, and the body it belongs to. Shapes are solid: a beam
/// that starts inside one has range 0.
struct RangeHit {
  float range = 0;         ///< m; +inf: nothing within max_range
  std::int32_t body = -1;  ///< index into the bodies given, -1: none; the building counts as none
  float reflectivity = 0;
};

/// Casts beams against moving bodies and optionally the building. Not thread-safe; one per thread. Allocates
/// nothing of its own after warm-up.
class RayCaster {
 public:
  RayCaster();
  ~RayCaster();
  RayCaster(RayCaster&&) noexcept;
  RayCaster& operator=(RayCaster&&) noexcept;

  /// The static building, from the semantic model (all solid entities that are not
  /// is_virtual, and all meshes).
  void set_building(const SemanticModel& model);
  /// The same with a tree built elsewhere, as building takes time for large models.
  void set_building(BuildingTree tree);
  /// Shares the current building of `other`. Several casters may cast against one building concurrently.
  void share_building(const RayCaster& other);
  /// hits.size() == beams.time.size(). The laser's own body must not be in `bodies`. A body with a non-finite
  /// pose is ignored. Among surfaces at the same range, the body with the lowest index is reported.
  void cast_bodies(const LaserMotion& laser, const BeamSet& beams, std::span<const BodyMotion> bodies,
                   double max_range, std::span<RangeHit> hits);
  /// The same for the bodies in `groups` only; faster in a crowd, as a group that is hidden by something
  /// nearer is skipped as a whole.
  void cast_groups(const LaserMotion& laser, const BeamSet& beams, std::span<const BodyMotion> bodies,
                   std::span<const BodyGroup> groups, double max_range, std::span<RangeHit> hits);
  void cast_building(const LaserMotion& laser, const BeamSet& beams, double max_range,
                     std::span<RangeHit> hits);
  /// Only hits nearer than the ranges of `nearer` (hits of the same beams) are guaranteed to be found; faster
  /// where the rest is hidden.
  void cast_nearer_building(std::span<const RangeHit> nearer, const LaserMotion& laser, const BeamSet& beams,
                            double max_range, std::span<RangeHit> hits);
  /// The same with the moving parts of the building that are not in its tree: doors. They count as building:
  /// no hit reports a body.
  void cast_building(const LaserMotion& laser, const BeamSet& beams, std::span<const BodyMotion> doors,
                     double max_range, std::span<RangeHit> hits);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Exact reference implementation: every shape against every beam analytically, in double precision, without
/// an acceleration structure.
void cast_bodies_exact(const LaserMotion& laser, const BeamSet& beams, std::span<const BodyMotion> bodies,
                       double max_range, std::span<RangeHit> hits);
void cast_building_exact(const LaserMotion& laser, const BeamSet& beams, const SemanticModel& model,
                         double max_range, std::span<RangeHit> hits);
/// With these doors instead of the model's.
void cast_building_exact(const LaserMotion& laser, const BeamSet& beams, const SemanticModel& model,
                         std::span<const BodyMotion> doors, double max_range, std::span<RangeHit> hits);

}  // namespace parhelion::scan
