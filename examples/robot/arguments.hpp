// Command lines of the form --option VALUE.
#pragma once

#include <cmath>
#include <stdexcept>
#include <string>

#include "geometry.hpp"

namespace robot {

// Throws std::invalid_argument that names the option, as the other functions do.
inline double number(const std::string& option, const std::string& text) {
  std::size_t read = 0;
  try {
    const double value = std::stod(text, &read);
    if (read == text.size() && std::isfinite(value)) return value;
  } catch (const std::logic_error&) {
  }
  throw std::invalid_argument(option + " " + text + ": expected a number");
}

inline Point2 point(const std::string& option, const std::string& text) {
  const std::size_t comma = text.find(',');
  if (comma == std::string::npos) throw std::invalid_argument(option + " " + text + ": expected X,Y");
  return {number(option, text.substr(0, comma)), number(option, text.substr(comma + 1))};
}

template <class Set>
void read_arguments(int argc, char** argv, const Set& set) {
  for (int i = 1; i < argc; i += 2) {
    if (i + 1 == argc) throw std::invalid_argument(std::string(argv[i]) + ": expected a value");
    set(std::string(argv[i]), std::string(argv[i + 1]));
  }
}

}  // namespace robot
