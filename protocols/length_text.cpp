#include "protocols/length_text.hpp"

#include <cmath>
#include <cstdio>

namespace parhelion {

std::string length_text(double metres) {
  const double millimetres = std::round(metres * 1e3);
  char text[340];  // fits the largest double
  if (std::abs(millimetres) < 100 && millimetres != 0)
    std::snprintf(text, sizeof text, "%.3f m", millimetres * 1e-3);
  else
    std::snprintf(text, sizeof text, "%.2f m", millimetres == 0 ? 0.0 : metres);
  return text;
}

}  // namespace parhelion
