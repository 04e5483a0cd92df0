#include "server/simulation/world/place_text.hpp"

#include <cstdio>

namespace parhelion::simulation {

std::string place_text(const Eigen::Vector2d& p) {
  char text[700];  // of the greatest doubles, too
  std::snprintf(text, sizeof text, "(%.2f, %.2f)", p.x(), p.y());
  return text;
}

}  // namespace parhelion::simulation
