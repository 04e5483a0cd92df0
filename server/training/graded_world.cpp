#include "server/training/graded_world.hpp"

#include <algorithm>
#include <cmath>

#include "protocols/line_in_box.hpp"

namespace parhelion::training {

GradedWorld::GradedWorld(const SemanticModel& model, const RobotDescription& description, std::string robot)
    : model_(model), description_(description), robot_(std::move(robot)) {}

void GradedWorld::take(const Event& event) {
  if (event.subject != robot_) return;
  const bool of_first_laser = event.object.empty();
  switch (event.kind) {
    case EventKind::zone_entered:
      zones_.insert(event.object);
      break;
    case EventKind::zone_left:
      zones_.erase(event.object);
      break;
    case EventKind::movement_started:
      moves_ = true;
      break;
    case EventKind::movement_stopped:
      moves_ = false;
      break;
    case EventKind::injection_suspended:
      injection_live_ = injection_live_ && !of_first_laser;
      break;
    case EventKind::injection_active:
      injection_live_ = injection_live_ || of_first_laser;
      break;
    case EventKind::agent_hidden:
      withheld_.insert(event.object);
      break;
    case EventKind::agent_shown:
      withheld_.erase(event.object);
      break;
    default:
      break;
  }
}

/// Usually the same bodies with new poses.
void GradedWorld::take(const WorldMessage& world) {
  const bool same = std::equal(bodies_.begin(), bodies_.end(), world.bodies.begin(), world.bodies.end(),
                               [](const auto& a, const auto& b) { return a.entity == b.entity; });
  bodies_ = world.bodies;
  if (same) return;
  first_.clear();
  for (std::size_t i = 0; i < bodies_.size(); ++i) first_.try_emplace(bodies_[i].entity, i);
}

const WorldMessage::Entry* GradedWorld::find_body(const std::string& entity) const {
  const auto at = first_.find(entity);
  return at == first_.end() ? nullptr : &bodies_[at->second];
}

const ModelEntity* GradedWorld::find_entity(const std::string& name) const {
  const auto at = std::find_if(model_.entities.begin(), model_.entities.end(),
                               [&](const ModelEntity& entity) { return entity.name == name; });
  return at == model_.entities.end() ? nullptr : &*at;
}

const ModelEntity* GradedWorld::top_of(const std::string& flight) const {
  const ModelEntity* top = nullptr;
  const auto height = [](const ModelEntity& step) {
    return step.T_map_body.translation().z() + step.size.z() / 2;
  };
  for (const ModelEntity& entity : model_.entities) {
    if (entity.label != EntityLabel::stairs || entity.part_of != flight || !is_solid(entity)) continue;
    if (!top || height(entity) > height(*top)) top = &entity;
  }
  return top;
}

std::optional<Eigen::Vector3d> GradedWorld::place_of(const std::string& entity) const {
  if (const auto* body = find_body(entity)) return body->T_map_body.translation();
  if (const ModelEntity* part = find_entity(entity)) return part->T_map_body.translation();
  return std::nullopt;
}

std::optional<double> GradedWorld::distance_to(const std::string& entity) const {
  const auto* robot = find_body(robot_);
  const auto place = place_of(entity);
  if (!robot || !place) return std::nullopt;
  return (*place - robot->T_map_body.translation()).head<2>().norm();
}

bool GradedWorld::is_near(const std::string& entity, double max_distance) const {
  const auto distance = distance_to(entity);
  const bool seen = injection_live_ && !withheld_.contains(entity);
  return distance && *distance <= max_distance && (seen || find_entity(entity));
}

std::optional<GradedWorld::Motion> GradedWorld::motion() const {
  const auto* robot = find_body(robot_);
  if (!robot) return std::nullopt;
  const Eigen::Matrix3d R = robot->T_map_body.rotation();
  Motion motion;
  motion.pitch = std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2)));
  motion.roll = std::atan2(R(2, 1), R(2, 2));
  motion.yaw_rate = R.col(2).dot(robot->rotation_rate);
  motion.speed = robot->velocity.norm();
  return motion;
}

bool GradedWorld::sees(const std::string& entity, double max_distance) const {
  const auto* robot = find_body(robot_);
  const auto place = place_of(entity);
  if (!robot || !place || !description_.camera) return false;
  const CameraDescription& camera = *description_.camera;
  const Eigen::Isometry3d T_map_optical = robot->T_map_body.isometry() * camera.T_base_optical.isometry();
  const Eigen::Vector3d p = T_map_optical.inverse(Eigen::Isometry) * *place;
  if (p.z() <= 0 || p.norm() > max_distance) return false;
  // Distortion is small near the image centre and neglected.
  const CameraIntrinsics& lens = camera.intrinsics;
  const double u = lens.fx * p.x() / p.z() + lens.cx, v = lens.fy * p.y() / p.z() + lens.cy;
  if (u < 0 || v < 0 || u >= lens.width || v >= lens.height) return false;
  return !hidden(T_map_optical.translation(), *place, entity);
}

bool GradedWorld::hidden(const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                         const std::string& target) const {
  return std::any_of(model_.entities.begin(), model_.entities.end(), [&](const ModelEntity& entity) {
    if (!is_solid(entity) || entity.name == target || entity.label == EntityLabel::window) return false;
    const auto* moved = find_body(entity.name);
    const Transform<Map, Body>& T_map_body = moved ? moved->T_map_body : entity.T_map_body;
    return line_in_box(T_map_body, entity.size, from, to) > 0;
  });
}

}  // namespace parhelion::training
