// Outlines of boxes and bodies as seen from above, in the map frame.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "protocols/convex_hull.hpp"
#include "protocols/model.hpp"
#include "protocols/scene.hpp"

namespace parhelion::semantic {

using Outline = std::vector<Eigen::Vector2d>;  ///< m, counter-clockwise

Outline outline_of(const ModelEntity& entity);
Outline outline_of(const Shape& shape, const Transform<Map, Body>& T_map_body);

/// Where the line p[axis] = at crosses a convex polygon; nullopt where it does not.
std::optional<std::pair<Eigen::Vector2d, Eigen::Vector2d>> chord(const Outline& polygon, int axis, double at);

}  // namespace parhelion::semantic
