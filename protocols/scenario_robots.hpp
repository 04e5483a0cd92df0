// Reads the robots of a scenario that has several, from YAML.
#pragma once

#include <string>
#include <vector>

#include "protocols/scenario.hpp"
#include "protocols/yaml/document.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion {

/// `robots` of the scenario `node`, which has passed yaml::check(), into `scenario`, whose agents and trainee
/// are already read. Names of channels go to scenario.channels. Errors go to `problems`.
void read_robots(const yaml::Node& node, Scenario& scenario, yaml::Problems& problems);
void write_robots(const std::vector<ScenarioRobot>& robots, yaml::Writer& writer);

/// Names of the robots in their channels; empty if there is one, whose channels have bare names.
std::vector<std::string> robots_in_channels(const Scenario& scenario);

}  // namespace parhelion
