#include "protocols/mesh_bytes.hpp"

#include <bit>
#include <cstring>
#include <string>

namespace parhelion {
namespace {

constexpr std::uint32_t kMagic = 0x314D4850;  // "PHM1"
constexpr std::uint32_t kMaxParts = 256;
static_assert(std::endian::native == std::endian::little);

template <class T>
void append(std::vector<std::uint8_t>& bytes, const T& value) {
  const auto* first = reinterpret_cast<const std::uint8_t*>(&value);
  bytes.insert(bytes.end(), first, first + sizeof value);
}

void append(std::vector<std::uint8_t>& bytes, const Eigen::Vector3f& value) {
  for (const float each : value) append<float>(bytes, each);
}

/// Takes values from bytes; once there are too few it stays failed.
class Taker {
 public:
  explicit Taker(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  bool failed() const { return failed_; }
  bool finished() const { return !failed_ && bytes_.empty(); }

  template <class T>
  T take() {
    T value{};
    if (!has(1, sizeof value)) return value;
    std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_ = bytes_.subspan(sizeof value);
    return value;
  }
  Eigen::Vector3f take_vector() {
    const auto x = take<float>(), y = take<float>(), z = take<float>();
    return {x, y, z};
  }
  /// Whether `count` values of `size` bytes remain.
  bool has(std::uint64_t count, std::uint64_t size) {
    failed_ = failed_ || count > bytes_.size() / size;
    return !failed_;
  }

 private:
  std::span<const std::uint8_t> bytes_;
  bool failed_ = false;
};

MeshPart take_part(Taker& from) {
  MeshPart part;
  const bool colored = from.take<std::uint32_t>() != 0;
  const Eigen::Vector3f albedo = from.take_vector();
  if (colored) part.albedo = albedo;
  const auto vertices = from.take<std::uint32_t>(), triangles = from.take<std::uint32_t>();
  if (!from.has(std::uint64_t{vertices} + triangles, 12)) return part;
  for (std::uint32_t i = 0; i < vertices; ++i) part.vertices.push_back(from.take_vector());
  for (std::uint32_t i = 0; i < triangles; ++i) {
    const auto a = from.take<std::uint32_t>(), b = from.take<std::uint32_t>(), c = from.take<std::uint32_t>();
    part.triangles.push_back({a, b, c});
  }
  return part;
}

bool is_color(const std::optional<Eigen::Vector3f>& albedo) {
  return !albedo || (albedo->allFinite() && albedo->minCoeff() >= 0 && albedo->maxCoeff() <= 1);
}

}  // namespace

std::vector<std::uint8_t> pack_mesh(const std::vector<MeshPart>& parts) {
  std::vector<std::uint8_t> bytes;
  append(bytes, kMagic);
  append(bytes, static_cast<std::uint32_t>(parts.size()));
  for (const MeshPart& part : parts) {
    append(bytes, std::uint32_t{part.albedo.has_value()});
    append(bytes, part.albedo.value_or(Eigen::Vector3f::Zero()));
    append(bytes, static_cast<std::uint32_t>(part.vertices.size()));
    append(bytes, static_cast<std::uint32_t>(part.triangles.size()));
    for (const Eigen::Vector3f& vertex : part.vertices) append(bytes, vertex);
    for (const MeshTriangle& triangle : part.triangles) append(bytes, triangle);
  }
  return bytes;
}

Result<std::vector<MeshPart>> unpack_mesh(std::span<const std::uint8_t> bytes) {
  Taker from(bytes);
  if (from.take<std::uint32_t>() != kMagic) return Error{"expected a packed mesh (PHM1)"};
  const auto count = from.take<std::uint32_t>();
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
