// What is wrong with the calibration of the lens that all images share.
#pragma once

#include "fusion/semantic/texture/views.hpp"

namespace parhelion::semantic {

/// A point that the described pinhole sees at (x, y) on the plane at depth 1 is in the image where that
/// pinhole sees focal * (1 + distortion * (x^2 + y^2)) times (x, y).
struct LensError {
  double focal = 1;       ///< ratio
  double distortion = 0;  ///< radial
};

/// The view with a camera of the right focal length, and its pixels where that camera sees them.
ColourView corrected(ColourView view, const LensError& error);

}  // namespace parhelion::semantic
