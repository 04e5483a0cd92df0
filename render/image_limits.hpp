// The largest images that this module handles.
#pragma once

namespace parhelion::render {

inline constexpr int kMaxImageSide = 8192;  ///< px: limit of the supported GL drivers

}  // namespace parhelion::render
