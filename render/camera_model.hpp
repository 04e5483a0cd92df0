// Camera model with lens distortion: projection and its inverse, and the pinhole views from which a distorted
// image is rendered.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "protocols/image.hpp"
#include "protocols/status.hpp"

namespace parhelion::render {

/// Pixels [x0, x1) x [y0, y1).
struct PixelRect {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
  bool empty() const { return x1 <= x0 || y1 <= y0; }
  int width() const { return x1 - x0; }
  int height() const { return y1 - y0; }
  PixelRect united(const PixelRect& other) const;
  PixelRect intersected(const PixelRect& other) const;
  PixelRect grown(int pixels) const { return {x0 - pixels, y0 - pixels, x1 + pixels, y1 + pixels}; }
};

/// The intrinsics for an image of this size: scaled where the aspect ratio is the same. Error: not
/// calibrated, not finite, another aspect ratio, or an invalid image size.
Result<CameraIntrinsics> intrinsics_for_size(const CameraIntrinsics& intrinsics, int width, int height);

/// A lens with the precomputed limit up to which its distortion is monotonic. Brown-Conrady and
/// Kannala-Brandt as defined in OpenCV.
class Lens {
 public:
  explicit Lens(const CameraIntrinsics& intrinsics);
  bool undistorted() const { return undistorted_; }
  /// Pixel of a point in the optical frame (m), or nothing where the lens does not image it (behind a
  /// pinhole, beyond the limit).
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_optical) const;
  /// Unit direction of a pixel in the optical frame, or nothing where the lens images no direction there.
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel) const;

 private:
  CameraIntrinsics c_;
  bool undistorted_;
  double limit_;  ///< radius (Brown-Conrady) or angle in rad (Kannala-Brandt)
};

/// An undistorted view: pixel (u, v) looks along R_optical_view * ((u - cx) / f, (v - cy) / f, 1).
struct PinholeView {
  Eigen::Matrix3d R_optical_view = Eigen::Matrix3d::Identity();
  double fx = 0, fy = 0, cx = 0, cy = 0;
  int width = 0, height = 0;
};

/// Renders a camera's image with a pinhole renderer: directly where the lens has no distortion, else through
/// one view (up to 65 degrees off axis) or the faces of a cube, warped by a precomputed map. The views have
/// at least the resolution of the image, so the warp loses no sharpness beyond its bilinear filter.
class CameraProjection {
 public:
  explicit CameraProjection(const CameraIntrinsics& intrinsics);

  const CameraIntrinsics& intrinsics() const { return intrinsics_; }
  /// The image is the single view itself: no warp.
  bool direct() const { return direct_; }
  const std::vector<PinholeView>& views() const { return views_; }

  static constexpr std::uint8_t kNoView = 255;
  struct Source {
    float u, v;         ///< pixel in the view
    std::uint8_t view;  ///< kNoView: the lens images nothing here
  };
  /// Source of pixel (x, y) of the image; only where not direct().
  const Source& source(int x, int y) const {
    return sources_[static_cast<std::size_t>(y) * static_cast<std::size_t>(intrinsics_.width) +
                    static_cast<std::size_t>(x)];
  }
  const Lens& lens() const { return lens_; }
  /// Unit direction of an image pixel; zero where the lens images nothing.
  Eigen::Vector3d direction(int x, int y) const;
  /// The image pixels (rounded to blocks of 16) that are rendered from `rect` of the view; and the inverse.
  PixelRect image_rect(std::size_t view, const PixelRect& rect) const;
  PixelRect view_rect(std::size_t view, const PixelRect& image) const;

 private:
  struct Block {
    float u0, v0, u1, v1;
  };
  void make_views(double max_angle, double max_slope_x, double max_slope_y, double scale);
  void make_sources();

  CameraIntrinsics intrinsics_;
  Lens lens_;
  bool direct_ = true;
  std::vector<PinholeView> views_;
  std::vector<Source> sources_;
  int blocks_x_ = 0, blocks_y_ = 0;
  std::vector<Block> blocks_;  ///< bounds in each view of each 16x16 block of the image; u0 > u1: none
};

}  // namespace parhelion::render
