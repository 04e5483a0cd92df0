// How the recording camera's exposure followed what it saw, so that a virtual one does the same.
#pragma once

#include "fusion/semantic/texture/view_geometry.hpp"
#include "protocols/site_texture.hpp"

namespace parhelion::semantic {

/// Regression of the views' gains (exposure_gains) on the logarithm of what they saw at equal exposure.
AutoExposure fit_auto_exposure(std::span<const ColourView> views, std::span<const ViewGeometry> geometry,
                               std::span<const Eigen::Vector3f> gains);

}  // namespace parhelion::semantic
