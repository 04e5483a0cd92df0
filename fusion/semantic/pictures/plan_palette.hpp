// Colours and sizes that all plans share.
#pragma once

#include "fusion/semantic/pictures/plan_picture.hpp"

namespace parhelion::semantic::palette {

inline constexpr int kTitleBar = 74;  ///< pixels
inline constexpr Colour kInk{32, 38, 46};
inline constexpr Colour kFaint{110, 119, 129};
inline constexpr Colour kPaper{255, 255, 255};
inline constexpr Colour kRule{208, 215, 222};

}  // namespace parhelion::semantic::palette
