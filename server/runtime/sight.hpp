// What a camera or a laser has in sight, by MR_WORLD and the building.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "fusion/scan/ray_caster.hpp"
#include "protocols/codec.hpp"
#include "protocols/image.hpp"
#include "protocols/model.hpp"
#include "server/simulation/entity_shapes.hpp"

namespace parhelion::runtime {

/// Not thread-safe.
class Sight {
 public:
  explicit Sight(const SemanticModel& model);
  /// Another building.
  void set_building(const SemanticModel& model);
  /// The bodies to look for, and behind which others are hidden, from now on. Those without known shapes are
  /// neither.
  void set_bodies(const WorldMessage& world, const simulation::EntityShapes& shapes);

  using Entities = std::set<std::string, std::less<>>;
  /// Entities but `self` of which a point is in the image and hidden by nothing. Those smaller than three
  /// pixels, and the lens's distortion, are neglected.
  Entities in_camera(const Transform<Map, CameraOptical>& T_map_optical, const CameraIntrinsics& lens,
                     const std::string& self);
  /// Entities but `self` within `max_range` m that reach into the plane of the laser, with a point there that
  /// nothing hides. All around: the laser's field of view is not considered.
  Entities in_laser(const Transform<Map, Laser>& T_map_laser, double max_range, const std::string& self);

 private:
  struct Body {
    BodyDefinition definition;
    Transform<Map, parhelion::Body> T_map_body;
    double radius = 0;  ///< m, of a sphere about the body's origin that holds it
  };
  /// True if the first thing on the way from `from` to `to` belongs to `entity`.
  bool sees(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const std::string& entity);
  void leave_out(const std::string& self);

  scan::RayCaster caster_;
  std::vector<Body> bodies_;
  std::vector<scan::BodyMotion> motions_;  ///< of all but the one that looks
};

}  // namespace parhelion::runtime
