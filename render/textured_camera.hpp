// A simulated camera in a site that was recorded.
#pragma once

#include "protocols/site_texture.hpp"
#include "render/compositor.hpp"

namespace parhelion::render {

/// As VirtualCamera::create. `texture`: the site as recorded, drawn in place of the building, with the
/// exposure that the recording camera would have had; stripes where nothing was recorded. Doors on hinges,
/// and what has moved from its place in the model, are drawn as without it. null: the building in the colours
/// of its labels. A picture with a texture has metadata
/// "texture", the id of what it shows. Error: no EGL, or a picture of the texture that is damaged.
Result<std::unique_ptr<VirtualCamera>> create_virtual_camera(const SemanticModel& building,
                                                             const SiteTexture* texture);

}  // namespace parhelion::render
