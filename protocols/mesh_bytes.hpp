// Meshes as bytes, which a session log embeds.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocols/shape_mesh.hpp"
#include "protocols/status.hpp"

namespace parhelion {

/// Triangles of one colour.
struct MeshPart {
  std::vector<Eigen::Vector3f> vertices;  ///< m
  std::vector<MeshTriangle> triangles;
  std::optional<Eigen::Vector3f> albedo;  ///< linear RGB, 0..1; none: unknown
};

/// Little-endian: "PHM1", number of parts; of each: colour, vertices, triangles.
std::vector<std::uint8_t> pack_mesh(const std::vector<MeshPart>& parts);
/// Error: not packed by pack_mesh(), or damaged. Every count is checked before it is used.
Result<std::vector<MeshPart>> unpack_mesh(std::span<const std::uint8_t> bytes);

}  // namespace parhelion
