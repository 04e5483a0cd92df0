// Names of ROS 2 as ROS 1 has them.
#pragma once

#include <string>

namespace parhelion::tools {

/// "sensor_msgs/msg/LaserScan" as "sensor_msgs/LaserScan". Where a message is not serialized as CDR that is
/// added, so that it is no type that is imported.
inline std::string ros2_type(std::string type, const std::string& serialization) {
  if (const auto at = type.find("/msg/"); at != std::string::npos) type.erase(at, 4);
  if (serialization != "cdr") type += ", serialized as '" + serialization.substr(0, 40) + "'";
  return type;
}

}  // namespace parhelion::tools
