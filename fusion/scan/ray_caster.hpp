// Casts the beams of a sweep against moving bodies and the building: each beam at its own time, from where
// the laser was then.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "fusion/scan/building_tree.hpp"
#include "protocols/model.hpp"
#include "protocols/world.hpp"

namespace parhelion::scan {

/// A rigid body over a sweep: pose at the sweep's start and end; between them position linear, rotation
/// slerp.
struct BodyMotion {
  const BodyDefinition* body = nullptr;
  Transform<Map, Body> T_map_body_start;
  Transform<Map, Body> T_map_body_end;
};

/// Bodies [first, last) of a list over a sweep, and a sphere in the map that holds them all the while.
struct BodyGroup {
  std::uint32_t first = 0, last = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< m
  double radius = 0;                                 ///< m
};

/// The laser over a sweep, the same way.
struct LaserMotion {
  Transform<Map, Laser> T_map_laser_start;
  Transform<Map, Laser> T_map_laser_end;
};

/// Which beams to cast: angles from the scan, instants from the description, both over the sweep [0, 1].
struct BeamSet {
  float angle_first = 0, angle_step = 0;  ///< rad
  std::span<const float> time;            ///< per beam: 0 at the sweep's start, 1 at its end
};

/// Exact range of the nearest surface along each beam, and whose. Shapes are solid: a beam that starts inside
/// one has range 0.
struct RangeHit {
  float range = 0;         ///< m; +inf: nothing within max_range
  std::int32_t body = -1;  ///< index into the bodies given, -1: none; the building counts as none
  float reflectivity = 0;
};

/// Casts beams against moving bodies (and, where asked, the building). Not thread-safe; one per thread. After
/// warm-up our own code allocates nothing.
class RayCaster {
 public:
  RayCaster();
  ~RayCaster();
  RayCaster(RayCaster&&) noexcept;
  RayCaster& operator=(RayCaster&&) noexcept;

  /// The static building, from the semantic model (all solid entities that are not
  /// is_virtual, and all meshes).
  void set_building(const SemanticModel& model);
  /// The same with the tree made elsewhere, which takes time with large models.
  void set_building(BuildingTree tree);
  /// The building that `other` has now. Casting in one building by several casters at once is safe.
  void share_building(const RayCaster& other);
  /// hits.size() == beams.time.size(). The origin's own body is left out by not being in `bodies`. A body
  /// whose pose is not finite is nowhere. Of surfaces at one range the body with the lowest index is named.
  void cast_bodies(const LaserMotion& laser, const BeamSet& beams, std::span<const BodyMotion> bodies,
                   double max_range, std::span<RangeHit> hits);
  /// The same hits from those bodies alone that are in `groups`: what is quick in a crowd, as a group is
  /// given up whole where something nearer hides it.
  void cast_groups(const LaserMotion& laser, const BeamSet& beams, std::span<const BodyMotion> bodies,
                   std::span<const BodyGroup> groups, double max_range, std::span<RangeHit> hits);
  void cast_building(const LaserMotion& laser, const BeamSet& beams, double max_range,
                     std::span<RangeHit> hits);
  /// Only what is nearer than `nearer`'s ranges (hits of the same beams) is sure to be found: quicker, where
  /// the rest is hidden.
  void cast_building_before(std::span<const RangeHit> nearer, const LaserMotion& laser, const BeamSet& beams,
                            double max_range, std::span<RangeHit> hits);
  /// The same with what of the building moves and is not in its tree: doors. They count as building: no hit
  /// names a body.
  void cast_building(const LaserMotion& laser, const BeamSet& beams, std::span<const BodyMotion> doors,
                     double max_range, std::span<RangeHit> hits);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The slow exact twin: every shape against every beam analytically, double precision, no acceleration
/// structure.
void cast_bodies_exact(const LaserMotion& laser, const BeamSet& beams, std::span<const BodyMotion> bodies,
                       double max_range, std::span<RangeHit> hits);
void cast_building_exact(const LaserMotion& laser, const BeamSet& beams, const SemanticModel& model,
                         double max_range, std::span<RangeHit> hits);
/// Without the model's doors, and with these.
void cast_building_exact(const LaserMotion& laser, const BeamSet& beams, const SemanticModel& model,
                         std::span<const BodyMotion> doors, double max_range, std::span<RangeHit> hits);

}  // namespace parhelion::scan
