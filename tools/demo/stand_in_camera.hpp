// A camera for a recording that has none: its pictures are rendered from the model and marked as such.
#pragma once

#include <functional>
#include <string>

#include "protocols/image.hpp"
#include "protocols/status.hpp"
#include "render/compositor.hpp"

namespace parhelion::tools {

/// A 640x480 camera of 75 degrees at the front of a robot, looking ahead and slightly down.
CameraDescription stand_in_camera(double height);

/// Copies the log `in` to `out` with CAMERA at `rate` Hz wherever POSE_COV gives the robot's pose, and with
/// the camera in its ROBOT description. Arrival: 5 ms after the image's stamp. Returns the number of images.
/// `camera` renders the model.
Result<std::uint64_t> add_stand_in_camera(const std::string& in, const std::string& out, bool overwrite,
                                          render::VirtualCamera& camera, double rate,
                                          const std::function<void(double done, double total)>& progress);

}  // namespace parhelion::tools
