// A simulated robot's depth camera (levels 1 and 2). No GL type here.
#pragma once

#include <cstdint>
#include <memory>

#include "protocols/image.hpp"
#include "protocols/model.hpp"
#include "protocols/status.hpp"
#include "protocols/world.hpp"

namespace parhelion::render {

/// Owns an EGL context (surfaceless): make, use and destroy it on one thread.
class VirtualDepthCamera {
 public:
  /// Error: no EGL, with what to install.
  static Result<std::unique_ptr<VirtualDepthCamera>> create(const SemanticModel& building);
  virtual ~VirtualDepthCamera() = default;
  /// DEPTH at `stamp`: millimetres along the optical axis (PNG) of the nearest of the building, doors as they
  /// stand, and all bodies in `world.bodies`, the robot's own included, as the description's sensor measures
  /// them; 0: nothing measured. Windows let it through. Its noise is keyed by (seed, sequence, pixel).
  /// Without calibration (fx <= 0), and where the driver refuses, the image comes back without bytes.
  virtual Image measure(const DepthCameraDescription& camera,
                        const Transform<Map, DepthOptical>& T_map_optical, const WorldSnapshot& world,
                        SensorTime stamp, std::uint64_t seed, std::uint64_t sequence) = 0;
};

}  // namespace parhelion::render
