// Links and joints of a robot from URDF (liburdfdom reads it).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "server/simulation/robot_model.hpp"

namespace parhelion::simulation {

/// What the YAML beside a URDF adds to the materials that it names.
using MaterialTable = std::map<std::string, Material>;

struct UrdfRobot {
  std::vector<RobotLink> links;    ///< parents before children
  std::vector<RobotJoint> joints;  ///< joints[i].child == i + 1
};

/// `origin` names the file in errors. Of `materials` all but the albedo is taken, which is the URDF's colour.
/// Errors, with line: not XML, what liburdfdom refuses, a mass that is not positive, an inertia that no body
/// has, a link with two parents or with none, joints that turn in a ring, a joint of a kind that is not
/// simulated, a shape without size.
Result<UrdfRobot> read_urdf(const std::string& urdf, const std::string& origin,
                            const MaterialTable& materials);
/// Line of `<tag name="name"`, 0: there is none.
int urdf_line(const std::string& urdf, const std::string& tag, const std::string& name);

}  // namespace parhelion::simulation
