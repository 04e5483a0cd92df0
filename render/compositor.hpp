// Renders virtual bodies into real images, occluded by real objects in front of them (promise 5). No GL type
// here. Implemented in compositor.cpp and virtual_camera.cpp.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocols/image.hpp"
#include "protocols/model.hpp"
#include "protocols/scan.hpp"
#include "protocols/status.hpp"
#include "protocols/world.hpp"

namespace parhelion::render {

/// One real image and everything that its rendering depends on.
struct RenderJob {
  Image image;  ///< of width 0: there is only a depth image. With metadata "stand-in": occluded only by
                ///< the model, not by the scan, as it shows only the model
  CameraDescription camera;
  Transform<Map, CameraOptical> T_map_optical;  ///< at the image's stamp
  WorldSnapshot world;                          ///< at the image's stamp
  std::optional<Image> depth;                   ///< nearest in time, if there is one
  DepthCameraDescription depth_camera;
  Transform<Map, DepthOptical> T_map_depth;  ///< at the depth image's stamp
  bool depth_answered = false;               ///< it only occludes: another job makes its MR_DEPTH
  std::optional<Scan> scan;                  ///< current real scan, an occluder in the laser's plane
  LaserDescription laser;
  Transform<Map, Laser> T_map_laser;  ///< at the scan's stamp
  double floor_z = 0;                 ///< m, map frame, height of contact shadows
};

struct RenderTimings {
  Duration decode, draw, composite, encode;
};

struct RenderAnswer {
  Image image;                 ///< same stamp and format; the same bytes where nothing is drawn
  std::optional<Image> depth;  ///< MR_DEPTH: never deeper than the real pixel
  bool drawn = false;          ///< into the image
  bool depth_drawn = false;    ///< into the depth image
  std::string reason;          ///< why the original was sent although there was something to draw; else empty
  std::vector<std::string> visible;  ///< entities with at least one visible pixel
  RenderTimings timings;
};

/// Owns an EGL context (surfaceless): create, use and destroy it on one thread.
class Compositor {
 public:
  /// Error: no EGL, with what to install.
  static Result<std::unique_ptr<Compositor>> create(const SemanticModel& building);
  virtual ~Compositor() = default;
  virtual RenderAnswer compose(const RenderJob& job) = 0;
  /// The result before re-encoding: BGR pixels and the coverage by bodies and shadows (255: fully covered).
  struct Pixels {
    int width = 0, height = 0;
    std::vector<std::uint8_t> bgr, mask;
    std::vector<std::uint8_t>
        coverage;  ///< coverage of each pixel, 0..255 (intermediate at soft edges and shadows)
  };
  virtual Result<Pixels> compose_pixels(const RenderJob& job) = 0;
};

/// Properties of a simulated camera's picture besides the view.
struct Exposure {
  bool shows_carrier = false;  ///< draw the robot that carries the camera, where it is in view
  double noise = 0;            ///< 1 sigma of an 8-bit value before encoding, independent per channel
  std::uint64_t seed = 0, sequence = 0;  ///< the noise depends only on them and on the pixel
};

/// A fully rendered view of building and bodies: the camera of demo and simulated robots (levels 1, 2).
class VirtualCamera {
 public:
  static Result<std::unique_ptr<VirtualCamera>> create(const SemanticModel& building);
  virtual ~VirtualCamera() = default;
  /// JPEG, at `stamp`, of the building and of the bodies in `world.bodies`. Where the exposure does not show
  /// the carrier, an entity is left out if the camera is within the bounding sphere of its body. Where
  /// `stand_in` is not empty the picture replaces a real camera's: injectable bodies are not drawn (the
  /// compositor draws them later), the picture is marked as a stand-in, and metadata "stand-in" holds the
  /// text. Without calibration (fx <= 0) the image has no bytes.
  virtual Image render(const CameraDescription& camera, const Transform<Map, CameraOptical>& T_map_optical,
                       const WorldSnapshot& world, SensorTime stamp, const std::string& stand_in,
                       const Exposure& exposure = {}) = 0;
};

}  // namespace parhelion::render
