#include "protocols/model_mesh.hpp"

#include <bit>
#include <string>

#include "protocols/yaml/base64.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion {
namespace {

constexpr std::size_t kRowBytes = 12;  // of three floats or three indices
constexpr float kFarthest = 1e6F;      // m

std::uint32_t little_endian(const std::uint8_t* bytes) {
  return static_cast<std::uint32_t>(bytes[0]) | static_cast<std::uint32_t>(bytes[1]) << 8U |
         static_cast<std::uint32_t>(bytes[2]) << 16U | static_cast<std::uint32_t>(bytes[3]) << 24U;
}

void append_little_endian(std::uint32_t value, std::vector<std::uint8_t>& bytes) {
  for (unsigned shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::uint8_t>(value >> shift));
}

/// Calls row(three words) for each twelve bytes of a !!binary value.
template <class Row>
void read_rows(const yaml::Node& node, const char* key, yaml::Problems& problems, Row row) {
  const auto bytes = yaml::from_base64(node.text);
  if (!bytes) return problems.add(node.line, std::string("'") + key + "': " + bytes.error().message);
  if (bytes->size() % kRowBytes != 0) {
    return problems.add(node.line, std::string("'") + key + "': expected a multiple of 12 bytes, found " +
                                       std::to_string(bytes->size()));
  }
  for (std::size_t i = 0; i < bytes->size(); i += kRowBytes) {
    const std::uint8_t* at = bytes->data() + i;
    row(std::array{little_endian(at), little_endian(at + 4), little_endian(at + 8)});
  }
}

/// In lines of 76 characters, as a block separate from the keys.
void write_binary(const char* key, std::span<const std::uint8_t> bytes, yaml::Writer& writer) {
  writer.block(key, "!!binary", yaml::to_base64(bytes), 76);
}

}  // namespace

ModelMesh read_triangles(const yaml::Node& node, yaml::Problems& problems) {
  ModelMesh mesh;
  read_rows(*node.find("vertices"), "vertices", problems, [&](const std::array<std::uint32_t, 3>& words) {
    mesh.vertices.emplace_back(std::bit_cast<float>(words[0]), std::bit_cast<float>(words[1]),
                               std::bit_cast<float>(words[2]));
  });
  read_rows(*node.find("triangles"), "triangles", problems,
            [&](const std::array<std::uint32_t, 3>& words) { mesh.triangles.push_back(words); });
  return mesh;
}

Status check_mesh(const ModelMesh& mesh) {
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (mesh.vertices[i].allFinite() && mesh.vertices[i].cwiseAbs().maxCoeff() <= kFarthest) continue;
    return Error{"vertex " + std::to_string(i) + ": expected finite coordinates of at most 1000 km"};
  }
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const std::uint32_t index : mesh.triangles[i]) {
      if (index < mesh.vertices.size()) continue;
      return Error{"triangle " + std::to_string(i) + ": expected vertices < " +
                   std::to_string(mesh.vertices.size()) + ", found " + std::to_string(index)};
    }
  }
  return {};
}

std::vector<ModelMesh> read_meshes(const yaml::Node& list, yaml::Problems& problems) {
  std::vector<ModelMesh> meshes;
  std::size_t triangles = 0;
  for (const yaml::Node& node : list.items) {
    meshes.push_back(read_triangles(node, problems));
    meshes.back().name = node.find("name")->text;
    if (const Status status = check_mesh(meshes.back()); !status)
      problems.add(node.line,
                   "mesh '" + yaml::printable(meshes.back().name) + "': " + status.error().message);
    triangles += meshes.back().triangles.size();
  }
  if (triangles > kMaxModelTriangles) {
    problems.add(list.line, "'meshes': expected at most " + std::to_string(kMaxModelTriangles) +
                                " triangles in all, found " + std::to_string(triangles));
  }
  return meshes;
}

void write_triangles(const ModelMesh& mesh, yaml::Writer& writer) {
  writer.word("unit", "m");
  std::vector<std::uint8_t> bytes;
  for (const Eigen::Vector3f& vertex : mesh.vertices) {
    for (int i = 0; i < 3; ++i) append_little_endian(std::bit_cast<std::uint32_t>(vertex[i]), bytes);
  }
  write_binary("vertices", bytes, writer);
  bytes.clear();
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t index : triangle) append_little_endian(index, bytes);
  }
  write_binary("triangles", bytes, writer);
}

void write_meshes(const std::vector<ModelMesh>& meshes, yaml::Writer& writer) {
  if (meshes.empty()) return;
  writer.open("meshes");
  for (const ModelMesh& mesh : meshes) {
    writer.begin_item();
    writer.text("name", mesh.name);
    write_triangles(mesh, writer);
    writer.end_item();
  }
  writer.close();
}

}  // namespace parhelion
