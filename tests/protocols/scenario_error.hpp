// What is wrong with a scenario's YAML.
#pragma once

#include <string>

#include "protocols/scenario.hpp"

namespace parhelion::test {

/// Empty: nothing.
inline std::string error_of(const std::string& yaml) {
  const auto scenario = parse_scenario(yaml, "s.yaml");
  return scenario ? "" : scenario.error().message;
}

}  // namespace parhelion::test
