#include "protocols/mesh_file.hpp"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <span>

#include "protocols/isolation.hpp"

namespace parhelion {
namespace {

constexpr ChildLimits kLimits{std::uint64_t{1} << 30U, 10};
constexpr std::size_t kMaxParts = 64;  // further colours are shown in the last one's
constexpr unsigned kSteps = aiProcess_Triangulate | aiProcess_JoinIdenticalVertices |
                            aiProcess_RemoveComponent | aiProcess_SortByPType | aiProcess_FindDegenerates;

/// Files state sRGB, but for glTF.
float linear(float c) { return c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F); }

std::optional<Eigen::Vector3f> albedo_of(const aiMaterial& material, bool is_linear) {
  aiString name;
  aiColor4D color;
  if (material.Get(AI_MATKEY_NAME, name) == aiReturn_SUCCESS && name == aiString(AI_DEFAULT_MATERIAL_NAME))
    return std::nullopt;
  if (material.Get(AI_MATKEY_COLOR_DIFFUSE, color) != aiReturn_SUCCESS) return std::nullopt;
  Eigen::Vector3f rgb(color.r, color.g, color.b);
  if (!rgb.allFinite()) return std::nullopt;
  rgb = rgb.cwiseMax(0.F).cwiseMin(1.F);
  return is_linear ? rgb : Eigen::Vector3f(rgb.unaryExpr([](float c) { return linear(c); }));
}

class Collector {
 public:
  Collector(const aiScene& scene, bool is_linear) : scene_(scene), is_linear_(is_linear) {
    add(*scene.mRootNode, aiMatrix4x4());
  }

  std::vector<MeshPart> parts() && { return std::move(parts_); }

 private:
  void add(const aiNode& node, const aiMatrix4x4& T_file_parent) {
    const aiMatrix4x4 T_file_node = T_file_parent * node.mTransformation;
    for (const unsigned index : std::span(node.mMeshes, node.mNumMeshes))
      add(*scene_.mMeshes[index], T_file_node);
    for (const aiNode* child : std::span(node.mChildren, node.mNumChildren)) add(*child, T_file_node);
  }

  void add(const aiMesh& mesh, const aiMatrix4x4& T_file_mesh) {
    MeshPart& part = part_of(albedo_of(*scene_.mMaterials[mesh.mMaterialIndex], is_linear_));
    const auto first = static_cast<std::uint32_t>(part.vertices.size());
    const bool mirrored = T_file_mesh.Determinant() < 0;
    for (const aiVector3D& vertex : std::span(mesh.mVertices, mesh.mNumVertices)) {
      const aiVector3D at = T_file_mesh * vertex;
      part.vertices.emplace_back(at.x, at.y, at.z);
    }
    for (const aiFace& face : std::span(mesh.mFaces, mesh.mNumFaces)) {
      if (face.mNumIndices != 3) continue;  // points and lines
      MeshTriangle triangle{first + face.mIndices[0], first + face.mIndices[1], first + face.mIndices[2]};
      if (mirrored) std::swap(triangle[1], triangle[2]);
      part.triangles.push_back(triangle);
    }
  }

  MeshPart& part_of(const std::optional<Eigen::Vector3f>& albedo) {
    const auto same = std::find_if(parts_.begin(), parts_.end(),
                                   [&](const MeshPart& part) { return part.albedo == albedo; });
    if (same != parts_.end()) return *same;
    if (parts_.size() == kMaxParts) return parts_.back();
    parts_.push_back({{}, {}, albedo});
    return parts_.back();
  }

