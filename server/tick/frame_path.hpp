// Publishes a rendered camera frame on MR_CAMERA and MR_DEPTH.
#pragma once

#include <cstdint>
#include <string>

#include "protocols/time.hpp"
#include "render/compositor.hpp"
#include "server/tick/configuration.hpp"
#include "server/tick/outputs.hpp"
#include "server/tick/tally.hpp"

namespace parhelion::tick {

/// Result for one image. Without EGL it is the original with the reason; for a simulated camera an image
/// without bytes.
struct FrameAnswer {
  std::string agent;  ///< owner of the camera; empty: the robot of this index
  std::size_t robot = 0;
  std::size_t camera = 0;  ///< of that robot
  std::uint64_t sequence = 0;
  bool simulated = false;  ///< an image of a simulated camera, which already shows all bodies
  render::RenderAnswer answer;
  Duration latency;  ///< from submit() to the result, measured
};

/// Publishes MR_CAMERA, and MR_DEPTH if present; for the simulated robot's cameras CAMERA and DEPTH too. An
/// agent's camera has its own channel.
void publish_frame(const Configuration& configuration, const FrameAnswer& done, Outputs& outputs,
                   Tally& tally);

}  // namespace parhelion::tick
