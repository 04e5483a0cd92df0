#include "fusion/semantic/texture/quad_surface.hpp"

#include <Eigen/Geometry>
#include <limits>
#include <numeric>

namespace parhelion::semantic {
namespace {

/// Disjoint sets of vertices (path halving); the smallest index is the representative.
class Pieces {
 public:
  explicit Pieces(std::size_t size) : parent_(size) {
    std::iota(parent_.begin(), parent_.end(), std::uint32_t{0});
  }
  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = find(a), b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace

Eigen::Vector3f quad_point(const QuadSurface& surface, std::size_t quad, float s, float t) {
  const auto& [a, b, c, d] = surface.quads[quad];
  const Eigen::Vector3f low = surface.vertices[a] + s * (surface.vertices[b] - surface.vertices[a]);
  const Eigen::Vector3f high = surface.vertices[d] + s * (surface.vertices[c] - surface.vertices[d]);
  return low + t * (high - low);
}

Eigen::Vector3f quad_normal(const QuadSurface& surface, std::size_t quad) {
  const auto& [a, b, c, d] = surface.quads[quad];
  return 0.5F * (surface.vertices[c] - surface.vertices[a]).cross(surface.vertices[d] - surface.vertices[b]);
}

void append(QuadSurface& surface, const QuadSurface& more) {
  const auto first = static_cast<std::uint32_t>(surface.vertices.size());
  surface.vertices.insert(surface.vertices.end(), more.vertices.begin(), more.vertices.end());
  for (const auto& [a, b, c, d] : more.quads)
    surface.quads.push_back({a + first, b + first, c + first, d + first});
}

QuadSurface without_small_pieces(const QuadSurface& surface, std::size_t min_quads) {
  Pieces pieces(surface.vertices.size());
  for (const auto& quad : surface.quads)
    for (const std::uint32_t corner : quad) pieces.join(quad[0], corner);
  std::vector<std::size_t> size(surface.vertices.size(), 0);
  for (const auto& quad : surface.quads) ++size[pieces.find(quad[0])];
  constexpr auto kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> index(surface.vertices.size(), kUnused);
  QuadSurface kept;
  for (auto quad : surface.quads) {
    if (size[pieces.find(quad[0])] < min_quads) continue;
    for (std::uint32_t& corner : quad) {
      if (index[corner] == kUnused) {
        index[corner] = static_cast<std::uint32_t>(kept.vertices.size());
        kept.vertices.push_back(surface.vertices[corner]);
      }
      corner = index[corner];
    }
    kept.quads.push_back(quad);
  }
  return kept;
}

}  // namespace parhelion::semantic
