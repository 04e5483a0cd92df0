// CAMERA to MR_CAMERA and DEPTH to MR_DEPTH: a job for the render thread with the world at the image's stamp,
// or the original image with the reason. A depth image is answered with the image of the same instant, or by
// a job of its own. frame_path.hpp publishes the rendered images. At levels 1 and 2 the only CAMERA is that
// of simulated_camera.hpp.
#pragma once

#include <cstdint>
#include <optional>

#include "protocols/bus/bus.hpp"
#include "protocols/image.hpp"
#include "server/tick/depth_people.hpp"
#include "server/tick/injection_gate.hpp"
#include "server/tick/model_path.hpp"
#include "server/tick/pose_path.hpp"
#include "server/tick/scan_path.hpp"
#include "server/tick/tick_context.hpp"

namespace parhelion::tick {

/// A camera image that waits for the depth image of the same instant.
struct WaitingImage {
  Image image;
  std::uint64_t sequence = 0;
  SimulationTime arrival;
};

/// Of a camera and the depth camera that belongs to it.
struct CameraState {
  std::size_t index = 0;  ///< in the robot, see RobotDescription::camera_at()
  std::uint64_t sequence = 0;
  std::optional<WaitingImage> waiting;
  std::optional<Image> depth;  ///< the newest
  SimulationTime depth_arrival;
  bool depth_answered = true;  ///< a job publishes its MR_DEPTH
  DepthPeopleState people;
};

/// Dependencies of the camera path.
struct CameraPath {
  PoseState& pose;
  const ScanState& scan;  ///< its returns are occluders
  InjectionGate& gate;
  CameraState& camera;
  const SiteState& site;
  simulation::Simulation& simulation;
};

/// If the robot has a depth camera, an image waits for the depth image of the same instant, because drivers
/// send colour first. It is processed when that depth image or a newer image arrives, or after 50 ms.
void handle_image(const TickContext& context, const Message& input, const CameraPath& path);
void handle_depth(const TickContext& context, const Message& input, const CameraPath& path);
/// At each step: processes an image that has waited for 50 ms, and a depth image that has waited longer than
/// any image may.
void answer_overdue_images(const TickContext& context, const CameraPath& path);
/// At the end of a session: processes images that still wait.
void answer_waiting_images(const TickContext& context, const CameraPath& path);

}  // namespace parhelion::tick
