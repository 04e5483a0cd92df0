// What a depth image shows in the vertical plane through a beam of a laser, from the laser to the beam's end.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "render/camera_model.hpp"
#include "render/depth_image.hpp"
#include "tools/calibration/level_posterior.hpp"

namespace parhelion::tools {

/// A beam in the frame of a base, of unknown height.
struct LevelBeam {
  Eigen::Vector2d origin, direction;  ///< m, unit
  double range = 0;                   ///< m
  double bearing = 0;                 ///< rad, of the direction in the base that carries the laser
  double slope = 0;                   ///< by which the described laser's beam rises, m per m
};

class BeamPlane {
 public:
  /// `beam` is in the frame of the base that carries the camera. The image has the size of the lens.
  BeamPlane(const LevelBeam& beam, const render::DepthPixels& image, const render::Lens& lens,
            const Eigen::Isometry3d& T_optical_base);

  /// m from the laser, ascending, of the columns that are looked at; the last is at the end of the beam.
  const std::vector<double>& columns() const { return s_; }
  /// m along the optical axis, of the end.
  double depth_of_end() const { return depth_of_end_; }
  /// Of a laser `height` m high and a beam that rises by `slope` more than described: an outcome of
  /// BeamOutcomes. A beam contradicts where it passes through a surface, and where it ends before one.
  /// `places`: of the columns.
  std::uint8_t outcome(double height, double slope, const std::vector<std::uint8_t>& places) const;

 private:
  /// m along the optical axis from a point of a column to the surface that the camera sees there; NaN: it
  /// measures none.
  float before_surface(std::size_t column, double z) const;

  std::vector<double> s_;
  double slope_ = 0;
  std::vector<float> before_, tolerance_;
  double depth_of_end_ = 0;
};

/// As BeamPlane, of one point in base_link.
float before_surface(const Eigen::Vector3d& p_base, const render::DepthPixels& image,
                     const render::Lens& lens, const Eigen::Isometry3d& T_optical_base);

}  // namespace parhelion::tools
