#include "protocols/model.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <tuple>

#include "protocols/codec_wire.hpp"
#include "protocols/model_mesh.hpp"
#include "protocols/model_overlap.hpp"
#include "protocols/nearest_name.hpp"
#include "protocols/yaml/parts.hpp"
#include "protocols/yaml/schema.hpp"
#include "protocols/yaml/utf8.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion {
namespace {

using yaml::Node;
using yaml::Quantity;

constexpr std::array<const char*, kEntityLabels> kLabelNames{
    "wall",   "floor",   "ceiling",         "door",       "stairs", "window",
    "pillar", "unknown", "wall_above_door", "free_space", "ramp"};

constexpr std::array<const char*, 7> kRelationNames{
    "parallel", "orthogonal", "above", "under", "equal_height", "available_inside", "connected_via_joint"};

Material read_material(const Node& node) {
  Material material;
  if (const Node* albedo = node.find("albedo")) material.albedo = yaml::vector3(*albedo).cast<float>();
  yaml::read(node, "roughness", material.roughness);
  yaml::read(node, "metallic", material.metallic);
  yaml::read(node, "laser_reflectivity", material.laser_reflectivity);
  return material;
}

Hinge read_hinge(const Node& node, EntityLabel label, yaml::Problems& problems) {
  Hinge hinge;
  if (label != EntityLabel::door) {
    problems.add(node.line, std::string("'hinge': only a door has one, found it on a ") + to_string(label));
  }
  hinge.axis = yaml::vector2(*node.find("axis"));
  yaml::read(node, "lower", hinge.lower);
  yaml::read(node, "upper", hinge.upper);
  yaml::read(node, "closed", hinge.closed);
  if (!(hinge.lower <= hinge.upper)) {
    problems.add(node.line, "'hinge': expected lower <= upper, found lower " +
                                yaml::format_quantity(hinge.lower, Quantity::angle) + " and upper " +
                                yaml::format_quantity(hinge.upper, Quantity::angle));
  }
  if (!node.find("closed")) hinge.closed = std::max(hinge.lower, std::min(hinge.closed, hinge.upper));
  if (!(hinge.lower <= hinge.closed && hinge.closed <= hinge.upper)) {
    problems.add(node.line, "'hinge': expected closed between lower and upper, found " +
                                yaml::format_quantity(hinge.closed, Quantity::angle));
  }
  return hinge;
}

ModelEntity read_entity(const Node& node, yaml::Problems& problems) {
  ModelEntity entity;
  yaml::read(node, "name", entity.name);
  yaml::read(node, "label", kLabelNames, entity.label);
  yaml::read(node, "pose", entity.T_map_body, problems);
  entity.size = yaml::vector3(*node.find("size"));
  yaml::read(node, "confidence", entity.confidence);
  yaml::read(node, "virtual", entity.is_virtual);
  if (const Node* material = node.find("material")) entity.material = read_material(*material);
  yaml::read(node, "part_of", entity.part_of);
  if (const Node* hinge = node.find("hinge")) entity.hinge = read_hinge(*hinge, entity.label, problems);
  yaml::read(node, "observed", entity.observed);
  yaml::read(node, "locked", entity.locked);
  yaml::read(node, "deleted", entity.deleted);
  return entity;
}

void check_names(const std::vector<ModelEntity>& entities, const Node& list, yaml::Problems& problems) {
  std::map<std::string_view, int> first;
  for (std::size_t i = 0; i < entities.size(); ++i) {
    const int line = list.items[i].line;
    const auto [known, inserted] = first.emplace(entities[i].name, line);
    if (inserted) continue;
    problems.add(line, "name '" + yaml::printable(entities[i].name) + "' is taken by the entity in line " +
                           std::to_string(known->second) + ": names must be unique");
  }
}

void check_overlap(const std::vector<ModelEntity>& entities, const Node& list, yaml::Problems& problems) {
  const auto pair = find_overlap(entities);
  if (!pair) return;
  const ModelEntity& a = entities[pair->first];
  const ModelEntity& b = entities[pair->second];
  problems.add(list.items[pair->second].line,
               std::string("'") + yaml::printable(b.name) + "' overlaps '" + yaml::printable(a.name) +
                   "' (line " + std::to_string(list.items[pair->first].line) + ", both " +
                   to_string(a.label) + "): fraction " +
                   yaml::format_number(std::round(overlap_fraction(a, b) * 1000) / 1000) +
                   " of the smaller one's volume, expected fraction <= 0.5");
}

std::vector<Relation> read_relations(const Node& list, const std::vector<ModelEntity>& entities,
                                     yaml::Problems& problems) {
  std::vector<std::string> names;
  names.reserve(entities.size());
  for (const ModelEntity& entity : entities) names.push_back(entity.name);
  const std::set<std::string_view> known(names.begin(), names.end());
  std::set<std::tuple<RelationKind, std::string, std::string>> seen;
  std::vector<Relation> relations;
  int unknown = 0;
  for (const Node& node : list.items) {
    Relation relation;
    yaml::read(node, "kind", kRelationNames, relation.kind);
    yaml::read(node, "from", relation.from);
    yaml::read(node, "to", relation.to);
    yaml::read(node, "confidence", relation.confidence);
    for (const std::string& name : {relation.from, relation.to}) {
      if (known.contains(name)) continue;
      // Only the first few problems are shown, so the others need no search over all names.
      problems.add(node.line, std::string("relation '") + to_string(relation.kind) +
                                  "': there is no entity '" + yaml::printable(name) + "'" +
                                  (++unknown <= 10 ? suggestion(name, names) : ""));
    }
    if (relation.from == relation.to) {
      problems.add(node.line, std::string("relation '") + to_string(relation.kind) + "': '" +
                                  yaml::printable(relation.from) + "' with itself");
    }
    if (!seen.emplace(relation.kind, relation.from, relation.to).second) {
      problems.add(node.line, std::string("relation '") + to_string(relation.kind) + "' from '" +
                                  yaml::printable(relation.from) + "' to '" + yaml::printable(relation.to) +
                                  "' is given twice");
    }
    relations.push_back(std::move(relation));
  }
  return relations;
}

void write_material(yaml::Writer& writer, const Material& material) {
  writer.open("material");
  std::string albedo = "[";
  for (int i = 0; i < 3; ++i) albedo += (i > 0 ? ", " : "") + yaml::format_number(material.albedo[i]);
  writer.line("albedo", albedo + "]");
  writer.number("roughness", material.roughness);
  writer.number("metallic", material.metallic);
  writer.number("laser_reflectivity", material.laser_reflectivity);
  writer.close();
}

void write_hinge(yaml::Writer& writer, const Hinge& hinge) {
  writer.line("hinge", "{axis: " + yaml::format_lengths(hinge.axis.data(), 2) +
                           ", lower: " + yaml::format_quantity(hinge.lower, Quantity::angle) +
                           ", upper: " + yaml::format_quantity(hinge.upper, Quantity::angle) +
                           ", closed: " + yaml::format_quantity(hinge.closed, Quantity::angle) + "}");
}

/// Default values are left out, so that the special ones are visible.
void write_entity(yaml::Writer& writer, const ModelEntity& entity) {
  writer.begin_item();
  writer.text("name", entity.name);
  writer.word("label", to_string(entity.label));
  writer.line("pose", yaml::format_isometry(entity.T_map_body.isometry()));
  writer.line("size", yaml::format_lengths(entity.size.data(), 3));
  writer.number("confidence", entity.confidence);
  if (entity.observed != 1) writer.number("observed", entity.observed);
  writer.flag("virtual", entity.is_virtual);
  if (!entity.part_of.empty()) writer.text("part_of", entity.part_of);
  if (entity.hinge) write_hinge(writer, *entity.hinge);
  if (entity.locked) writer.flag("locked", true);
  if (entity.deleted) writer.flag("deleted", true);
  write_material(writer, entity.material);
  writer.end_item();
}

void write_relations(yaml::Writer& writer, const std::vector<Relation>& relations) {
  if (relations.empty()) return;
  writer.open("relations");
  for (const Relation& relation : relations) {
    writer.item(std::string("{kind: ") + to_string(relation.kind) + ", from: " +
                yaml::Writer::quote(relation.from) + ", to: " + yaml::Writer::quote(relation.to) +
                ", confidence: " + yaml::format_number(relation.confidence) + "}");
  }
  writer.close();
}

}  // namespace

