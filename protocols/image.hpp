// An image with its encoding, and the camera that took it.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "protocols/frames.hpp"
#include "protocols/time.hpp"

namespace parhelion {

/// Values of image_t's pixelformat (V4L2 four-character codes, as in bot_core).
enum class PixelFormat : std::int32_t {
  gray = 1497715271,
  rgb = 859981650,
  bgr = 861030210,
  mjpeg = 1196444237,
  depth_mm = 540422490,  ///< 'Z16 ': 16-bit millimetres; metadata "encoding": raw, png or zlib
};

struct ImageMetadata {
  std::string key;
  std::vector<std::uint8_t> value;
};

struct Image {
  SensorTime stamp;  ///< middle of the exposure
  int width = 0;
  int height = 0;
  int row_stride = 0;  ///< bytes, 0 for compressed formats
  PixelFormat format = PixelFormat::mjpeg;
  std::vector<std::uint8_t> bytes;  ///< pixels row by row, or the compressed stream
  std::vector<ImageMetadata> metadata;

  /// The text of a metadata entry, or nullptr.
  const ImageMetadata* find_metadata(const std::string& key) const;
};

/// Pinhole with a lens model. Pixel centres at integer coordinates.
struct CameraIntrinsics {
  enum class Lens : std::uint8_t {
    radial_tangential,  ///< Brown-Conrady, k1 k2 p1 p2 k3 (OpenCV's order)
    fisheye,            ///< Kannala-Brandt, k1 k2 k3 k4 (OpenCV's fisheye)
  };
  int width = 0, height = 0;              ///< pixels
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< pixels
  Lens lens = Lens::radial_tangential;
  std::array<double, 5> distortion{};  ///< in the lens model's order; zeros: none
};

/// A joint that moves a sensor mounted on it, such as pan or tilt of a camera head. Given in base_link with
/// all joints of the head at zero.
struct HeadJoint {
  std::string joint;  ///< name in JOINT_STATE; radians, right-handed about `axis`
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< m, any point of the axis
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit vector
};

struct CameraDescription {
  CameraIntrinsics intrinsics;
  Transform<Base, CameraOptical> T_base_optical;  ///< with all joints of `head` at zero
  std::vector<HeadJoint> head;                    ///< from the base outwards; none: fixed to the base
  double readout = 0;                             ///< s, first to last row of a rolling shutter; 0: global
  double time_offset = 0;  ///< s, to add to a stamp of CAMERA: then it is on the clock of the scans
  double rate = 0;         ///< Hz, of images; 0: not given
  double noise = 0;        ///< 1 sigma of an 8-bit pixel's value, independent per channel
  std::string source;      ///< information of an imported source beyond these fields
};

struct DepthCameraDescription {
  CameraIntrinsics intrinsics;
  Transform<Base, DepthOptical> T_base_optical;  ///< with all joints of `head` at zero
  std::vector<HeadJoint> head;
  double range_min = 0, range_max = 0;  ///< m, along the optical axis; a maximum of 0: not given
  std::string source;
  // For simulated cameras; a real one has these by itself.
  double rate = 0;             ///< Hz, of images; 0: not given
  double noise = 0;            ///< m, 1 sigma, the same at all ranges, as for time of flight
  double baseline = 0;         ///< m, to the second camera or the projector, which is to its right; 0: none
  double disparity_noise = 0;  ///< px, 1 sigma of the disparity, from which it triangulates
  double disparity_step = 0;   ///< px, quantisation step of the disparity
};

}  // namespace parhelion
