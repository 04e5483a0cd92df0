// A camera frame that the renderer has finished, to MR_CAMERA and MR_DEPTH.
#pragma once

#include <cstdint>
#include <string>

#include "protocols/time.hpp"
#include "render/compositor.hpp"
#include "server/tick/configuration.hpp"
#include "server/tick/outputs.hpp"
#include "server/tick/tally.hpp"

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

/// MR_CAMERA, and MR_DEPTH where there is one; of the simulated robot's cameras CAMERA and DEPTH too, and of
/// an agent's camera its own channel.
void publish_frame(const Configuration& configuration, const FrameAnswer& done, Outputs& outputs,
                   Tally& tally);

}  // namespace parhelion::tick
