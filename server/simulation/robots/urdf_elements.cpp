#include "server/simulation/robots/urdf_elements.hpp"

#include <array>
#include <charconv>
#include <cmath>

#include "protocols/yaml/utf8.hpp"

namespace parhelion::simulation::urdf {
namespace {

/// Finite numbers, separated by spaces.
template <std::size_t Count>
std::array<double, Count> numbers(const XMLElement& element, const char* name, const std::string& text) {
  std::array<double, Count> values{};
  const char *at = text.data(), *const end = at + text.size();
  const auto skip_spaces = [&] {
    while (at != end && std::isspace(static_cast<unsigned char>(*at)) != 0) ++at;
  };
  bool good = true;
  for (double& value : values) {
    skip_spaces();
    if (at != end && *at == '+') ++at;
    const auto [next, error] = std::from_chars(at, end, value);
    good = good && error == std::errc{} && std::isfinite(value);
    at = next;
  }
  skip_spaces();
  if (!good || at != end) {
    refuse(element, std::string(name) + "='" + yaml::printable(text) + "'; expected " +
                        std::to_string(Count) + (Count == 1 ? " number" : " numbers, separated by spaces"));
  }
  return values;
}

}  // namespace

std::string text_of(const XMLElement& element, const char* name) {
  const char* text = element.Attribute(name);
  return text == nullptr ? "" : text;
}

std::string description_of(const XMLElement& element) {
  const std::string name = text_of(element, "name");
  return element.Name() + (name.empty() ? "" : " '" + yaml::printable(name) + "'");
}

[[noreturn]] void refuse(const XMLElement& element, const std::string& words) {
  throw Refused{element.GetLineNum(), description_of(element) + ": " + words};
}

const XMLElement& required_child(const XMLElement& element, const char* tag) {
  const XMLElement* child = element.FirstChildElement(tag);
  if (child == nullptr) refuse(element, std::string("expected <") + tag + "> in it");
  return *child;
}

std::string required_text(const XMLElement& element, const char* name) {
  const std::string text = text_of(element, name);
  if (text.empty()) refuse(element, std::string("expected the attribute ") + name);
  return text;
}

double number(const XMLElement& element, const char* name) {
  return numbers<1>(element, name, required_text(element, name))[0];
}

double number_or(const XMLElement& element, const char* name, double otherwise) {
  return element.Attribute(name) == nullptr ? otherwise : number(element, name);
}

Eigen::Vector3d required_vector(const XMLElement& element, const char* name) {
  const auto values = numbers<3>(element, name, required_text(element, name));
  return {values[0], values[1], values[2]};
}

Eigen::Vector3d vector_or_zero(const XMLElement& element, const char* name) {
  if (element.Attribute(name) == nullptr) return Eigen::Vector3d::Zero();
  const auto values = numbers<3>(element, name, text_of(element, name));
  return {values[0], values[1], values[2]};
}

Eigen::Isometry3d origin_of(const XMLElement& element) {
  Eigen::Isometry3d isometry = Eigen::Isometry3d::Identity();
  const XMLElement* origin = element.FirstChildElement("origin");
  if (origin == nullptr) return isometry;
  const Eigen::Vector3d half = vector_or_zero(*origin, "rpy") / 2;
  const Eigen::Array3d s = half.array().sin(), c = half.array().cos();
  Eigen::Quaterniond rotation(
      c.x() * c.y() * c.z() + s.x() * s.y() * s.z(), s.x() * c.y() * c.z() - c.x() * s.y() * s.z(),
      c.x() * s.y() * c.z() + s.x() * c.y() * s.z(), c.x() * c.y() * s.z() - s.x() * s.y() * c.z());
  isometry.linear() = rotation.normalized().toRotationMatrix();
  isometry.translation() = vector_or_zero(*origin, "xyz");
  return isometry;
}

std::optional<Eigen::Vector3f> color_of(const XMLElement& material) {
  const XMLElement* color = material.FirstChildElement("color");
  if (color == nullptr) return std::nullopt;
  const auto rgba = numbers<4>(*color, "rgba", required_text(*color, "rgba"));
  Eigen::Vector3f linear;
  for (int i = 0; i < 3; ++i) {
    const auto c = static_cast<float>(rgba[static_cast<std::size_t>(i)]);
    if (!(c >= 0 && c <= 1)) refuse(*color, "expected red, green, blue and alpha from 0 to 1");
    // URDF colours are sRGB.
    linear[i] = c <= 0.04045F ? c / 12.92F : std::pow((c + 0.055F) / 1.055F, 2.4F);
  }
  return linear;
}

}  // namespace parhelion::simulation::urdf
