// CAMERA images as pixels.
#pragma once

#include <cstdint>
#include <vector>

#include "protocols/image.hpp"
#include "protocols/status.hpp"
#include "render/camera_model.hpp"

namespace parhelion::render {

struct ColourPixels {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;  ///< row by row
};

/// Decodes MJPEG and the raw formats. Error: another format, an inconsistent size, a corrupt stream.
Result<ColourPixels> decode_colour(const Image& image);

/// A pinhole camera and where each of its pixels lies in the image of a lens: row by row, and inside the
/// image. The same size; a longer focal length where the lens leaves corners of the image empty.
struct Unwarp {
  PinholeView view;
  std::vector<Eigen::Vector2f> source;  ///< empty: the lens has no distortion
};
Unwarp unwarp(const CameraIntrinsics& intrinsics);

/// Bilinear.
ColourPixels unwarped(ColourPixels pixels, const Unwarp& unwarp);
/// The nearest pixel, as depths of two surfaces have no mean.
std::vector<std::uint16_t> unwarped(std::vector<std::uint16_t> depth, int width, const Unwarp& unwarp);

}  // namespace parhelion::render
