// The colour camera and the depth camera, which share one lens.
#pragma once

#include <cstdint>

#include "arm_shape.hpp"
#include "building.hpp"
#include "parhelion/image_t.hpp"

namespace robot {

struct Images {
  parhelion::image_t colour;  // RGB
  parhelion::image_t depth;   // 16 bits, millimetres along the optical axis; 0: no measurement
};

// Both at `utime`, the middle of the exposure, from where the robot is then; its arm may be in view.
Images take_images(const Building& building, const ArmPosture& arm, const Pose2& T_site_base,
                   std::int64_t utime);

}  // namespace robot
