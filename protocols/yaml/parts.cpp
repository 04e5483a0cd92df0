#include "protocols/yaml/parts.hpp"

#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

#include "protocols/yaml/quantity.hpp"

namespace parhelion::yaml {
namespace {

/// Axes of a camera link to its optical axes: z forward, x right, y down.
Eigen::Matrix3d link_to_optical() {
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return R;
}

double value_or_zero(const Node& map, std::string_view key) {
  double value = 0;
  read(map, key, value);
  return value;
}

Eigen::Isometry3d from_angles(const Eigen::Vector3d& p, double roll, double pitch, double yaw) {
  if (roll == 0 && pitch == 0) return Transform<Map, Base>::planar(p.x(), p.y(), yaw, p.z()).isometry();
  const Eigen::Quaterniond q = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
                               Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
  return Transform<Map, Base>(q, p).isometry();
}

Eigen::Isometry3d from_quaternion(const Eigen::Vector3d& p, const std::array<double, 4>& q) {
  return Transform<Map, Base>(Eigen::Quaterniond(q[0], q[1], q[2], q[3]), p).isometry();
}

Eigen::Isometry3d from_matrix(const Eigen::Vector3d& p, const Eigen::Matrix3d& R) {
  Eigen::Isometry3d isometry = Eigen::Isometry3d::Identity();
  isometry.linear() = R;
  isometry.translation() = p;
  return isometry;
}

bool same_rotation(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return a.linear() == b.linear();
}

std::string format_position(const Eigen::Vector3d& p) {
  std::string text =
      "x: " + format_quantity(p.x(), Quantity::length) + ", y: " + format_quantity(p.y(), Quantity::length);
  if (p.z() != 0) text += ", z: " + format_quantity(p.z(), Quantity::length);
  return text;
}

/// Candidates: the angle itself, a round number of degrees near it, and its neighbouring doubles.
std::array<double, 10> near_angles(double angle) {
  std::array<double, 10> near{};
  const double degrees = angle * 180 / std::numbers::pi;
  near[0] = std::round(degrees * 1e3) / 1e3 * std::numbers::pi / 180;
  near[1] = std::round(degrees * 1e6) / 1e6 * std::numbers::pi / 180;
  near[2] = angle;
  double up = angle;
  double down = angle;
  for (std::size_t i = 3; i + 1 < near.size(); i += 2) {
    near[i] = up = std::nextafter(up, 10.0);
    near[i + 1] = down = std::nextafter(down, -10.0);
  }
  return near;
}

/// "roll: ..., pitch: ..., yaw: ..." where some angles give exactly this rotation.
std::optional<std::string> format_angles(const Eigen::Isometry3d& isometry) {
  const Eigen::Matrix3d R = isometry.linear();
  const auto yaws = near_angles(std::atan2(R(1, 0), R(0, 0)));
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  for (const double yaw : yaws) {
    if (!same_rotation(from_angles(origin, 0, 0, yaw), isometry)) continue;
    return yaw == 0 ? "" : ", yaw: " + format_quantity(yaw, Quantity::angle);
  }
  const auto rolls = near_angles(std::atan2(R(2, 1), R(2, 2)));
  const auto pitches = near_angles(std::asin(std::clamp(-R(2, 0), -1.0, 1.0)));
  for (std::size_t i = 0; i < 3; ++i) {
    if (!same_rotation(from_angles(origin, rolls[i], pitches[i], yaws[i]), isometry)) continue;
    return ", roll: " + format_quantity(rolls[i], Quantity::angle) +
           ", pitch: " + format_quantity(pitches[i], Quantity::angle) +
           ", yaw: " + format_quantity(yaws[i], Quantity::angle);
  }
  return std::nullopt;
}

std::string format_rotation(const Eigen::Isometry3d& isometry) {
  const Eigen::Matrix3d R = isometry.linear();
  const Eigen::Quaterniond q(R);
  const std::array<double, 4> wxyz{q.w(), q.x(), q.y(), q.z()};
  const bool as_quaternion = same_rotation(from_quaternion(Eigen::Vector3d::Zero(), wxyz), isometry);
  std::string text = as_quaternion ? ", quaternion: [" : ", rotation: [";
  for (int i = 0; i < (as_quaternion ? 4 : 9); ++i) {
    if (i > 0) text += ", ";
    text += format_number(as_quaternion ? wxyz[static_cast<std::size_t>(i)] : R(i / 3, i % 3));
  }
  return text + "]";
}

const Node* first_of(const Node& map, std::initializer_list<std::string_view> keys) {
  for (const auto key : keys) {
    if (const Node* node = map.find(key)) return node;
  }
  return nullptr;
}

}  // namespace

void read(const Node& map, std::string_view key, double& out) {
  if (const Node* node = map.find(key)) out = node->number;
}
void read(const Node& map, std::string_view key, float& out) {
  if (const Node* node = map.find(key)) out = static_cast<float>(node->number);
}
void read(const Node& map, std::string_view key, int& out) {
  if (const Node* node = map.find(key)) out = static_cast<int>(node->number);
}
void read(const Node& map, std::string_view key, bool& out) {
  if (const Node* node = map.find(key)) out = node->number != 0;
}
void read(const Node& map, std::string_view key, std::uint64_t& out) {
  // Parsed from the text: a double has too few digits.
  if (const Node* node = map.find(key))
    std::from_chars(node->text.data(), node->text.data() + node->text.size(), out);
}
void read(const Node& map, std::string_view key, std::string& out) {
  if (const Node* node = map.find(key)) out = node->text;
}

Eigen::Vector2d vector2(const Node& list) { return {list.items.at(0).number, list.items.at(1).number}; }
Eigen::Vector3d vector3(const Node& list) {
  return {list.items.at(0).number, list.items.at(1).number, list.items.at(2).number};
}

std::string format_lengths(const double* values, std::size_t count) {
  std::string text = "[";
  for (std::size_t i = 0; i < count; ++i) {
    if (i > 0) text += ", ";
    text += format_quantity(values[i], Quantity::length);
  }
  return text + "]";
}

Eigen::Isometry3d read_isometry(const Node& map, Problems& problems) {
  const Eigen::Vector3d p(value_or_zero(map, "x"), value_or_zero(map, "y"), value_or_zero(map, "z"));
  const Node* angle = first_of(map, {"roll", "pitch", "yaw"});
  const Node* quaternion = map.find("quaternion");
  const Node* rotation = map.find("rotation");
  if ((angle != nullptr) + (quaternion != nullptr) + (rotation != nullptr) > 1) {
    problems.add(map.line, "one of (roll, pitch, yaw), quaternion and rotation is expected, found several");
    return Eigen::Isometry3d::Identity();
  }
  if (quaternion != nullptr) {
    std::array<double, 4> q{};
    double norm = 0;
    for (std::size_t i = 0; i < 4; ++i) norm = std::hypot(norm, q[i] = quaternion->items[i].number);
    if (!(std::abs(norm - 1) < 1e-3)) {
      problems.add(quaternion->line,
                   "'quaternion': expected length 1 (to 0.001), found " + format_number(norm));
    }
    return norm > 0 ? from_quaternion(p, q) : Eigen::Isometry3d::Identity();
  }
  if (rotation != nullptr) {
    Eigen::Matrix3d R;
    for (int i = 0; i < 9; ++i) R(i / 3, i % 3) = rotation->items[static_cast<std::size_t>(i)].number;
    const double error = (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    if (!(error < 1e-6) || R.determinant() < 0) {
      problems.add(rotation->line,
                   "'rotation': expected a right-handed orthonormal matrix (to 1e-6), row by row");
    }
    return from_matrix(p, R);
  }
  return from_angles(p, value_or_zero(map, "roll"), value_or_zero(map, "pitch"), value_or_zero(map, "yaw"));
}

std::string format_isometry(const Eigen::Isometry3d& isometry) {
  const auto angles = format_angles(isometry);
  return "{" + format_position(isometry.translation()) + (angles ? *angles : format_rotation(isometry)) + "}";
}

Eigen::Isometry3d read_camera_isometry(const Node& map, Problems& problems) {
  Eigen::Isometry3d isometry = read_isometry(map, problems);
  const Node* axes = map.find("axes");
  if (axes == nullptr || axes->text == "optical") return isometry;
  return from_matrix(isometry.translation(), isometry.linear() * link_to_optical());
}

std::string format_camera_isometry(const Eigen::Isometry3d& isometry) {
  // A product with a signed permutation is exact.
  const auto link = from_matrix(isometry.translation(), isometry.linear() * link_to_optical().transpose());
  if (const auto angles = format_angles(link))
    return "{axes: link, " + format_position(link.translation()) + *angles + "}";
  return format_isometry(isometry);
}

}  // namespace parhelion::yaml
