#include "building.hpp"

#include <algorithm>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace robot {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Touch {
  double range = kInfinity;
  double light = 1;  // 0..1, by the direction of the surface
};

// Narrows [near, far] to where from + t * direction is within [low, high]; false: nowhere.
bool clip(double from, double direction, double low, double high, double& near, double& far, bool& narrowed) {
  narrowed = false;
  if (std::abs(direction) < 1e-12) return from >= low && from <= high;
  double a = (low - from) / direction, b = (high - from) / direction;
  if (a > b) std::swap(a, b);
  if (a > near) near = a, narrowed = true;
  far = std::min(far, b);
  return near <= far;
}

// The slab method, in the box's own frame.
Touch cast_box(const Solid& box, const Point3& from, const Point3& direction) {
  const double c = std::cos(box.T_site_solid.yaw), s = std::sin(box.T_site_solid.yaw);
  const double dx = from.x - box.T_site_solid.x, dy = from.y - box.T_site_solid.y;
  double near = 0, far = kInfinity, light = 1;
  bool narrowed = false;
  if (!clip(c * dx + s * dy, c * direction.x + s * direction.y, -box.half_x, box.half_x, near, far, narrowed))
    return {};
  if (narrowed) light = 0.85;
  if (!clip(c * dy - s * dx, c * direction.y - s * direction.x, -box.half_y, box.half_y, near, far, narrowed))
    return {};
  if (narrowed) light = 0.7;
  if (!clip(from.z, direction.z, box.bottom, box.top, near, far, narrowed)) return {};
  if (narrowed) light = 1;
  return near > 0 ? Touch{near, light} : Touch{};
}

// The curved surface from outside, and the lid from above.
Touch cast_cylinder(const Solid& post, const Point3& from, const Point3& direction) {
  const double dx = from.x - post.T_site_solid.x, dy = from.y - post.T_site_solid.y;
  const double a = direction.x * direction.x + direction.y * direction.y;
  const double b = dx * direction.x + dy * direction.y;
  const double c = dx * dx + dy * dy - post.half_x * post.half_x;
  const double root = b * b - a * c;
  if (root < 0 || a < 1e-12) return {};
  const double side = (-b - std::sqrt(root)) / a;
  const double z = from.z + side * direction.z;
  if (side > 0 && z >= post.bottom && z <= post.top) return {side, 0.75};
  const double lid = (post.top - from.z) / direction.z;
  const double far = (-b + std::sqrt(root)) / a;
  return direction.z < 0 && lid > side && lid < far && lid > 0 ? Touch{lid, 1} : Touch{};
}

Colour lit(const Colour& colour, double light) {
  const auto dim = [light](std::uint8_t value) { return static_cast<std::uint8_t>(light * value); };
  return {dim(colour.red), dim(colour.green), dim(colour.blue)};
}

Polygon outline_of(const Solid& box) {
  Polygon outline;
  for (const Point2& corner : {Point2{-box.half_x, -box.half_y}, Point2{box.half_x, -box.half_y},
                               Point2{box.half_x, box.half_y}, Point2{-box.half_x, box.half_y}})
    outline.push_back(box.T_site_solid * corner);
  return outline;
}

// Whether one of a's sides separates it from all of b.
bool has_gap(const Polygon& a, const Polygon& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Point2 &from = a[i], &to = a[(i + 1) % a.size()];
    if (std::all_of(b.begin(), b.end(), [&](const Point2& p) {
          return (to.x - from.x) * (p.y - from.y) - (to.y - from.y) * (p.x - from.x) < 0;
        }))
      return true;
  }
  return false;
}

Solid read_solid(const std::string& kind, std::istringstream& words) {
  Solid solid;
  double width = 0, depth = 0, red = 0, green = 0, blue = 0;
  Pose2& T = solid.T_site_solid;
  if (kind == "wall") {
    Point2 a, b;
    words >> a.x >> a.y >> b.x >> b.y >> depth;
    T = {(a.x + b.x) / 2, (a.y + b.y) / 2, std::atan2(b.y - a.y, b.x - a.x)};
    width = distance(a, b);
  } else if (kind == "box") {
    words >> T.x >> T.y >> T.yaw >> width >> depth;
  } else {
    words >> T.x >> T.y >> width;
    width *= 2, depth = width, solid.is_round = true;
  }
  words >> solid.bottom >> solid.top >> red >> green >> blue;
  solid.half_x = width / 2, solid.half_y = depth / 2;
  solid.colour = {static_cast<std::uint8_t>(red), static_cast<std::uint8_t>(green),
                  static_cast<std::uint8_t>(blue)};
  return solid;
}

}  // namespace

Building::Building(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be opened; expected a building like building.txt");
  int number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    std::istringstream words(line.substr(0, line.find('#')));
    std::string kind;
    if (!(words >> kind)) continue;
    const bool is_solid = kind == "wall" || kind == "box" || kind == "post";
    Solid solid;
    if (is_solid) solid = read_solid(kind, words);
    if (kind == "start") words >> start_.x >> start_.y >> start_.yaw;
    const bool has_volume = solid.half_x > 0 && solid.half_y > 0 && solid.top > solid.bottom;
    if (!words || (is_solid && !has_volume) || (!is_solid && kind != "start"))
      throw std::runtime_error(path + ":" + std::to_string(number) +
                               ": expected 'wall', 'box', 'post' or 'start' with the numbers that "
                               "building.txt names, and sizes above 0");
    if (is_solid) solids_.push_back(solid);
  }
  if (solids_.empty()) throw std::runtime_error(path + ": has no wall, box or post");
}

Hit Building::cast(const Point3& from, const Point3& direction, double range_max) const {
  Hit hit{kInfinity, {185, 205, 225}};  // the sky
  double nearest = range_max;
  for (const Solid& solid : solids_) {
    const Touch touch =
        solid.is_round ? cast_cylinder(solid, from, direction) : cast_box(solid, from, direction);
    if (touch.range >= nearest) continue;
    nearest = touch.range;
    hit = {touch.range, lit(solid.colour, touch.light)};
  }
  const double floor = direction.z < 0 ? -from.z / direction.z : kInfinity;
  if (floor >= nearest) return hit;
  const double x = from.x + floor * direction.x, y = from.y + floor * direction.y;
  const bool dark = (static_cast<long>(std::floor(2 * x)) + static_cast<long>(std::floor(2 * y))) % 2 != 0;
  return {floor, lit({150, 140, 125}, dark ? 0.85 : 1)};
}

bool Building::touches(const Pose2& T_site_base, const Polygon& footprint, double height) const {
  Polygon outline;
  for (const Point2& corner : footprint) outline.push_back(T_site_base * corner);
  return std::any_of(solids_.begin(), solids_.end(), [&](const Solid& solid) {
    if (solid.bottom >= height || solid.top <= 0) return false;
    if (solid.is_round) return distance(outline, {solid.T_site_solid.x, solid.T_site_solid.y}) < solid.half_x;
    const Polygon box = outline_of(solid);
    return !has_gap(outline, box) && !has_gap(box, outline);
  });
}

}  // namespace robot
