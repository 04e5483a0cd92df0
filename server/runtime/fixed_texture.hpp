// The recorded look of a site of which some objects can be pushed.
#pragma once

#include <memory>
#include <vector>

#include "protocols/model_objects.hpp"
#include "protocols/site_texture.hpp"

namespace parhelion::runtime {

/// The texture without the surfaces of these objects, which are drawn as bodies where they are: quads whose
/// middle is within 5 cm of an object's box, and higher than 2 cm over its underside, lose their area. Null:
/// there is no texture.
std::shared_ptr<const SiteTexture> without_objects(std::shared_ptr<const SiteTexture> texture,
                                                   const std::vector<ModelObject>& objects);

}  // namespace parhelion::runtime
