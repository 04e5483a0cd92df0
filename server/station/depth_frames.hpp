// Depth images for pages: a few thousand points where they lie in the map.
#pragma once

#include <string>

#include "protocols/image.hpp"
#include "protocols/pose.hpp"
#include "render/depth_image.hpp"

namespace parhelion::station {

/// Binary message 3, without colours. Of the image every so many pixels, `most` (at least 1) points at most:
/// those within the camera's range, the lens' distortion taken out. No points of an image that is not of the
/// camera's size. `t`: s of the session.
std::string depth_bytes(const render::DepthPixels& pixels, const DepthCameraDescription& camera,
                        const Transform<Map, DepthOptical>& T_map_optical, double t, std::size_t most = 8000);

}  // namespace parhelion::station
