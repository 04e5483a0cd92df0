#include "tools/robot/urdf_outline.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "protocols/convex_hull.hpp"
#include "protocols/yaml/document.hpp"
#include "server/simulation/robots/urdf.hpp"
#include "server/simulation/robots/urdf_meshes.hpp"

namespace parhelion::tools {
namespace {

constexpr int kCorners = 24;  // at most, of a footprint

/// Points whose convex hull is about the shape, in the link's frame.
std::vector<Eigen::Vector3d> extreme_points(const Shape& shape) {
  std::vector<Eigen::Vector3d> points;
  const Eigen::Isometry3d T = shape.T_body_shape.isometry();
  if (shape.kind == ShapeKind::mesh) {
    for (const Eigen::Vector3d& corner : hull_corners(shape.mesh->vertices)) points.emplace_back(T * corner);
    return points;
  }
  if (shape.kind == ShapeKind::box) {
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d sign(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5);
      points.emplace_back(T * sign.cwiseProduct(shape.size));
    }
    return points;
  }
  const double radius = shape.size.x();
  const double half = shape.kind == ShapeKind::sphere ? 0 : shape.size.z() / 2;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCorners;
    const Eigen::Vector3d rim(radius * std::cos(angle), radius * std::sin(angle), 0);
    for (const double z : {-half, half}) points.emplace_back(T * (rim + Eigen::Vector3d(0, 0, z)));
    if (shape.kind != ShapeKind::cylinder) points.emplace_back(T * Eigen::Vector3d(rim.x(), 0, rim.y()));
  }
  return points;
}

/// The corners that are the farthest in evenly distributed directions, rounded to the millimetre.
std::vector<Eigen::Vector2d> few_corners(const std::vector<Eigen::Vector3d>& points) {
  std::vector<Eigen::Vector2d> corners;
  for (int i = 0; i < kCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCorners;
    const Eigen::Vector3d direction(std::cos(angle), std::sin(angle), 0);
    const auto farthest = std::max_element(points.begin(), points.end(), [&](const auto& a, const auto& b) {
      return a.dot(direction) < b.dot(direction);
    });
    corners.emplace_back((farthest->head<2>() * 1000).array().round() / 1000);
  }
  return convex_hull(std::move(corners));
}

/// Fills `left_out` and `lacks_base`.
void find_left_out(const simulation::UrdfRobot& urdf, UrdfOutline& outline) {
  std::vector<bool> fixed_to_root(urdf.links.size(), true);  // parents come before children
  for (const simulation::RobotJoint& joint : urdf.joints)
    fixed_to_root[joint.child] = fixed_to_root[joint.parent] && joint.kind == simulation::JointKind::fixed;
  double mass = 0;
  bool base_left_out = false, base_has_shape = false;
  for (std::size_t i = 0; i < urdf.links.size(); ++i) {
    const simulation::RobotLink& link = urdf.links[i];
    const bool any_shape = !link.solid.empty() || !link.visible.empty();
    base_has_shape = base_has_shape || (fixed_to_root[i] && any_shape);
    const auto has = [&](const std::vector<std::string>& names) {
      return std::find(names.begin(), names.end(), link.name) != names.end();
    };
    if (!has(urdf.solid_left_out) && !(has(urdf.visible_left_out) && link.solid.empty())) continue;
    outline.left_out.push_back(link.name);
    mass += link.mass;
    base_left_out = base_left_out || fixed_to_root[i];
  }
  outline.lacks_base =
      !outline.left_out.empty() && ((base_left_out && !base_has_shape) || 2 * mass > outline.mass);
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

}  // namespace

Result<UrdfOutline> read_urdf_outline(const std::string& path) {
  const auto text = yaml::read_text(path);
  if (!text) return text.error();
  simulation::EmbeddedUrdf embedded = simulation::embed_meshes(*text, path);
  const auto urdf = simulation::read_urdf(embedded.urdf, path, {});
  if (!urdf) return urdf.error();
  UrdfOutline outline;
  outline.warnings = std::move(embedded.warnings);
  outline.warnings.insert(outline.warnings.end(), urdf->angle_warnings.begin(), urdf->angle_warnings.end());
  outline.name = std::filesystem::path(path).stem().string();
  outline.root = urdf->links.front().name;
  std::vector<Eigen::Isometry3d> T_root_link{Eigen::Isometry3d::Identity()};
  for (const simulation::RobotJoint& joint : urdf->joints)
    T_root_link.push_back(T_root_link[joint.parent] * joint.T_parent_child.isometry());
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < urdf->links.size(); ++i) {
    const simulation::RobotLink& link = urdf->links[i];
    outline.mass += link.mass;
    for (const Shape& shape : link.solid.empty() ? link.visible : link.solid) {
      for (const Eigen::Vector3d& point : extreme_points(shape)) points.emplace_back(T_root_link[i] * point);
    }
  }
  find_left_out(*urdf, outline);
  double top = 0;
  // By convention base_footprint lies on the floor.
  const auto ground = std::find_if(urdf->links.begin(), urdf->links.end(),
                                   [](const auto& link) { return link.name == "base_footprint"; });
  if (ground != urdf->links.end())
    outline.floor = T_root_link[static_cast<std::size_t>(ground - urdf->links.begin())].translation().z();
  if (!points.empty()) {
    const auto by_height = [](const auto& a, const auto& b) { return a.z() < b.z(); };
    const auto [lowest, highest] = std::minmax_element(points.begin(), points.end(), by_height);
    if (ground == urdf->links.end()) outline.floor = lowest->z();
    top = highest->z();
    outline.footprint = few_corners(points);
  }
  if (!points.empty()) outline.height = std::max(0.0, top - outline.floor);
  for (std::size_t i = 0; i < urdf->links.size(); ++i) {
    outline.links.push_back(urdf->links[i].name);
    outline.T_base_link[urdf->links[i].name] = Eigen::Translation3d(0, 0, -outline.floor) * T_root_link[i];
  }
  return outline;
}

std::vector<std::string> links_named(const UrdfOutline& urdf, const std::vector<std::string>& words) {
  std::vector<std::string> found;
  for (auto word = words.rbegin(); word != words.rend(); ++word) {
    for (const std::string& link : urdf.links) {
      const bool known = std::find(found.begin(), found.end(), link) != found.end();
      if (!known && lower(link).find(*word) != std::string::npos) found.push_back(link);
    }
  }
  return found;
}

}  // namespace parhelion::tools
