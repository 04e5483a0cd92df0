#include "fusion/semantic/texture/model_surface.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "fusion/cloud/parallel.hpp"
#include "protocols/site_texture.hpp"

namespace parhelion::semantic {
namespace {

constexpr float kNear = 0.12F;     ///< m, as near the measured surface is the model's
constexpr double kThrough = 0.15;  ///< m behind a point: the image saw through it
constexpr int kWitnesses = 2;      ///< images that must have
constexpr double kAround = 0.04;   ///< m around a door's leaf
constexpr int kMaxCells = 400;     ///< along an edge

/// A face of a box: half extents a and b span it, n points outwards.
struct Face {
  Eigen::Vector3d middle, a, b;
};

void add_face(const Face& face, double cell, const ModelEntity& entity, QuadSurface& surface) {
  const auto cells = [&](const Eigen::Vector3d& half) {
    return std::clamp(static_cast<int>(std::ceil(2 * half.norm() / cell)), 1, kMaxCells);
  };
  const int columns = cells(face.a), rows = cells(face.b);
  const auto first = static_cast<std::uint32_t>(surface.vertices.size());
  for (int row = 0; row <= rows; ++row) {
    for (int column = 0; column <= columns; ++column) {
      const double s = 2.0 * column / columns - 1, t = 2.0 * row / rows - 1;
      surface.vertices.push_back(
          (entity.T_map_body * Eigen::Vector3d(face.middle + s * face.a + t * face.b)).cast<float>());
    }
  }
  const auto at = [&](int column, int row) {
    return first + static_cast<std::uint32_t>(row * (columns + 1) + column);
  };
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      surface.quads.push_back(
          {at(column, row), at(column + 1, row), at(column + 1, row + 1), at(column, row + 1)});
}

/// Undersides are not seen, and of a floor or ramp only the top, of a ceiling only the bottom.
bool shows(EntityLabel label, int axis, int sign) {
  if (is_ground(label)) return axis == 2 && sign > 0;
  if (label == EntityLabel::ceiling) return axis == 2 && sign < 0;
  return axis != 2 || sign > 0;
}

void add_box(const ModelEntity& entity, double cell, QuadSurface& surface) {
  const Eigen::Vector3d half = entity.size / 2;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int sign : {-1, 1}) {
      if (!shows(entity.label, axis, sign)) continue;
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      Face face{sign * half[axis] * Eigen::Vector3d::Unit(axis), half[u] * Eigen::Vector3d::Unit(u),
                half[v] * Eigen::Vector3d::Unit(v)};
      if (sign < 0) std::swap(face.a, face.b);
      add_face(face, cell, entity, surface);
    }
  }
}

bool is_usable(const ModelEntity& entity) {
  return entity.T_map_body.finite() && entity.size.allFinite() && entity.size.minCoeff() > 0;
}

/// The cubes of the grid that hold measured vertices.
class Cubes {
 public:
  explicit Cubes(const QuadSurface& surface) {
    for (const Eigen::Vector3f& vertex : surface.vertices) keys_.insert(key(vertex));
  }
  bool near(const Eigen::Vector3f& p) const {
    const Key middle = key(p);
    for (int i = 0; i < 27; ++i)
      if (keys_.contains({middle[0] + i % 3 - 1, middle[1] + i / 3 % 3 - 1, middle[2] + i / 9 - 1}))
        return true;
    return false;
  }

 private:
  using Key = std::array<int, 3>;
  static Key key(const Eigen::Vector3f& p) {
    const Eigen::Array3i cube = (p / kNear).array().floor().cast<int>();
    return {cube.x(), cube.y(), cube.z()};
  }
  std::set<Key> keys_;
};

bool seen_through(const Eigen::Vector3f& point, std::span<const DepthView> views,
                  std::span<const Eigen::Isometry3d> T_optical_map) {
  int witnesses = 0;
  for (std::size_t v = 0; v < views.size() && witnesses < kWitnesses; ++v) {
    const Eigen::Vector3d p = T_optical_map[v] * point.cast<double>();
    if (p.z() < 0.1) continue;
    const Eigen::Vector2d pixel = views[v].camera.project(p);
    if (!views[v].camera.contains(pixel)) continue;
    const std::size_t at =
        views[v].camera.at(static_cast<int>(pixel.x() + 0.5), static_cast<int>(pixel.y() + 0.5));
    witnesses += views[v].millimetres[at] * 1e-3 > p.z() + kThrough;
  }
  return witnesses >= kWitnesses;
}

/// Keeps the quads for which `keep` holds; vertices stay.
template <class Keep>
QuadSurface filtered(const QuadSurface& surface, int threads, const Keep& keep) {
  std::vector<std::uint8_t> kept(surface.quads.size());
  cloud::for_each_chunk(kept.size(), 1024, threads, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) kept[i] = keep(quad_point(surface, i, 0.5F, 0.5F));
  });
  QuadSurface result{surface.vertices, {}};
  for (std::size_t i = 0; i < kept.size(); ++i)
    if (kept[i]) result.quads.push_back(surface.quads[i]);
  return without_small_pieces(result, 1);
}

}  // namespace

QuadSurface surface_of(const SemanticModel& model, double cell) {
  QuadSurface surface;
  for (const ModelEntity& entity : model.entities) {
    if (is_solid(entity) && !entity.is_virtual && entity.label != EntityLabel::window &&
        !is_left_out_of_texture(entity) && is_usable(entity))
      add_box(entity, cell, surface);
  }
  for (const ModelMesh& mesh : model.meshes) {
    QuadSurface triangles{mesh.vertices, {}};
    for (const auto& [a, b, c] : mesh.triangles) triangles.quads.push_back({a, b, c, c});
    append(surface, triangles);
  }
  return surface;
}

QuadSurface unmeasured(const QuadSurface& model, const QuadSurface& measured,
                       std::span<const DepthView> views, int threads) {
  const Cubes cubes(measured);
  std::vector<Eigen::Isometry3d> T_optical_map;
  for (const DepthView& view : views) T_optical_map.push_back(view.T_map_optical.inverse().isometry());
  return filtered(model, threads, [&](const Eigen::Vector3f& middle) {
    return !cubes.near(middle) && !seen_through(middle, views, T_optical_map);
  });
}

QuadSurface without_moving(const QuadSurface& surface, const SemanticModel& model) {
  std::vector<const ModelEntity*> moving;
  for (const ModelEntity& entity : model.entities)
    if (is_left_out_of_texture(entity) && !entity.deleted && is_usable(entity)) moving.push_back(&entity);
  if (moving.empty()) return surface;
  return filtered(surface, 0, [&](const Eigen::Vector3f& middle) {
    return std::none_of(moving.begin(), moving.end(), [&](const ModelEntity* entity) {
      const Eigen::Vector3d p = entity->T_map_body.inverse() * middle.cast<double>();
      return (p.cwiseAbs() - entity->size / 2).maxCoeff() < kAround;
    });
  });
}

}  // namespace parhelion::semantic
