// Draws virtual bodies into real images, hidden behind what is really in front of them (promise 5). No GL
// type here.
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

/// One real image and all that its answer depends on.
struct RenderJob {
  Image image;  ///< one with metadata "stand-in" is hidden in by the model only, not by scan (it shows
                ///< nothing but the model)
  CameraDescription camera;
  Transform<Map, CameraOptical> T_map_optical;  ///< at the image's stamp
  WorldSnapshot world;                          ///< at the image's stamp
  std::optional<Image> depth;                   ///< nearest in time, where there is one
  DepthCameraDescription depth_camera;
  Transform<Map, DepthOptical> T_map_depth;  ///< at the depth image's stamp
  std::optional<Scan> scan;                  ///< current real scan, occluder in the laser's plane
  LaserDescription laser;
  Transform<Map, Laser> T_map_laser;  ///< at the scan's stamp
  double floor_z = 0;                 ///< m, map frame, where contact shadows fall
};

struct RenderTimings {
  Duration decode, draw, composite, encode;
};

struct RenderAnswer {
  Image image;                 ///< same stamp and format; the same bytes where nothing is drawn
  std::optional<Image> depth;  ///< MR_DEPTH: never deeper than the real pixel
  bool drawn = false;
  std::string reason;  ///< why the original went out although there was something to draw; else empty
  std::vector<std::string> visible;  ///< entities with at least one visible pixel
  RenderTimings timings;
};

/// Owns an EGL context (surfaceless): make, use and destroy it on one thread.
class Compositor {
 public:
  /// Error: no EGL, with what to install.
  static Result<std::unique_ptr<Compositor>> create(const SemanticModel& building);
  virtual ~Compositor() = default;
  virtual RenderAnswer compose(const RenderJob& job) = 0;
  /// The same before re-encoding: BGR pixels and the mask of pixels that a body or its shadow covers (255
  /// where covered).
  struct Pixels {
    int width = 0, height = 0;
    std::vector<std::uint8_t> bgr, mask;
    std::vector<std::uint8_t>
        coverage;  ///< how much of each pixel is covered, 0..255 (soft edges and shadows between)
  };
  virtual Result<Pixels> compose_pixels(const RenderJob& job) = 0;
};

/// What a simulated camera's picture has besides the view.
struct Exposure {
  bool shows_carrier = false;  ///< the robot that carries the camera is drawn, as far as it is in the picture
  double noise = 0;            ///< 1 sigma of an 8-bit value before encoding, each channel its own
  std::uint64_t seed = 0, sequence = 0;  ///< the noise depends on them and on the pixel alone
};

/// A whole rendered view of building and bodies: the stand-in camera of demo and simulated robots (levels 1,
/// 2).
class VirtualCamera {
 public:
  static Result<std::unique_ptr<VirtualCamera>> create(const SemanticModel& building);
  virtual ~VirtualCamera() = default;
  /// JPEG, at `stamp`, of the building and of the bodies in `world.bodies` (where the exposure does not show
  /// the carrier, an entity is left out if the camera sits within the bounding sphere of its body). Where
  /// `stand_in` is not empty the picture stands for a real camera's: injectable bodies are not drawn (the
  /// compositor draws them later), the picture says what it is, and metadata "stand-in" holds the text.
  /// Without calibration (fx <= 0) the image comes back without bytes.
  virtual Image render(const CameraDescription& camera, const Transform<Map, CameraOptical>& T_map_optical,
                       const WorldSnapshot& world, SensorTime stamp, const std::string& stand_in,
                       const Exposure& exposure = {}) = 0;
};

}  // namespace parhelion::render
