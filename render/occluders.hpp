// Real objects that may occlude virtual bodies: the semantic model, moving real bodies, and returns of the
// laser that the model does not explain. (For the depth image see depth_occlusion.hpp.)
#pragma once

#include <optional>
#include <vector>

#include "protocols/model.hpp"
#include "protocols/scan.hpp"
#include "protocols/world.hpp"
#include "render/draw_list.hpp"

namespace parhelion::render {

/// A box of the building: pose of its centre, half extents in metres.
struct OccluderBox {
  std::string name;
  Transform<Map, ShapeFrame> T_map_box;
  Transform<ShapeFrame, Map> T_box_map;
  Eigen::Vector3d half;
};

/// Boxes of the model that occlude: all except windows (transparent) and virtual ones drawn by an instructor.
std::vector<OccluderBox> occluders_of(const SemanticModel& building);

/// m, map: the top of the lowest modelled floor, else the lowest bottom of the other entities, else 0.
double floor_of(const SemanticModel& building);

/// m over the floor, assumed height of objects that the laser sees and the model does not explain: a standing
/// person's. Lower objects then occlude too much; the opposite error would draw over a person.
inline constexpr double kScanOccluderHeight = 1.8;
/// m, a return this near a box of the model is explained by it: the combined error of pose, model and laser.
inline constexpr double kExplained = 0.25;

/// The boxes that explain returns at an instant: the building's, with doors at their angles then; doors at
/// unknown angles are left out.
std::vector<OccluderBox> explaining_boxes(const std::vector<OccluderBox>& building,
                                          const WorldSnapshot& world);

/// Strips from the floor to kScanOccluderHeight at the returns of a scan that no box explains; neighbours
/// nearer to each other than kScanGap, or than three beam spacings, are joined. Only returns up to `farthest`
/// from the camera.
inline constexpr double kScanGap = 0.15;
std::vector<OccluderBox> scan_occluders(const Scan& scan, const LaserDescription& laser,
                                        const Transform<Map, Laser>& T_map_laser, double floor_z,
                                        const Eigen::Vector3d& p_map_camera, double farthest,
                                        const std::vector<OccluderBox>& building);

/// Adds to the list the occluders in front of its bodies. A box of the building with the name of a real body
/// of the scene (a door on its hinge) is replaced by that body in its current pose, and omitted where the
/// door's angle is unknown. Other real robots occlude too, but not the one that carries the camera.
void add_occluders(DrawList& list, const CameraProjection& projection,
                   const Transform<Map, CameraOptical>& T_map_optical,
                   const std::vector<OccluderBox>& building, const WorldSnapshot& world);

/// True where the body belongs to a robot that carries the camera: the camera is inside its bounding sphere,
/// or a hand's breadth from it.
bool carries_camera(const BodyDefinition& body, const Transform<Map, Body>& T_map_body,
                    const Eigen::Vector3d& p_map_camera);

}  // namespace parhelion::render