  const aiScene& scene_;
  bool is_linear_;
  std::vector<MeshPart> parts_;
};

std::size_t triangles_of(const std::vector<MeshPart>& parts) {
  std::size_t count = 0;
  for (const MeshPart& part : parts) count += part.triangles.size();
  return count;
}

/// One vertex, the mean, in each cell of `edge` m; triangles that collapse are left out.
MeshPart merge_vertices(const MeshPart& part, float edge) {
  MeshPart merged{{}, {}, part.albedo};
  std::map<std::array<std::int64_t, 3>, std::uint32_t> cells;
  std::vector<std::uint32_t> merged_of;
  std::vector<float> counts;
  for (const Eigen::Vector3f& vertex : part.vertices) {
    const auto cell = [&](int axis) { return static_cast<std::int64_t>(std::floor(vertex[axis] / edge)); };
    const auto [at, is_new] =
        cells.emplace(std::array{cell(0), cell(1), cell(2)}, static_cast<std::uint32_t>(counts.size()));
    if (is_new) {
      merged.vertices.emplace_back(Eigen::Vector3f::Zero());
      counts.push_back(0);
    }
    merged.vertices[at->second] += vertex;
    ++counts[at->second];
    merged_of.push_back(at->second);
  }
  for (std::size_t i = 0; i < counts.size(); ++i) merged.vertices[i] /= counts[i];
  std::set<MeshTriangle> known;
  for (const MeshTriangle& t : part.triangles) {
    const MeshTriangle to{merged_of[t[0]], merged_of[t[1]], merged_of[t[2]]};
    if (to[0] == to[1] || to[1] == to[2] || to[2] == to[0]) continue;
    if (known.insert(to).second) merged.triangles.push_back(to);
  }
  return merged;
}

float extent_of(const std::vector<MeshPart>& parts) {
  Eigen::Vector3f min = Eigen::Vector3f::Constant(kMeshExtent), max = -min;
  for (const MeshPart& part : parts) {
    for (const Eigen::Vector3f& vertex : part.vertices) {
      min = min.cwiseMin(vertex);
      max = max.cwiseMax(vertex);
    }
  }
  return (max - min).maxCoeff();
}

/// The finest grid, of those that double, whose result is small enough.
std::vector<MeshPart> simplify(std::vector<MeshPart> parts) {
  const std::vector<MeshPart> fine = std::move(parts);
  parts = fine;
  for (float edge = std::max(extent_of(fine) / 512, 1e-6F); triangles_of(parts) > kMaxMeshTriangles;
       edge *= 1.25F) {
    parts.clear();
    for (const MeshPart& part : fine) {
      MeshPart merged = merge_vertices(part, edge);
      if (!merged.triangles.empty()) parts.push_back(std::move(merged));
    }
  }
  return parts;
}

bool all_near(const std::vector<MeshPart>& parts) {
  return std::all_of(parts.begin(), parts.end(), [](const MeshPart& part) {
    return std::all_of(part.vertices.begin(), part.vertices.end(), [](const Eigen::Vector3f& v) {
      return v.allFinite() && v.cwiseAbs().maxCoeff() <= kMeshExtent;
    });
  });
}

/// First byte: 1, then the mesh, or 0, then an error message.
std::string result_text(const std::string& path) {
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS,
                              aiComponent_NORMALS | aiComponent_TANGENTS_AND_BITANGENTS | aiComponent_COLORS |
                                  aiComponent_TEXCOORDS | aiComponent_BONEWEIGHTS | aiComponent_ANIMATIONS |
                                  aiComponent_TEXTURES | aiComponent_LIGHTS | aiComponent_CAMERAS);
  const aiScene* scene = importer.ReadFile(path, kSteps);
  if (scene == nullptr || scene->mRootNode == nullptr)
    return std::string(1, '\0') + "not a readable mesh: " + importer.GetErrorString();
  const bool is_linear = path.ends_with(".glb") || path.ends_with(".gltf");
  std::vector<MeshPart> parts = Collector(*scene, is_linear).parts();
  std::erase_if(parts, [](const MeshPart& part) { return part.triangles.empty(); });
  if (parts.empty()) return std::string(1, '\0') + "it has no triangle";
  if (!all_near(parts))
    return std::string(1, '\0') + "a vertex is not finite, or farther than 1000 m from the origin";
  const std::vector<std::uint8_t> bytes = pack_mesh(simplify(std::move(parts)));
  return std::string(1, '\1') + std::string(bytes.begin(), bytes.end());
}

}  // namespace

Result<std::vector<MeshPart>> read_mesh_file(const std::string& path) {
  std::error_code code;
  if (!std::filesystem::is_regular_file(path, code)) return Error{path + ": no such file"};
  const auto child = result_of_child(kLimits, [&path](const auto&) { return result_text(path); });
  if (!child) return Error{path + ": " + child.error().message};
  if (!child->end.completed) return Error{path + ": reading it " + describe(child->end, kLimits)};
  const std::string& bytes = child->bytes;
  if (bytes.empty() || bytes[0] != '\1')
    return Error{path + ": " + (bytes.empty() ? "no result" : bytes.substr(1))};
  auto parts = unpack_mesh({reinterpret_cast<const std::uint8_t*>(bytes.data()) + 1, bytes.size() - 1});
  if (!parts) return Error{path + ": " + parts.error().message};
  return parts;
}

}  // namespace parhelion
