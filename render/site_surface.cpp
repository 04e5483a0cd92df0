#include "render/site_surface.hpp"

#include <algorithm>
#include <cmath>

#include "render/jpeg.hpp"

namespace parhelion::render {
namespace {

constexpr std::size_t kChunkQuads = 512;  ///< neighbours in the list are neighbours in space

void add_quad(const SiteTexture& texture, std::size_t quad, SiteSurface& surface) {
  const auto per_row = static_cast<std::size_t>(texture.patches_per_row);
  const auto patch = static_cast<float>(texture.patch);
  const float width = static_cast<float>(texture.patches_per_row) * patch;
  const float height = static_cast<float>(texture.rows()) * patch;
  const float column = static_cast<float>(quad % per_row) * patch + 0.5F;
  const float row = static_cast<float>(quad / per_row) * patch + 0.5F;
  const auto first = static_cast<std::uint32_t>(surface.vertices.size());
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3f& p = texture.vertices[texture.quads[quad][i]];
    const float s = i == 1 || i == 2 ? patch - 1 : 0, t = i >= 2 ? patch - 1 : 0;
    surface.vertices.push_back({{p.x(), p.y(), p.z()},
                                {(column + s) / width, (row + t) / height},
                                texture.looks[quad] == QuadLook::recorded ? 1.F : 0.F});
  }
  for (const std::uint32_t corner : {0U, 1U, 2U, 0U, 2U, 3U}) surface.indices.push_back(first + corner);
}

}  // namespace

Result<SitePicture> site_picture(const SiteTexture& texture) {
  JpegCodec codec;
  std::vector<std::uint8_t> bgr;
  const auto format = codec.decode(texture.jpeg, bgr);
  if (!format) return Error{"the site's texture: its picture is damaged: " + format.error().message};
  if (format->width != texture.patches_per_row * texture.patch ||
      format->height != texture.rows() * texture.patch)
    return Error{"the site's texture: its picture has another size than its pieces need"};
  SitePicture picture{format->width, format->height, std::vector<std::uint8_t>(bgr.size() / 3 * 4, 255)};
  for (std::size_t i = 0; i < bgr.size() / 3; ++i)
    for (std::size_t c = 0; c < 3; ++c) picture.rgba[4 * i + c] = bgr[3 * i + 2 - c];
  return picture;
}

SiteSurface site_surface(const SiteTexture& texture) {
  SiteSurface surface;
  for (std::size_t first = 0; first < texture.quads.size(); first += kChunkQuads) {
    MeshChunk chunk;
    chunk.first = static_cast<std::uint32_t>(surface.indices.size());
    const std::size_t end = std::min(first + kChunkQuads, texture.quads.size());
    for (std::size_t quad = first; quad < end; ++quad) {
      add_quad(texture, quad, surface);
      for (const std::uint32_t corner : texture.quads[quad])
        chunk.box.extend(texture.vertices[corner].cast<double>());
    }
    chunk.count = static_cast<std::uint32_t>(surface.indices.size()) - chunk.first;
    surface.mesh.chunks.push_back(chunk);
  }
  return surface;
}

Eigen::Vector3f exposure_factors(const AutoExposure& exposure, const Eigen::Vector3f& mean) {
  const float luminance = std::log(std::max(1.F, mean.dot(Eigen::Vector3f(0.299F, 0.587F, 0.114F))));
  const float brighter = exposure.slope * (luminance - exposure.luminance);
  return (-(exposure.gain.array() + brighter)).exp().matrix();
}

}  // namespace parhelion::render
