#include "server/station/foxglove/mesh_scene.hpp"

#include <algorithm>

#include "protocols/coarse_mesh.hpp"
#include "server/station/foxglove/scene_entity.hpp"

namespace parhelion::station::foxglove {
namespace {

constexpr std::size_t kMaxTriangles = 5000;

bool has_mesh(const std::vector<Shape>* shapes) {
  return shapes != nullptr && std::any_of(shapes->begin(), shapes->end(),
                                          [](const Shape& shape) { return shape.mesh != nullptr; });
}

}  // namespace

bool MeshScene::take(const WorldMessage& world, const simulation::EntityShapes& shapes) {
  names_.clear(), bodies_.clear(), frames_.clear();
  for (const WorldMessage::Entry& body : world.bodies) {
    if (!has_mesh(shapes.find(body.entity, body.part))) continue;
    names_.push_back(body.entity + "/" + body.part);
    bodies_.push_back(&body);
  }
  for (std::size_t i = 0; i < names_.size(); ++i)
    frames_.push_back({"map", names_[i], bodies_[i]->T_map_body.isometry()});
  if (!written_ || names_.size() != written_->size()) return true;
  for (std::size_t i = 0; i < names_.size(); ++i) {
    const auto known = written_->find(names_[i]);
    if (known == written_->end() || known->second != bodies_[i]->epoch) return true;
  }
  return false;
}

void MeshScene::write(const WorldMessage& world, const simulation::EntityShapes& shapes, JsonText& out) {
  out.clear();
  out.open('{').key("deletions").open('[');
  if (!written_) written_.emplace();
  for (const auto& [name, epoch] : *written_) {
    if (std::find(names_.begin(), names_.end(), name) != names_.end()) continue;
    out.open('{').key("timestamp").time(world.stamp.ns).key("type").integer(0);
    out.key("id").string(name).close('}');
  }
  out.close(']').key("entities").open('[');
  for (std::size_t i = 0; i < names_.size(); ++i) {
    Primitives what;
    for (const Shape& shape : *shapes.find(bodies_[i]->entity, bodies_[i]->part)) {
      if (!shape.mesh) continue;
      const TriangleMesh mesh = coarse_mesh(*shape.mesh, kMaxTriangles);
      add_triangles(shape.T_body_shape.isometry(), mesh.vertices, mesh.triangles, seen(shape.material.albedo),
                    what.triangles);
    }
    write_entity(world.stamp.ns, names_[i], names_[i], {{"entity", bodies_[i]->entity}}, what, out);
  }
  out.close(']').close('}');
  written_->clear();
  for (std::size_t i = 0; i < names_.size(); ++i) written_->emplace(names_[i], bodies_[i]->epoch);
}

}  // namespace parhelion::station::foxglove
