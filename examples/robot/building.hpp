// The true building around the robot, and a ray caster in it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "geometry.hpp"

namespace robot {

struct Point3 {
  double x = 0, y = 0, z = 0;  // m
};

struct Colour {
  std::uint8_t red = 0, green = 0, blue = 0;
};

// A box turned about the vertical, or an upright cylinder.
struct Solid {
  bool is_round = false;
  Pose2 T_site_solid;             // at its middle
  double half_x = 0, half_y = 0;  // m; half_x is the radius of a cylinder
  double bottom = 0, top = 0;     // m over the floor
  Colour colour;
};

struct Hit {
  double range = 0;  // m along the ray; infinity: nothing
  Colour colour;     // lit
};

class Building {
 public:
  // Reads a file like building.txt. Throws std::runtime_error with file, line and what was expected.
  explicit Building(const std::string& path);

  // Along the unit vector `direction`, not farther than `range_max`. The floor is z = 0.
  Hit cast(const Point3& from, const Point3& direction, double range_max) const;
  // Whether a prism from the floor to `height` meets a solid.
  bool touches(const Pose2& T_site_base, const Polygon& footprint, double height) const;
  // Where the robot is switched on.
  Pose2 start() const { return start_; }

 private:
  std::vector<Solid> solids_;
  Pose2 start_;
};

}  // namespace robot
