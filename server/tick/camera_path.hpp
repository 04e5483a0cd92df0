// CAMERA to MR_CAMERA: a job for the render thread with the world at the image's instant, or the original
// with the reason. What the render thread finishes goes on in frame_path.hpp. At levels 1 and 2 there is no
// CAMERA but the one in simulated_camera.hpp.
#pragma once

#include <cstdint>
#include <optional>

#include "protocols/bus/bus.hpp"
#include "protocols/image.hpp"
#include "server/tick/injection_gate.hpp"
#include "server/tick/model_path.hpp"
#include "server/tick/pose_path.hpp"
#include "server/tick/scan_path.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// A camera image that waits for the depth image of its moment.
struct WaitingImage {
  Image image;
  std::uint64_t sequence = 0;
  SimulationTime arrival;
};

struct CameraState {
  std::uint64_t sequence = 0;
  std::optional<WaitingImage> waiting;
  std::optional<Image> depth;  ///< the newest
};

/// What the camera path works on.
struct CameraPath {
  PoseState& pose;
  const ScanState& scan;  ///< its returns are occluders
  InjectionGate& gate;
  CameraState& camera;
  const SiteState& site;
  simulation::Simulation& simulation;
};

/// An image waits for the depth image of its moment, where the robot has a depth camera: drivers send colour
/// first. It is answered when that comes, when a newer image comes, or after 50 ms.
void handle_image(const TickContext& context, const Message& input, const CameraPath& path);
void handle_depth(const TickContext& context, const Message& input, const CameraPath& path);
/// At each step: an image that has waited for 50 ms is answered.
void answer_overdue_image(const TickContext& context, const CameraPath& path);
/// At the end of a session: an image that still waits is answered.
void answer_waiting_image(const TickContext& context, const CameraPath& path);

}  // namespace parhelion::tick
