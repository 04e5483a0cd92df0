// A simulated robot's depth camera (levels 1 and 2). No GL type here.
#pragma once

#include <cstdint>
#include <memory>

#include "protocols/image.hpp"
#include "protocols/model.hpp"
#include "protocols/status.hpp"
#include "protocols/world.hpp"

namespace parhelion::render {

/// Owns an EGL context (surfaceless): create, use and destroy it on one thread.
class VirtualDepthCamera {
 public:
  /// Error: no EGL, with what to install.
  static Result<std::unique_ptr<VirtualDepthCamera>> create(const SemanticModel& building);
  virtual ~VirtualDepthCamera() = default;
  /// DEPTH at `stamp`: millimetres along the optical axis (PNG) of the nearest of the building, doors in
  /// their current pose, and all bodies in `world.bodies`, the robot's own included, as measured by the
  /// description's sensor; 0: no measurement. Windows are transparent. Its noise is keyed by (seed, sequence,
  /// pixel). Without calibration (fx <= 0), and where the driver fails, the image has no bytes.
  virtual Image measure(const DepthCameraDescription& camera,
                        const Transform<Map, DepthOptical>& T_map_optical, const WorldSnapshot& world,
                        SensorTime stamp, std::uint64_t seed, std::uint64_t sequence) = 0;
};

}  // namespace parhelion::render
