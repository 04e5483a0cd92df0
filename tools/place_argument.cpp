#include "tools/place_argument.hpp"

#include <vector>

#include "protocols/yaml/quantity.hpp"

namespace parhelion::tools {
namespace {

using yaml::Quantity;

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == ',') {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

Result<double> parse_length(const std::string& text) {
  if (const auto metres = yaml::parse_number(text)) return *metres;
  return yaml::parse_quantity(text, Quantity::length);
}

Result<double> parse_yaw(const std::string& text) {
  const auto bare = yaml::parse_number(text);
  if (!bare) return yaml::parse_quantity(text, Quantity::angle);
  if (*bare == 0) return 0.0;
  return Error{"a yaw needs a unit: " + text + "deg or " + text + "rad?"};
}

template <int n>
Result<Eigen::Matrix<double, n, 1>> parse_all_lengths(const std::string& text, const char* expected) {
  const auto parts = split(text);
  if (parts.size() != n) return Error{std::string("expected ") + expected};
  Eigen::Matrix<double, n, 1> lengths;
  for (int i = 0; i < n; ++i) {
    const auto length = parse_length(parts[static_cast<std::size_t>(i)]);
    if (!length) return length.error();
    lengths[i] = *length;
  }
  return lengths;
}

}  // namespace

Result<Eigen::Vector3d> parse_place(const std::string& text, bool with_yaw) {
  const auto parts = split(text);
  if (parts.size() != 3 && (with_yaw || parts.size() != 2))
    return Error{std::string(with_yaw ? "expected " : "expected X,Y or ") + kPlaceFormat};
  const auto position = parse_point(text.substr(0, parts[0].size() + 1 + parts[1].size()));
  if (!position) return position.error();
  const auto yaw = parts.size() == 3 ? parse_yaw(parts[2]) : Result<double>(0.0);
  if (!yaw) return yaw.error();
  return Eigen::Vector3d(position->x(), position->y(), *yaw);
}

Result<Eigen::Vector2d> parse_point(const std::string& text) {
  return parse_all_lengths<2>(text, "X,Y in the map, such as 2.5,1");
}

Result<Eigen::Vector3d> parse_lengths(const std::string& text) {
  return parse_all_lengths<3>(text, "X,Y,Z, such as 0.4,0.4,0.6");
}

}  // namespace parhelion::tools
