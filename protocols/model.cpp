#include "protocols/model.hpp"

#include <map>

#include "protocols/model_overlap.hpp"
#include "protocols/yaml/parts.hpp"
#include "protocols/yaml/schema.hpp"
#include "protocols/yaml/utf8.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion {
namespace {

using yaml::Node;
using yaml::Quantity;

constexpr std::array<const char*, 10> label_names{
    "wall",   "floor",   "ceiling",         "door",      "stairs", "window",
    "pillar", "unknown", "wall_above_door", "free_space"};

Material read_material(const Node& node) {
  Material material;
  if (const Node* albedo = node.find("albedo")) material.albedo = yaml::vector3(*albedo).cast<float>();
  yaml::read(node, "roughness", material.roughness);
  yaml::read(node, "metallic", material.metallic);
  yaml::read(node, "laser_reflectivity", material.laser_reflectivity);
  return material;
}

ModelEntity read_entity(const Node& node, yaml::Problems& problems) {
  ModelEntity entity;
  yaml::read(node, "name", entity.name);
  yaml::read(node, "label", label_names, entity.label);
  yaml::read(node, "pose", entity.T_map_body, problems);
  entity.size = yaml::vector3(*node.find("size"));
  yaml::read(node, "confidence", entity.confidence);
  yaml::read(node, "virtual", entity.is_virtual);
  if (const Node* material = node.find("material")) entity.material = read_material(*material);
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
                   to_string(a.label) + "): share " +
                   yaml::format_number(std::round(overlap_share(a, b) * 1000) / 1000) +
                   " of the smaller one's volume, expected share <= 0.5");
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

}  // namespace

const char* to_string(EntityLabel label) { return label_names.at(static_cast<std::size_t>(label)); }

Result<SemanticModel> parse_model(const std::string& yaml, const std::string& origin) {
  auto document = yaml::read_document(yaml, origin);
  if (!document) return document.error();
  yaml::Problems problems(origin);
  yaml::check(*document, "model", problems);
  if (!problems.empty()) return problems.error();
  SemanticModel model;
  yaml::read(*document, "map_id", model.map_id);
  yaml::read(*document, "source", model.source);
  const Node& list = *document->find("entities");
  for (const Node& node : list.items) model.entities.push_back(read_entity(node, problems));
  check_names(model.entities, list, problems);
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
  if (model.entities.empty()) {
    writer.line("entities", "[]");
    return writer.take();
  }
  writer.open("entities");
  for (const ModelEntity& entity : model.entities) {
    writer.begin_item();
    writer.text("name", entity.name);
    writer.word("label", to_string(entity.label));
    writer.line("pose", yaml::format_isometry(entity.T_map_body.isometry()));
    writer.line("size", yaml::format_lengths(entity.size.data(), 3));
    writer.number("confidence", entity.confidence);
    writer.flag("virtual", entity.is_virtual);
    write_material(writer, entity.material);
    writer.end_item();
  }
  writer.close();
  return writer.take();
}

}  // namespace parhelion
