#include "tools/map/gltf.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "protocols/yaml/base64.hpp"

namespace parhelion::tools {
namespace {

using Json = nlohmann::json;

constexpr int kFloat = 5126, kUnsigned = 5125;      // component types
constexpr int kVertices = 34962, kIndices = 34963;  // targets of buffer views
constexpr std::array<std::array<double, 4>, kEntityLabels> kColours{{{0.60, 0.63, 0.68, 1},
                                                                     {0.85, 0.82, 0.75, 1},
                                                                     {0.90, 0.90, 0.90, 0.25},
                                                                     {0.67, 0.25, 0.01, 1},
                                                                     {0.16, 0.26, 0.58, 1},
                                                                     {0.09, 0.42, 1.00, 0.4},
                                                                     {0.30, 0.13, 0.38, 1},
                                                                     {0.55, 0.37, 0.20, 1},
                                                                     {0.39, 0.45, 0.55, 1},
                                                                     {0.30, 0.67, 0.35, 0.3},
                                                                     {0.62, 0.67, 0.75, 1}}};

class Document {
 public:
  Document() {
    json_["asset"] = {{"version", "2.0"}, {"generator", "parhelion"}};
    for (std::size_t i = 0; i < kColours.size(); ++i) {
      Json material = {{"name", to_string(static_cast<EntityLabel>(i))},
                       {"doubleSided", true},
                       {"pbrMetallicRoughness",
                        {{"baseColorFactor", kColours[i]}, {"metallicFactor", 0}, {"roughnessFactor", 0.9}}}};
      if (kColours[i][3] < 1) material["alphaMode"] = "BLEND";
      json_["materials"].push_back(material);
    }
  }

  /// Returns the index of the mesh.
  std::size_t add_mesh(const std::string& name, const std::vector<Eigen::Vector3f>& vertices,
                       const std::vector<Eigen::Vector3f>& normals,
                       const std::vector<std::array<std::uint32_t, 3>>& triangles, std::size_t material) {
    Json attributes = {{"POSITION", add_vectors(vertices)}};
    if (!normals.empty()) attributes["NORMAL"] = add_vectors(normals);
    const std::size_t start = bytes_.size();
    for (const auto& triangle : triangles) {
      for (const std::uint32_t index : triangle) append(index);
    }
    json_["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", start}, {"byteLength", bytes_.size() - start}, {"target", kIndices}});
    json_["accessors"].push_back({{"bufferView", json_["bufferViews"].size() - 1},
                                  {"componentType", kUnsigned},
                                  {"count", 3 * triangles.size()},
                                  {"type", "SCALAR"}});
    json_["meshes"].push_back({{"name", name},
                               {"primitives",
                                {{{"attributes", attributes},
                                  {"indices", json_["accessors"].size() - 1},
                                  {"material", material}}}}});
    return json_["meshes"].size() - 1;
  }

  void add_node(Json node) { json_["nodes"].push_back(std::move(node)); }

  /// The document with all nodes under one that rotates z up to y up.
  std::string take() {
    Json children = Json::array();
    const std::size_t count = json_.contains("nodes") ? json_["nodes"].size() : 0;
    for (std::size_t i = 0; i < count; ++i) children.push_back(i);
    const double half = std::sqrt(0.5);
    Json root = {{"name", "map"}, {"rotation", {-half, 0.0, 0.0, half}}};
    if (count > 0) root["children"] = children;
    add_node(root);
    json_["scenes"] = {{{"nodes", {count}}}};
    json_["scene"] = 0;
    if (!bytes_.empty()) {
      json_["buffers"] = {{{"byteLength", bytes_.size()},
                           {"uri", "data:application/octet-stream;base64," + yaml::to_base64(bytes_)}}};
    }
    return json_.dump(1) + "\n";
  }

 private:
  void append(std::uint32_t word) {
    for (unsigned shift = 0; shift < 32; shift += 8)
      bytes_.push_back(static_cast<std::uint8_t>(word >> shift));
  }

  std::size_t add_vectors(const std::vector<Eigen::Vector3f>& vectors) {
    const std::size_t start = bytes_.size();
    Eigen::Vector3f low = vectors.front(), high = low;
    for (const Eigen::Vector3f& v : vectors) {
      for (int i = 0; i < 3; ++i) append(std::bit_cast<std::uint32_t>(v[i]));
      low = low.cwiseMin(v);
      high = high.cwiseMax(v);
    }
    json_["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", start}, {"byteLength", bytes_.size() - start}, {"target", kVertices}});
    json_["accessors"].push_back({{"bufferView", json_["bufferViews"].size() - 1},
                                  {"componentType", kFloat},
                                  {"count", vectors.size()},
                                  {"type", "VEC3"},
                                  {"min", {low.x(), low.y(), low.z()}},
                                  {"max", {high.x(), high.y(), high.z()}}});
    return json_["accessors"].size() - 1;
  }

  Json json_;
  std::vector<std::uint8_t> bytes_;
};

/// A cube with sides of one metre, each face with its own normal.
std::size_t add_unit_box(Document& document, std::size_t material) {
  std::vector<Eigen::Vector3f> vertices, normals;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (int axis = 0; axis < 3; ++axis) {
    for (const float side : {-0.5F, 0.5F}) {
      const Eigen::Vector3f n = Eigen::Vector3f::Unit(axis) * (2 * side);
      const Eigen::Vector3f u = Eigen::Vector3f::Unit((axis + 1) % 3), v = n.cross(u);
      const auto first = static_cast<std::uint32_t>(vertices.size());
      for (const auto& [a, b] : {std::pair{-0.5F, -0.5F}, {0.5F, -0.5F}, {0.5F, 0.5F}, {-0.5F, 0.5F}}) {
        vertices.push_back(0.5F * n + a * u + b * v);
        normals.push_back(n);
      }
      triangles.push_back({first, first + 1, first + 2});
      triangles.push_back({first, first + 2, first + 3});
    }
  }
  return document.add_mesh("box", vertices, normals, triangles, material);
}

}  // namespace

std::string to_gltf(const SemanticModel& model) {
  Document document;
  std::array<std::optional<std::size_t>, kColours.size()> boxes;  // one mesh per label
  for (const ModelEntity& e : model.entities) {
    if (e.deleted) continue;
    const auto label = static_cast<std::size_t>(e.label);
    if (!boxes[label]) boxes[label] = add_unit_box(document, label);
    const Eigen::Quaterniond q = e.T_map_body.quaternion();
    const Eigen::Vector3d p = e.T_map_body.translation();
    Json extras = {{"label", to_string(e.label)}, {"confidence", e.confidence}};
    if (!e.part_of.empty()) extras["part_of"] = e.part_of;
    document.add_node({{"name", e.name},
                       {"mesh", *boxes[label]},
                       {"translation", {p.x(), p.y(), p.z()}},
                       {"rotation", {q.x(), q.y(), q.z(), q.w()}},
                       {"scale", {e.size.x(), e.size.y(), e.size.z()}},
                       {"extras", extras}});
  }
  for (const ModelMesh& mesh : model.meshes) {
    if (mesh.empty()) continue;
    const auto unknown = static_cast<std::size_t>(EntityLabel::unknown);
    document.add_node({{"name", mesh.name},
                       {"mesh", document.add_mesh(mesh.name, mesh.vertices, {}, mesh.triangles, unknown)},
                       {"extras", {{"label", "unknown"}}}});
  }
  return document.take();
}

}  // namespace parhelion::tools
