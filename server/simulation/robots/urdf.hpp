// Links and joints of a robot from URDF (http://wiki.ros.org/urdf/XML).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "protocols/status.hpp"
#include "server/simulation/robots/robot_model.hpp"

namespace parhelion::simulation {

/// Additional properties of a URDF's materials, from the YAML beside it.
using MaterialTable = std::map<std::string, Material>;

struct UrdfRobot {
  std::vector<RobotLink> links;        ///< parents before children
  std::vector<RobotJoint> joints;      ///< joints[i].child == i + 1
  std::vector<std::string> materials;  ///< names of those that it defines
  /// Parts that were left out, what collides in their place, and angle_warnings.
  std::vector<std::string> warnings;
  std::vector<std::string> angle_warnings;                    ///< joints turned by more than a whole turn
  std::vector<std::string> solid_left_out, visible_left_out;  ///< links whose <collision> or <visual> was
};

/// `origin` names the file in errors. From `materials` all but the albedo is used, which is the URDF's
/// colour. Errors, with line: not XML, an element or attribute that is missing, a number that is none, a mass
/// that is not positive, a physically impossible inertia, a link with two parents or with none, a kinematic
/// loop, an unsupported kind of joint, a shape without size, xacro, more than 1,000 links. A mesh must be
/// embedded (embed_meshes()); of one that is not, the part is left out with a warning.
Result<UrdfRobot> read_urdf(const std::string& urdf, const std::string& origin,
                            const MaterialTable& materials);

}  // namespace parhelion::simulation
