#include "protocols/model_objects.hpp"

#include <array>
#include <set>

#include "protocols/model_mesh.hpp"
#include "protocols/yaml/parts.hpp"
#include "protocols/yaml/schema.hpp"
#include "protocols/yaml/utf8.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion {
namespace {

using yaml::Node;
using yaml::Quantity;

constexpr std::array<const char*, 14> kKindNames{"chair",  "table", "counter", "cupboard", "sofa",
                                                 "bed",    "shelf", "plant",   "bin",      "box",
                                                 "person", "car",   "kerb",    "object"};

constexpr std::array<const char*, 4> kPostureNames{"unknown", "standing", "sitting", "lying"};

ModelObject read_object(const Node& node, yaml::Problems& problems) {
  ModelObject object;
  yaml::read(node, "name", object.name);
  yaml::read(node, "kind", kKindNames, object.kind);
  yaml::read(node, "posture", kPostureNames, object.posture);
  if (object.posture != Posture::unknown && object.kind != ObjectKind::person)
    problems.add(node.find("posture")->line, "'posture': only a person has one");
  yaml::read(node, "pose", object.T_map_body, problems);
  object.size = yaml::vector3(*node.find("size"));
  yaml::read(node, "confidence", object.confidence);
  yaml::read(node, "movable", object.movable);
  yaml::read(node, "on", object.on);
  yaml::read(node, "under", object.under);
  if (const Node* beside = node.find("beside")) {
    for (const Node& name : beside->items) object.beside.push_back(name.text);
  }
  if (const Node* mesh = node.find("mesh")) {
    object.mesh = read_triangles(*mesh, problems);
    object.mesh.name = object.name;
    if (const Status status = check_mesh(object.mesh); !status)
      problems.add(mesh->line, "mesh of '" + yaml::printable(object.name) + "': " + status.error().message);
  }
  return object;
}

ModelDoubt read_doubt(const Node& node) {
  ModelDoubt doubt;
  yaml::read(node, "entity", doubt.entity);
  doubt.place = yaml::vector3(*node.find("place"));
  yaml::read(node, "extent", doubt.extent);
  yaml::read(node, "reason", doubt.reason);
  return doubt;
}

void check_names(const std::vector<ModelObject>& objects, const Node& list, yaml::Problems& problems) {
  std::set<std::string_view> names;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (!names.insert(objects[i].name).second)
      problems.add(list.items[i].line, "name '" + yaml::printable(objects[i].name) +
                                           "' is taken by another object: names must be unique");
  }
}

void write_object(yaml::Writer& writer, const ModelObject& object) {
  writer.begin_item();
  writer.text("name", object.name);
  writer.word("kind", to_string(object.kind));
  if (object.posture != Posture::unknown) writer.word("posture", to_string(object.posture));
  writer.line("pose", yaml::format_isometry(object.T_map_body.isometry()));
  writer.line("size", yaml::format_lengths(object.size.data(), 3));
  writer.number("confidence", object.confidence);
  writer.flag("movable", object.movable);
  if (!object.on.empty()) writer.text("on", object.on);
  if (!object.under.empty()) writer.text("under", object.under);
  writer.texts("beside", object.beside);
  if (!object.mesh.empty()) {
    writer.open("mesh");
    write_triangles(object.mesh, writer);
    writer.close();
  }
  writer.end_item();
}

void write_doubt(yaml::Writer& writer, const ModelDoubt& doubt) {
  writer.begin_item();
  writer.text("entity", doubt.entity);
  writer.line("place", yaml::format_lengths(doubt.place.data(), 3));
  writer.quantity("extent", doubt.extent, Quantity::length);
  writer.text("reason", doubt.reason);
  writer.end_item();
}

}  // namespace

const char* to_string(ObjectKind kind) { return kKindNames.at(static_cast<std::size_t>(kind)); }
const char* to_string(Posture posture) { return kPostureNames.at(static_cast<std::size_t>(posture)); }

Result<ModelRemarks> parse_remarks(const std::string& yaml, const std::string& origin) {
  const auto document = yaml::read_checked(yaml, origin, "model");
  if (!document) return document.error();
  yaml::Problems problems(origin);
  ModelRemarks remarks;
  if (const Node* list = document->find("objects")) {
    for (const Node& node : list->items) remarks.objects.push_back(read_object(node, problems));
    check_names(remarks.objects, *list, problems);
  }
  if (const Node* list = document->find("doubts")) {
    for (const Node& node : list->items) remarks.doubts.push_back(read_doubt(node));
  }
  if (!problems.empty()) return problems.error();
  return remarks;
}

Result<ModelRemarks> load_remarks(const std::string& path) {
  const auto text = yaml::read_text(path);
  if (!text) return text.error();
  return parse_remarks(*text, path);
}

std::string to_yaml(const ModelRemarks& remarks) {
  yaml::Writer writer;
  if (!remarks.objects.empty()) {
    writer.open("objects");
    for (const ModelObject& object : remarks.objects) write_object(writer, object);
    writer.close();
  }
  if (!remarks.doubts.empty()) {
    writer.open("doubts");
    for (const ModelDoubt& doubt : remarks.doubts) write_doubt(writer, doubt);
    writer.close();
  }
  return writer.take();
}

}  // namespace parhelion
