// Robot descriptions of a session with several robots.
#pragma once

#include <string>
#include <vector>

#include "protocols/robot.hpp"
#include "protocols/scenario.hpp"
#include "protocols/status.hpp"

namespace parhelion::tick {

struct Configuration;

/// Gives the descriptions the names that the scenario gives its robots, in its order. Error: not one
/// description for each robot.
Status name_robots(const Scenario& scenario, std::vector<RobotDescription>& robots);

/// All robots' descriptions as YAML documents, separated by "---"; of one robot its description alone.
std::string to_yaml_documents(const Configuration& configuration);
std::string to_yaml_documents(const std::vector<RobotDescription>& robots);
/// The inverse. `origin` as in parse_robot_description().
Result<std::vector<RobotDescription>> parse_robot_descriptions(const std::string& documents,
                                                               const std::string& origin);

}  // namespace parhelion::tick