const char* to_string(EntityLabel label) { return kLabelNames.at(static_cast<std::size_t>(label)); }

const char* to_string(RelationKind kind) { return kRelationNames.at(static_cast<std::size_t>(kind)); }

Result<SemanticModel> parse_model(const std::string& yaml, const std::string& origin) {
  const auto document = yaml::read_checked(yaml, origin, "model");
  if (!document) return document.error();
  yaml::Problems problems(origin);
  SemanticModel model;
  yaml::read(*document, "map_id", model.map_id);
  if (model.map_id.size() > wire::kMaxName)
    problems.add(document->find("map_id")->line,
                 "map_id has " + std::to_string(model.map_id.size()) + " bytes, expected at most " +
                     std::to_string(wire::kMaxName) + ": POSE_COV has no longer one");
  yaml::read(*document, "source", model.source);
  yaml::read(*document, "T_map_cloud", model.T_map_cloud, problems);
  const Node& list = *document->find("entities");
  for (const Node& node : list.items) model.entities.push_back(read_entity(node, problems));
  check_names(model.entities, list, problems);
  if (const Node* relations = document->find("relations"))
    model.relations = read_relations(*relations, model.entities, problems);
  if (const Node* meshes = document->find("meshes")) model.meshes = read_meshes(*meshes, problems);
  if (problems.empty()) check_overlap(model.entities, list, problems);
  if (!problems.empty()) return problems.error();
  return model;
}

Result<SemanticModel> load_model(const std::string& path) {
  const auto text = yaml::read_text(path);
  if (!text) return text.error();
  return parse_model(*text, path);
}

std::string to_yaml(const SemanticModel& model) {
  yaml::Writer writer;
  writer.text("map_id", model.map_id);
  writer.text("source", model.source);
  if (model.T_map_cloud.isometry().matrix() != Eigen::Matrix4d::Identity())
    writer.line("T_map_cloud", yaml::format_isometry(model.T_map_cloud.isometry()));
  if (model.entities.empty()) {
    writer.line("entities", "[]");
  } else {
    writer.open("entities");
    for (const ModelEntity& entity : model.entities) write_entity(writer, entity);
    writer.close();
  }
  write_relations(writer, model.relations);
  write_meshes(model.meshes, writer);
  return writer.take();
}

}  // namespace parhelion
