// Depth images for pages: a few thousand points in the map frame.
#pragma once

#include <string>

#include "protocols/image.hpp"
#include "protocols/pose.hpp"
#include "render/depth_image.hpp"

namespace parhelion::station {

/// Binary message 3, without colours. Samples the image at a fixed pixel step, for `max_points` (at least 1)
/// points at most. Contains points within the camera's range, with the lens distortion removed. An image that
/// does not have the camera's size gives no points. `t`: s of the session.
std::string depth_bytes(const render::DepthPixels& pixels, const DepthCameraDescription& camera,
                        const Transform<Map, DepthOptical>& T_map_optical, double t,
                        std::size_t max_points = 8000);

}  // namespace parhelion::station
