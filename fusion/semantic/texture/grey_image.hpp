// A blurred grey image with its gradient between pixels.
#pragma once

#include "fusion/semantic/texture/views.hpp"

namespace parhelion::semantic {

class GreyImage {
 public:
  /// `gain`: per channel. The blur is a Gaussian, pixels.
  GreyImage(const ColourView& view, const Eigen::Vector3f& gain, double blur);

  struct Value {
    float grey = 0;                                      ///< 0..255
    Eigen::Vector2f gradient = Eigen::Vector2f::Zero();  ///< per pixel
  };
  /// The pixel must be at least one pixel inside.
  Value at(const Eigen::Vector2d& pixel) const;

 private:
  float pixel(int column, int row) const { return grey_[camera_.at(column, row)]; }
  void blur(double sigma);

  Pinhole camera_;
  std::vector<float> grey_;
};

}  // namespace parhelion::semantic
