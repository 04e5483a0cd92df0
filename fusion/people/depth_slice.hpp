// A level slice through a depth image, as a planar laser at the camera's place would see it: what the tracker
// of people takes. The same idea as ROS' depthimage_to_laserscan, but level in the map at any pitch and roll
// of the camera.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "fusion/people/people_tracker.hpp"
#include "protocols/frames.hpp"
#include "protocols/scan.hpp"

namespace parhelion::people {

struct DepthSliceOptions {
  double height = 0.35;                    ///< m over the map's zero, of the slice's middle
  double half_height = 0.05;               ///< m
  double steepest = 0.8;                   ///< |sine| of the optical axis' elevation: none beyond
  int columns = 320;                       ///< pixels looked at in a row, about; half of the rows at most
  double range_min = 0.3, range_max = 10;  ///< m, where the camera's description gives none
  double noise_sigma = 0.02;               ///< m, at least
};

/// A depth image with the direction of each pixel.
struct DepthView {
  int width = 0, height = 0;                    ///< pixels
  std::span<const std::uint16_t> millimetres;   ///< row by row, along the optical axis; 0: no measurement
  std::span<const Eigen::Vector3f> directions;  ///< of the same pixels, optical frame, z = 1; zero: none
  Transform<Map, DepthOptical> T_map_depth;     ///< at the image's stamp
  double range_min = 0, range_max = 0;          ///< m; a maximum of 0: not known
  double noise_sigma = 0;                       ///< m, of a range
};

/// A level scan. Memory is reused from image to image.
class DepthSlice {
 public:
  explicit DepthSlice(const DepthSliceOptions& options = {}) : options_(options) {}

  /// Beams from right to left over the image's width; NaN where the slice shows no surface. False, and no
  /// scan: the camera looks too steeply up or down, or its pose is not finite.
  bool set(const DepthView& view);

  const Scan& scan() const { return scan_; }  ///< without a stamp
  const LaserDescription& laser() const { return laser_; }
  /// Level, at the camera's place and the slice's height; x is where the camera looks.
  const scan::LaserMotion& motion() const { return motion_; }
  std::span<const float> beam_time() const { return beam_time_; }

 private:
  bool place(const DepthView& view);
  void span_beams(const DepthView& view, int step);
  void collect(const DepthView& view, int step);

  DepthSliceOptions options_;
  Scan scan_;
  LaserDescription laser_;
  scan::LaserMotion motion_;
  std::vector<float> beam_time_,
      offset_;  ///< offset: m, of the point that a beam has, from the slice's middle
};

/// The slices in which people are looked for: legs, which tables and boxes often hide, and chests.
std::array<DepthSlice, 2> depth_slices();
/// For a tracker of a slice: the lasers' classifiers take more of the furniture in a depth image for people.
PeopleOptions slice_people_options();

}  // namespace parhelion::people
