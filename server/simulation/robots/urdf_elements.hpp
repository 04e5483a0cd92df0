// What a URDF element says in its attributes and children: text, numbers, poses, colours.
#pragma once

#include <tinyxml2.h>

#include <Eigen/Geometry>
#include <optional>
#include <string>

namespace parhelion::simulation::urdf {

using tinyxml2::XMLElement;

/// Thrown by the readers below, for read_urdf(): XML has an error at any depth, and each reader would only
/// pass it on.
struct Refused {
  int line;
  std::string words;
};

[[noreturn]] void refuse(const XMLElement& element, const std::string& words);

/// An attribute; empty: there is none.
std::string text_of(const XMLElement& element, const char* name);
std::string required_text(const XMLElement& element, const char* name);
/// The element by its tag and name, for messages.
std::string description_of(const XMLElement& element);
const XMLElement& required_child(const XMLElement& element, const char* tag);

/// Finite numbers.
double number(const XMLElement& element, const char* name);
double number_or(const XMLElement& element, const char* name, double otherwise);
Eigen::Vector3d required_vector(const XMLElement& element, const char* name);
Eigen::Vector3d vector_or_zero(const XMLElement& element, const char* name);

/// <origin> of an element: xyz in m, rpy in rad about fixed axes, roll first.
Eigen::Isometry3d origin_of(const XMLElement& element);
/// <color> of a material, linear; nullopt: it has none.
std::optional<Eigen::Vector3f> color_of(const XMLElement& material);

}  // namespace parhelion::simulation::urdf
