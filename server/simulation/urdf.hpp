// Links and joints of a robot from URDF (parsed by liburdfdom).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "server/simulation/robot_model.hpp"

namespace parhelion::simulation {

/// Additional properties of a URDF's materials, from the YAML beside it.
using MaterialTable = std::map<std::string, Material>;

struct UrdfRobot {
  std::vector<RobotLink> links;    ///< parents before children
  std::vector<RobotJoint> joints;  ///< joints[i].child == i + 1
};

/// `origin` names the file in errors. From `materials` all but the albedo is used, which is the URDF's
/// colour. Errors, with line: not XML, rejected by liburdfdom, a mass that is not positive, a physically
/// impossible inertia, a link with two parents or with none, a kinematic loop, an unsupported kind of joint,
/// a shape without size.
Result<UrdfRobot> read_urdf(const std::string& urdf, const std::string& origin,
                            const MaterialTable& materials);
/// Line of `<tag name="name"`; 0: not found.
int urdf_line(const std::string& urdf, const std::string& tag, const std::string& name);

}  // namespace parhelion::simulation
