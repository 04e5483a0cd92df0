#include "protocols/mesh_bytes.hpp"

#include <string>

#include "protocols/packed_bytes.hpp"

namespace parhelion {
namespace {

constexpr std::uint32_t kMagic = 0x314D4850;  // "PHM1"
constexpr std::uint32_t kMaxParts = 256;

MeshPart take_part(Unpacker& from) {
  MeshPart part;
  const bool colored = from.number<std::uint32_t>() != 0;
  const Eigen::Vector3f albedo = from.vector();
  if (colored) part.albedo = albedo;
  const auto vertices = from.number<std::uint32_t>(), triangles = from.number<std::uint32_t>();
  if (!from.has(std::uint64_t{vertices} + triangles, 12)) return part;
  for (std::uint32_t i = 0; i < vertices; ++i) part.vertices.push_back(from.vector());
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const auto a = from.number<std::uint32_t>(), b = from.number<std::uint32_t>(),
               c = from.number<std::uint32_t>();
    part.triangles.push_back({a, b, c});
  }
  return part;
}

bool is_color(const std::optional<Eigen::Vector3f>& albedo) {
  return !albedo || (albedo->allFinite() && albedo->minCoeff() >= 0 && albedo->maxCoeff() <= 1);
}

}  // namespace

std::vector<std::uint8_t> pack_mesh(const std::vector<MeshPart>& parts) {
  Packer to;
  to.number(kMagic);
  to.count(parts.size());
  for (const MeshPart& part : parts) {
    to.number(std::uint32_t{part.albedo.has_value()});
    to.vector(part.albedo.value_or(Eigen::Vector3f::Zero()));
    to.count(part.vertices.size());
    to.count(part.triangles.size());
    for (const Eigen::Vector3f& vertex : part.vertices) to.vector(vertex);
    for (const MeshTriangle& triangle : part.triangles) to.number(triangle);
  }
  return to.take();
}

Result<std::vector<MeshPart>> unpack_mesh(std::span<const std::uint8_t> bytes) {
  Unpacker from(bytes);
  if (from.number<std::uint32_t>() != kMagic) return Error{"expected a packed mesh (PHM1)"};
  const auto count = from.number<std::uint32_t>();
  if (count == 0 || count > kMaxParts)
    return Error{"a packed mesh of " + std::to_string(count) + " parts; expected 1 to " +
                 std::to_string(kMaxParts)};
  std::vector<MeshPart> parts;
  for (std::uint32_t i = 0; i < count && !from.failed(); ++i) {
    parts.push_back(take_part(from));
    if (!is_color(parts.back().albedo)) return Error{"a packed mesh with a colour outside 0 to 1"};
  }
  if (!from.finished()) return Error{"a packed mesh whose length contradicts its counts"};
  return parts;
}

}  // namespace parhelion
