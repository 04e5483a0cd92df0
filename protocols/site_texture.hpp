// What a site looks like: a surface of quadrilaterals with a piece of one picture for each, made from
// recorded camera images. Only virtual cameras draw it; physics and scans use the model.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "protocols/model.hpp"
#include "protocols/status.hpp"

namespace parhelion {

/// Where a quad's colour comes from.
enum class QuadLook : std::uint8_t {
  recorded,  ///< camera images
  unseen,    ///< no image shows it: drawn hatched
};

/// How bright the recording camera showed what: its automatic exposure. A picture whose texture has the mean
/// luminance L (0..255) gets its channels multiplied by exp(-(gain + slope * (log L - luminance))).
struct AutoExposure {
  Eigen::Vector3f gain = Eigen::Vector3f::Zero();  ///< of red, green, blue
  float slope = 0;                                 ///< 0..1
  float luminance = 0;                             ///< log, mean over the recording
};

struct SiteTexture {
  using Quad = std::array<std::uint32_t, 4>;

  std::string map_id;                     ///< of the map that its coordinates belong to
  std::string source;                     ///< what it was made from
  std::vector<Eigen::Vector3f> vertices;  ///< m, map frame
  std::vector<Quad> quads;                ///< into vertices, counter-clockwise from the free side
  std::vector<QuadLook> looks;            ///< one for each quad
  /// The picture holds a square of `patch` texels for each quad, in their order, `patches_per_row` in a row.
  /// The centres of a square's corner texels are the quad's corners.
  int patch = 8;
  int patches_per_row = 1;
  AutoExposure exposure;
  std::vector<std::uint8_t> jpeg;  ///< the picture

  int rows() const {
    const auto per_row = static_cast<std::size_t>(patches_per_row);
    return static_cast<int>((quads.size() + per_row - 1) / per_row);
  }
};

/// Whether an entity is no part of a texture because it moves by itself (a door on its hinge): it is drawn
/// where it is.
inline bool is_left_out_of_texture(const ModelEntity& entity) {
  return entity.label == EntityLabel::door && entity.hinge.has_value();
}

/// The longest side of the picture, pixels, and how many quads that allows.
inline constexpr int kMaxTextureSide = 8192;
inline constexpr std::size_t kMaxTextureQuads = 1'000'000;

/// Little-endian: "PHT1", texts, numbers, vertices, quads, looks, the JPEG.
std::vector<std::uint8_t> pack_site_texture(const SiteTexture& texture);
/// Error: not packed by pack_site_texture(), cut off, or damaged. Every count is checked before it is used.
Result<SiteTexture> unpack_site_texture(std::span<const std::uint8_t> bytes);

Result<SiteTexture> load_site_texture(const std::string& path);
Status write_site_texture(const std::string& path, const SiteTexture& texture);

/// Where the texture of a model lies: beside it, `site.yaml` and `site.texture`.
std::string texture_beside(const std::string& model_path);
/// The texture beside a model, null where there is none. Error: it is damaged, or of another map.
Result<std::shared_ptr<const SiteTexture>> load_texture_of(const std::string& model_path,
                                                           const std::string& map_id);

}  // namespace parhelion
