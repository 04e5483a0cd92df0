// The robot description as a part of another document.
#pragma once

#include "protocols/robot.hpp"
#include "protocols/yaml/document.hpp"

namespace parhelion::yaml {

/// Reads a node that has passed check() against robot.schema.json.
RobotDescription read_robot(const Node& node, Problems& problems);
/// Keeps the limits that the node does not have.
void read_attitude_limits(const Node& node, AttitudeLimits& limits);

}  // namespace parhelion::yaml
