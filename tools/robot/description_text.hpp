// A robot description as text: each value with the source that it comes from.
#pragma once

#include <Eigen/Geometry>
#include <string>

namespace parhelion::tools {

class DescriptionText {
 public:
  /// A line of YAML, and behind it the source as a comment.
  void line(const std::string& content, const std::string& source = "");
  /// The text so far, which is no longer here.
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

std::string formatted(const char* how, double value);
/// With unit, to a tenth of a millimetre, without zeros at the end; `metres`: m.
std::string metres_text(double metres);
/// With unit; `radians`: rad.
std::string degrees_text(double radians);
/// YAML of a pose in base_link; T_base_part: base_link to the part. `camera`: its axes are those of a link.
std::string pose_text(const Eigen::Isometry3d& T_base_part, bool camera);

}  // namespace parhelion::tools
