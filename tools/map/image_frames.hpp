// Camera and depth images of an LCM log with the poses of their cameras, for the texture of a site.
#pragma once

#include <filesystem>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "fusion/semantic/texture/views.hpp"
#include "protocols/status.hpp"

namespace parhelion::tools {

struct ImageFrameOptions {
  std::filesystem::path robot;  ///< robot description that replaces the log's own
  /// Of colour images the first is used, and each after the camera has moved or turned this much since the
  /// last; of depth images half as much is enough, and those taken with a colour image that is used are used,
  /// too.
  double distance = 0.05;                     ///< m
  double angle = 3 * std::numbers::pi / 180;  ///< rad
  /// Images of a kind, of 640x480 pixels; of larger ones fewer. With more, distance and angle grow.
  std::size_t max_images = 400;
  /// Whether an image taken from this pose is used; empty: all are.
  std::function<bool(const Eigen::Isometry3d& T_map_optical)> wanted;
};

struct ImageFrames {
  std::vector<semantic::ColourView> colour;
  std::vector<semantic::DepthView> depth;
  std::vector<std::string> notes;  ///< for people, with the file's name
};

/// Errors name the log: not readable, no robot description, no poses, no camera, no image with a pose.
Result<ImageFrames> read_image_frames(const std::string& log, const ImageFrameOptions& options = {});

}  // namespace parhelion::tools
