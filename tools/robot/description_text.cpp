#include "tools/robot/description_text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace parhelion::tools {

void DescriptionText::line(const std::string& content, const std::string& source) {
  const std::size_t column = std::max<std::size_t>(content.size() + 2, 40);
  text_ += content;
  if (!source.empty()) text_ += std::string(column - content.size(), ' ') + "# " + source;
  text_ += '\n';
}

std::string formatted(const char* how, double value) {
  char text[64];
  std::snprintf(text, sizeof text, how, value);
  return text;
}

std::string metres_text(double metres) {
  std::string text = formatted("%.4f", metres);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return (text == "-0" ? "0" : text) + " m";
}

std::string degrees_text(double radians) { return formatted("%.6g deg", radians * 180 / std::numbers::pi); }

std::string pose_text(const Eigen::Isometry3d& T_base_part, bool camera) {
  const Eigen::Vector3d p = T_base_part.translation();
  const Eigen::Matrix3d R = T_base_part.linear();
  std::string text = std::string("{") + (camera ? "axes: link, " : "") + "x: " + metres_text(p.x()) +
                     ", y: " + metres_text(p.y()) + ", z: " + metres_text(p.z());
  const double roll = std::atan2(R(2, 1), R(2, 2)), pitch = std::asin(std::clamp(-R(2, 0), -1.0, 1.0));
  const double yaw = std::atan2(R(1, 0), R(0, 0));
  for (const auto& [key, angle] : {std::pair{"roll", roll}, {"pitch", pitch}, {"yaw", yaw}}) {
    if (std::abs(angle) > 1e-5)
      text += std::string(", ") + key + ": " + formatted("%.3f deg", angle * 180 / std::numbers::pi);
  }
  return text + "}";
}

}  // namespace parhelion::tools
