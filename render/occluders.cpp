#include "render/occluders.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace parhelion::render {
namespace {

OccluderBox make_box(std::string name, const Transform<Map, ShapeFrame>& T_map_box,
                     const Eigen::Vector3d& half) {
  return {std::move(name), T_map_box, T_map_box.inverse(), half};
}

bool explained(const Eigen::Vector3d& p_map, const std::vector<OccluderBox>& building) {
  return std::any_of(building.begin(), building.end(), [&](const OccluderBox& box) {
    // In the plane only: a wall that was extruded too low still explains the return.
    const Eigen::Vector3d p = box.T_box_map * p_map;
    return std::abs(p.x()) < box.half.x() + kExplained && std::abs(p.y()) < box.half.y() + kExplained &&
           std::abs(p.z()) < box.half.z() + 1.0;
  });
}

/// An upright box of 3 cm width between two points, or around one.
OccluderBox strip(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double width, double floor_z) {
  const Eigen::Vector3d along = b - a;
  const double yaw = std::atan2(along.y(), along.x());
  const Eigen::Vector3d centre(0.5 * (a.x() + b.x()), 0.5 * (a.y() + b.y()),
                               floor_z + 0.5 * kScanOccluderHeight);
  const double length = std::max(along.head<2>().norm(), width);
  return make_box("scan", Transform<Map, ShapeFrame>::planar(centre.x(), centre.y(), yaw, centre.z()),
                  {0.5 * length, 0.015, 0.5 * kScanOccluderHeight});
}

}  // namespace

std::vector<OccluderBox> occluders_of(const SemanticModel& building) {
  std::vector<OccluderBox> boxes;
  for (const ModelEntity& entity : building.entities) {
    if (entity.is_virtual || !is_solid(entity) || entity.label == EntityLabel::window) continue;
    if (!entity.T_map_body.finite() || !entity.size.allFinite() || entity.size.minCoeff() <= 0) continue;
    boxes.push_back(make_box(entity.name, T_map_box(entity), 0.5 * entity.size));
  }
  return boxes;
}

double floor_of(const SemanticModel& building) {
  std::optional<double> floor, foot;
  for (const ModelEntity& entity : building.entities) {
    if (entity.is_virtual || !is_solid(entity)) continue;
    if (!entity.T_map_body.finite() || !entity.size.allFinite() || entity.size.minCoeff() <= 0) continue;
    const double z = entity.T_map_body.translation().z(), half = 0.5 * entity.size.z();
    if (is_ground(entity.label))
      floor = std::min(floor.value_or(z + half), z + half);
    else
      foot = std::min(foot.value_or(z - half), z - half);
  }
  return floor.value_or(foot.value_or(0));
}

std::vector<OccluderBox> explaining_boxes(const std::vector<OccluderBox>& building,
                                          const WorldSnapshot& world) {
  if (!world.scene) return building;
  std::set<std::string> doors;
  std::vector<OccluderBox> leaves;
  for (const auto& body : world.scene->bodies)
    if (body->moves && !body->injectable) doors.insert(body->entity);
  for_each_body(world, [&](const BodyDefinition& body, const BodyState& state) {
    if (!body.moves || body.injectable || !state.known || body.shapes.empty()) return;
    const Transform<Map, ShapeFrame> T_map_leaf = state.T_map_body * body.shapes[0].T_body_shape;
    leaves.push_back(make_box(body.entity, T_map_leaf, 0.5 * body.shapes[0].size));
  });
  std::vector<OccluderBox> boxes;
  for (const OccluderBox& box : building)
    if (!doors.count(box.name)) boxes.push_back(box);
  boxes.insert(boxes.end(), leaves.begin(), leaves.end());
  return boxes;
}

