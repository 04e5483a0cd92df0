// Reading and writing of parts shared by several documents: values by key, poses, points. Nodes have passed
// check().
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <string>
#include <string_view>

#include "protocols/frames.hpp"
#include "protocols/yaml/document.hpp"

namespace parhelion::yaml {

/// Each leaves `out` unchanged where the key is absent.
void read(const Node& map, std::string_view key, double& out);
void read(const Node& map, std::string_view key, float& out);
void read(const Node& map, std::string_view key, int& out);
void read(const Node& map, std::string_view key, bool& out);
void read(const Node& map, std::string_view key, std::uint64_t& out);
void read(const Node& map, std::string_view key, std::string& out);

/// `names`: in the order of the enumeration.
template <class Enum, std::size_t n>
void read(const Node& map, std::string_view key, const std::array<const char*, n>& names, Enum& out) {
  const Node* node = map.find(key);
  if (node == nullptr) return;
  for (std::size_t i = 0; i < n; ++i) {
    if (node->text == names[i]) out = static_cast<Enum>(i);
  }
}

Eigen::Vector2d vector2(const Node& list);
Eigen::Vector3d vector3(const Node& list);
/// "[1 m, 2 m]"
std::string format_lengths(const double* values, std::size_t count);

/// A pose (parts.schema.json); contradictions go to `problems`.
Eigen::Isometry3d read_isometry(const Node& map, Problems& problems);
/// "{x: 1 m, yaw: 90 deg}": the shortest of its forms that is read back to exactly this isometry.
std::string format_isometry(const Eigen::Isometry3d& isometry);

/// A camera's pose: for axes: link the rotation to optical axes is added.
Eigen::Isometry3d read_camera_isometry(const Node& map, Problems& problems);
std::string format_camera_isometry(const Eigen::Isometry3d& isometry);

template <class A, class B>
void read(const Node& map, std::string_view key, Transform<A, B>& out, Problems& problems) {
  if (const Node* node = map.find(key)) out = Transform<A, B>(read_isometry(*node, problems));
}

}  // namespace parhelion::yaml
