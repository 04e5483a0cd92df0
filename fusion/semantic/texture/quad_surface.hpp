// A surface of quadrilaterals, each of which gets its own piece of the texture.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace parhelion::semantic {

struct QuadSurface {
  std::vector<Eigen::Vector3f> vertices;            ///< m, map frame
  std::vector<std::array<std::uint32_t, 4>> quads;  ///< counter-clockwise from the free side

  bool empty() const { return quads.empty(); }
};

/// The point of a quad at (s, t) in 0..1: its corners are (0,0), (1,0), (1,1), (0,1).
Eigen::Vector3f quad_point(const QuadSurface& surface, std::size_t quad, float s, float t);
/// Not normalised: its length is about the quad's area, m^2.
Eigen::Vector3f quad_normal(const QuadSurface& surface, std::size_t quad);
/// Appends a surface to another.
void append(QuadSurface& surface, const QuadSurface& more);
/// Leaves out connected pieces of fewer quads, and vertices that no quad needs.
QuadSurface without_small_pieces(const QuadSurface& surface, std::size_t min_quads);

}  // namespace parhelion::semantic