std::vector<OccluderBox> scan_occluders(const Scan& scan, const LaserDescription& laser,
                                        const Transform<Map, Laser>& T_map_laser, double floor_z,
                                        const Eigen::Vector3d& p_map_camera, double farthest,
                                        const std::vector<OccluderBox>& building) {
  std::vector<OccluderBox> strips;
  std::optional<Eigen::Vector3d> previous;
  bool previous_joined = false;
  double previous_range = 0;
  const auto finish = [&] {  // a return without neighbours: a strip as wide as its beam
    if (previous && !previous_joined) {
      const double width =
          std::max(0.02, previous_range * std::abs(static_cast<double>(scan.angle_increment)));
      const Eigen::Vector3d across =
          T_map_laser.rotation().col(2).cross(*previous - T_map_laser.translation());
      const Eigen::Vector3d side = across.norm() > 0 ? Eigen::Vector3d(across.normalized() * 0.5 * width)
                                                     : Eigen::Vector3d(0.5 * width, 0, 0);
      strips.push_back(strip(*previous - side, *previous + side, width, floor_z));
    }
    previous.reset();
    previous_joined = false;
  };
  for (std::size_t i = 0; i < scan.ranges.size(); ++i) {
    const float range = scan.ranges[i];
    if (laser.convention.classify(range) != BeamKind::hit || !std::isfinite(range)) {
      finish();
      continue;
    }
    const double angle = scan.angle(i);
    const Eigen::Vector3d p =
        T_map_laser * (static_cast<double>(range) * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0));
    if ((p - p_map_camera).head<2>().norm() > farthest || explained(p, building)) {
      finish();
      continue;
    }
    const double gap = std::max(
        kScanGap, 3 * static_cast<double>(range) * std::abs(static_cast<double>(scan.angle_increment)));
    if (previous && (p - *previous).norm() < gap) {
      strips.push_back(strip(*previous, p, 0, floor_z));
      previous_joined = true;
    } else {
      finish();
    }
    previous = p;
    previous_range = static_cast<double>(range);
  }
  finish();
  return strips;
}

bool carries_camera(const BodyDefinition& body, const Transform<Map, Body>& T_map_body,
                    const Eigen::Vector3d& p_map_camera) {
  for (const Shape& shape : body.shapes)
    if (((T_map_body * shape.T_body_shape).translation() - p_map_camera).norm() <
        bounding_radius(shape) + 0.1)
      return true;
  return false;
}

namespace {

/// Half extents of a box inside the shape, m: a round shape never occludes too much.
Eigen::Vector3d box_inside(const Shape& shape) {
  if (shape.kind == ShapeKind::box) return half_extents(shape);
  return half_extents(shape).cwiseProduct(
      Eigen::Vector3d(0.7071, 0.7071, shape.kind == ShapeKind::cylinder ? 1 : 0.7071));
}

}  // namespace

void add_occluders(DrawList& list, const CameraProjection& projection,
                   const Transform<Map, CameraOptical>& T_map_optical,
                   const std::vector<OccluderBox>& building, const WorldSnapshot& world) {
  const Transform<CameraOptical, Map> T_optical_map = T_map_optical.inverse();
  std::set<std::string> replaced;
  const auto each_real = [&](auto&& visit) {
    for_each_body(world, [&](const BodyDefinition& body, const BodyState& state) {
      if (!body.injectable && body.owner != BodyOwner::agent && state.T_map_body.finite())
        visit(body, state.T_map_body, state.known);
    });
  };
  each_real([&](const BodyDefinition& body, const Transform<Map, Body>&, bool) {
    if (body.owner == BodyOwner::building) replaced.insert(body.entity);
  });
  for (const OccluderBox& box : building)
    if (!replaced.count(box.name)) add_occluder(list, projection, T_optical_map * box.T_map_box, box.half);
  each_real([&](const BodyDefinition& body, const Transform<Map, Body>& T_map_body, bool known) {
    const bool carries =
        body.owner == BodyOwner::real_robot && carries_camera(body, T_map_body, T_map_optical.translation());
    if (carries || !known) return;
    for (const Shape& shape : body.shapes) {
      const auto T_optical_shape = T_optical_map * T_map_body * shape.T_body_shape;
      if (shape.kind == ShapeKind::mesh) {
        add_occluder(list, projection, T_optical_shape, shape);
      } else {
        add_occluder(list, projection, T_optical_shape, box_inside(shape));
      }
    }
  });
}

}  // namespace parhelion::render
