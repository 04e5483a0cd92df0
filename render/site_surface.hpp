// A site's texture for the renderer: vertices with places in the picture, in chunks that are culled
// individually. Private to this module.
#pragma once

#include <cstdint>
#include <vector>

#include "protocols/site_texture.hpp"
#include "render/building_mesh.hpp"

namespace parhelion::render {

struct SiteVertex {
  float position[3];  ///< m, map frame
  float place[2];     ///< in the picture, 0..1
  float recorded;     ///< 1; 0: no image shows it
};

struct SiteSurface {
  std::vector<SiteVertex> vertices;    ///< four for each quad
  std::vector<std::uint32_t> indices;  ///< two triangles for each quad
  BuildingMesh mesh;                   ///< only its chunks: ranges of `indices`
};

/// The picture of a site's texture.
struct SitePicture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgba;
};

SiteSurface site_surface(const SiteTexture& texture);

/// The picture of a texture. Error: damaged, or of another size than its patches need.
Result<SitePicture> site_picture(const SiteTexture& texture);

/// The mean colour (sRGB, 0..255) of pixels gives the factors by which a camera that exposes by itself shows
/// red, green and blue.
Eigen::Vector3f exposure_factors(const AutoExposure& exposure, const Eigen::Vector3f& mean);

}  // namespace parhelion::render
