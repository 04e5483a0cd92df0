#include "protocols/site_texture.hpp"

#include <cmath>
#include <filesystem>
#include <fstream>

#include "protocols/packed_bytes.hpp"

namespace parhelion {
namespace {

constexpr std::uint32_t kMagic = 0x31544850;  // "PHT1"
constexpr int kMaxPatch = 64;
constexpr float kExtent = 1e6F;  ///< m

AutoExposure take_exposure(Unpacker& from) {
  AutoExposure exposure;
  exposure.gain = from.vector();
  exposure.slope = from.number<float>();
  exposure.luminance = from.number<float>();
  return exposure;
}

bool is_valid(const AutoExposure& exposure) {
  return exposure.gain.allFinite() && exposure.gain.cwiseAbs().maxCoeff() < 5 && exposure.slope >= 0 &&
         exposure.slope <= 1 && std::isfinite(exposure.luminance);
}

const char* fault_of(const SiteTexture& texture) {
  if (texture.quads.size() > kMaxTextureQuads) return "it has more than a million pieces";
  if (texture.patch < 2 || texture.patch > kMaxPatch || texture.patches_per_row < 1 ||
      texture.patches_per_row > kMaxTextureSide / texture.patch ||
      texture.rows() > kMaxTextureSide / texture.patch)
    return "its picture is too large";
  for (const Eigen::Vector3f& vertex : texture.vertices)
    if (!vertex.allFinite() || vertex.cwiseAbs().maxCoeff() > kExtent) return "a vertex is not finite";
  for (const SiteTexture::Quad& quad : texture.quads)
    for (const std::uint32_t corner : quad)
      if (corner >= texture.vertices.size()) return "a piece has a corner that is not there";
  for (const QuadLook look : texture.looks)
    if (look > QuadLook::unseen) return "a piece has an unknown look";
  return is_valid(texture.exposure) ? nullptr : "its exposure is out of range";
}

}  // namespace

std::vector<std::uint8_t> pack_site_texture(const SiteTexture& texture) {
  Packer to;
  to.number(kMagic);
  to.text(texture.map_id);
  to.text(texture.source);
  to.number(static_cast<std::uint32_t>(texture.patch));
  to.number(static_cast<std::uint32_t>(texture.patches_per_row));
  to.vector(texture.exposure.gain);
  to.number(texture.exposure.slope);
  to.number(texture.exposure.luminance);
  to.count(texture.vertices.size());
  for (const Eigen::Vector3f& vertex : texture.vertices) to.vector(vertex);
  to.count(texture.quads.size());
  for (const SiteTexture::Quad& quad : texture.quads) to.number(quad);
  for (const QuadLook look : texture.looks) to.number(look);
  to.bytes(texture.jpeg);
  return to.take();
}

Result<SiteTexture> unpack_site_texture(std::span<const std::uint8_t> bytes) {
  Unpacker from(bytes);
  if (from.number<std::uint32_t>() != kMagic)
    return Error{"not a site's texture, which `parhelion map texture` writes"};
  SiteTexture texture;
  texture.map_id = from.text();
  texture.source = from.text();
  texture.patch = static_cast<int>(from.number<std::uint32_t>());
  texture.patches_per_row = static_cast<int>(from.number<std::uint32_t>());
  texture.exposure = take_exposure(from);
  texture.vertices.resize(from.count(3 * sizeof(float)));
  for (Eigen::Vector3f& vertex : texture.vertices) vertex = from.vector();
  // Each quad has four corners and a look.
  texture.quads.resize(from.count(sizeof(SiteTexture::Quad) + 1));
  for (SiteTexture::Quad& quad : texture.quads) quad = from.number<SiteTexture::Quad>();
  texture.looks.resize(texture.quads.size());
  for (QuadLook& look : texture.looks) look = from.number<QuadLook>();
  const auto jpeg = from.bytes();
  texture.jpeg.assign(jpeg.begin(), jpeg.end());
  if (!from.finished()) return Error{"the site's texture is damaged: it has another length than it says"};
  if (const char* fault = fault_of(texture))
    return Error{std::string("the site's texture is damaged: ") + fault};
  return texture;
}

Result<SiteTexture> load_site_texture(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) return Error{path + ": cannot be read"};
  const std::vector<char> bytes((std::istreambuf_iterator<char>(stream)), {});
  auto texture = unpack_site_texture({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  if (!texture) return Error{path + ": " + texture.error().message};
  return texture;
}

Status write_site_texture(const std::string& path, const SiteTexture& texture) {
  const std::vector<std::uint8_t> bytes = pack_site_texture(texture);
  std::ofstream stream(path, std::ios::binary | std::ios::trunc);
  stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  stream.close();
  if (!stream) return Error{path + ": cannot be written"};
  return {};
}

std::string texture_beside(const std::string& model_path) {
  return std::filesystem::path(model_path).replace_extension(".texture").string();
}

Result<std::shared_ptr<const SiteTexture>> load_texture_of(const std::string& model_path,
                                                           const std::string& map_id) {
  const std::string path = texture_beside(model_path);
  std::error_code ignored;
  if (model_path.empty() || !std::filesystem::exists(path, ignored))
    return std::shared_ptr<const SiteTexture>();
  auto texture = load_site_texture(path);
  if (!texture) return texture.error();
  if (texture->map_id != map_id) {
    return Error{path + ": belongs to map '" + texture->map_id + "', but model " + model_path + " to map '" +
                 map_id + "'; make it again with `parhelion map texture`, or move it away"};
  }
  return std::make_shared<const SiteTexture>(std::move(*texture));
}

}  // namespace parhelion
