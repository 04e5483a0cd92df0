// A camera frame that the renderer has finished.
#pragma once

#include <cstdint>
#include <string>

#include "protocols/time.hpp"
#include "render/compositor.hpp"

namespace parhelion::tick {

/// One image's answer. Where EGL is not there, the original with the reason; of a simulated camera then an
/// image without bytes.
struct FrameAnswer {
  std::string agent;  ///< whose camera; empty: of the trainee's robot
  std::uint64_t sequence = 0;
  bool simulated = false;  ///< the picture of a simulated camera, bodies and all
  render::RenderAnswer answer;
  Duration latency;  ///< from submit() to the answer, measured
};

}  // namespace parhelion::tick
