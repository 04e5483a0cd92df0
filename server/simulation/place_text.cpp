#include "server/simulation/place_text.hpp"

#include <cstdio>

namespace parhelion::simulation {

std::string metres(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2f", value);
  return text;
}

std::string place_text(const Eigen::Vector2d& p) { return "(" + metres(p.x()) + ", " + metres(p.y()) + ")"; }

}  // namespace parhelion::simulation
