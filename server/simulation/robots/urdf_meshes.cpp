#include "server/simulation/robots/urdf_meshes.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <sstream>
#include <string_view>

#include "protocols/mesh_bytes.hpp"
#include "protocols/mesh_file.hpp"
#include "protocols/yaml/base64.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion::simulation {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEmbedded = "data:application/x-parhelion-mesh;base64,";
constexpr std::string_view kPackage = "package://", kFile = "file://";

/// The folders in which a package's folder may be.
std::vector<fs::path> package_folders(const fs::path& urdf) {
  std::vector<fs::path> folders;
  std::error_code code;
  for (fs::path folder = fs::absolute(urdf, code).parent_path();; folder = folder.parent_path()) {
    folders.push_back(folder);
    if (folder == folder.parent_path()) break;
  }
  const char* search = std::getenv("ROS_PACKAGE_PATH");
  std::istringstream text(search == nullptr ? "" : search);
  for (std::string folder; std::getline(text, folder, ':');) {
    if (!folder.empty()) folders.emplace_back(folder);
  }
  return folders;
}

/// Where the file of that name may be, the best place first.
std::vector<fs::path> places(const std::string& name, const fs::path& urdf) {
  if (name.starts_with(kFile)) return {name.substr(kFile.size())};
  if (!name.starts_with(kPackage)) return {urdf.parent_path() / name};
  std::vector<fs::path> all;
  for (const fs::path& folder : package_folders(urdf)) all.push_back(folder / name.substr(kPackage.size()));
  return all;
}

class Embedder {
 public:
  Embedder(const std::string& urdf, std::string path) : text_(urdf), path_(std::move(path)) {}

  EmbeddedUrdf run() {
    for (std::size_t at = 0; at < text_.size();) {
      const std::size_t tag = text_.find('<', at);
      copy_until(at, tag);
      if (tag == std::string::npos) break;
      at = end_of_tag(tag);
      const std::string_view element = std::string_view(text_).substr(tag, at - tag);
      if (is_mesh(element)) {
        add_mesh(std::string(element), tag);
      } else {
        result_.urdf += element;
      }
    }
    return std::move(result_);
  }

 private:
  void copy_until(std::size_t from, std::size_t to) { result_.urdf += text_.substr(from, to - from); }

  /// One after the element's `>`, or after a comment.
  std::size_t end_of_tag(std::size_t tag) const {
    const bool comment = text_.compare(tag, 4, "<!--") == 0;
    const std::string_view closing = comment ? "-->" : ">";
    const std::size_t end = text_.find(closing, tag);
    return end == std::string::npos ? text_.size() : end + closing.size();
  }

  static bool is_mesh(std::string_view element) {
    return element.starts_with("<mesh") && element.size() > 5 &&
           (std::isspace(static_cast<unsigned char>(element[5])) != 0);
  }

  void add_mesh(const std::string& element, std::size_t at) {
    const std::size_t key = element.find("filename");
    const std::size_t quote = key == std::string::npos ? key : element.find_first_of("'\"", key);
    const std::size_t end = quote == std::string::npos ? quote : element.find(element[quote], quote + 1);
    if (end == std::string::npos) {
      result_.urdf += element;  // the parser reports it
      return;
    }
    const std::string name = element.substr(quote + 1, end - quote - 1);
    const std::string replacement = is_embedded(name) ? name : embedded(name, at);
    result_.urdf += element.substr(0, quote + 1) + replacement + element.substr(end);
  }

  std::string embedded(const std::string& name, std::size_t at) {
    const auto known = by_name_.find(name);
    if (known != by_name_.end()) return known->second;
    return by_name_.emplace(name, read(name, at)).first->second;
  }

  std::string read(const std::string& name, std::size_t at) {
    std::vector<fs::path> tried = places(name, path_);
    std::error_code code;
    const auto found =
        std::find_if(tried.begin(), tried.end(), [&](const fs::path& p) { return fs::exists(p, code); });
    if (found == tried.end()) {
      warn(at, "mesh '" + yaml::printable(name) + "' is missing; its part is left out. Tried " + list(tried));
      return name;
    }
    const auto parts = read_mesh_file(found->string());
    if (!parts) {
      warn(at, parts.error().message + "; its part is left out");
      return name;
    }
    return std::string(kEmbedded) + yaml::to_base64(pack_mesh(*parts));
  }

  void warn(std::size_t at, const std::string& what) {
    const auto line = 1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(at), '\n');
    result_.warnings.push_back(path_.string() + ":" + std::to_string(line) + ": " + what);
  }

  static std::string list(const std::vector<fs::path>& all) {
    std::string text;
    for (const fs::path& path : all) text += (text.empty() ? "" : ", ") + path.string();
    return text;
  }

  const std::string& text_;
  fs::path path_;
  std::map<std::string, std::string> by_name_;
  EmbeddedUrdf result_;
};

Result<std::vector<MeshPart>> unpack(const std::string& filename, const Eigen::Vector3d& scale) {
  const auto bytes = yaml::from_base64(std::string_view(filename).substr(kEmbedded.size()));
  if (!bytes) return bytes.error();
  auto parts = unpack_mesh(*bytes);
  if (!parts) return parts;
  const Eigen::Vector3f by = scale.cast<float>();
  for (MeshPart& part : *parts) {
    for (Eigen::Vector3f& vertex : part.vertices) vertex = vertex.cwiseProduct(by);
    if (scale.prod() > 0) continue;
    for (MeshTriangle& triangle : part.triangles) std::swap(triangle[1], triangle[2]);  // mirrored
  }
  return parts;
}

Result<Shape> shape_of(MeshPart part, const Eigen::Isometry3d& T_link_mesh) {
  auto centered = make_shape_mesh(std::move(part.vertices), std::move(part.triangles));
  if (!centered) return centered.error();
  Shape shape;
  shape.kind = ShapeKind::mesh;
  shape.size = centered->size;
  shape.T_body_shape = Transform<Body, ShapeFrame>(T_link_mesh * Eigen::Translation3d(centered->center));
  shape.mesh = std::move(centered->mesh);
  return shape;
}

}  // namespace

EmbeddedUrdf embed_meshes(const std::string& urdf, const std::string& path) {
  return Embedder(urdf, path).run();
}

bool is_embedded(const std::string& filename) { return filename.starts_with(kEmbedded); }

Result<std::vector<Shape>> mesh_shapes(const std::string& filename, const Eigen::Isometry3d& T_link_mesh,
                                       const Eigen::Vector3d& scale, const Material& material, bool colored) {
  auto parts = unpack(filename, scale);
  if (!parts) return parts.error();
  std::vector<Shape> shapes;
  for (MeshPart& part : *parts) {
    const auto albedo = part.albedo;
    auto shape = shape_of(std::move(part), T_link_mesh);
    if (!shape) return shape.error();
    shape->material = material;
    if (colored && albedo) shape->material.albedo = *albedo;
    shapes.push_back(std::move(*shape));
  }
  return shapes;
}

Result<Shape> solid_mesh_shape(const std::string& filename, const Eigen::Isometry3d& T_link_mesh,
                               const Eigen::Vector3d& scale) {
  const auto parts = unpack(filename, scale);
  if (!parts) return parts.error();
  MeshPart all;
  for (const MeshPart& part : *parts) {
    const auto first = static_cast<std::uint32_t>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), part.vertices.begin(), part.vertices.end());
    for (const MeshTriangle& t : part.triangles)
      all.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
  return shape_of(std::move(all), T_link_mesh);
}

}  // namespace parhelion::simulation
