// Which channels are inputs and outputs of the server, and what a scenario may make of their names.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace parhelion {

/// Canonical names of the server's inputs; `agents`: names of the agents, whose TELEOP channels are inputs
/// too.
std::vector<std::string> input_channels(const std::vector<std::string>& agents);
/// Canonical names of the server's outputs; agents' own scans included.
std::vector<std::string> output_channels(const std::vector<std::string>& agents);
/// MR_AGENT_<name>_CAMERA: what the camera of a virtual robot sees.
std::string agent_camera_channel(std::string_view agent);

/// Between a canonical name and a robot's: no canonical name and no robot's name contains it.
inline constexpr char kRobotSeparator = '.';
/// The canonical name of a channel of one of several robots: "SCAN.rover_2". `robot` empty: there is one
/// robot, and the channel has its bare name (docs/decisions/robot-channels.md).
std::string robot_channel(std::string_view canonical, std::string_view robot);
/// Views into the name that was parsed; `robot` empty: a bare name.
struct RobotChannel {
  std::string_view canonical, robot;
};
/// The inverse. nullopt: there is nothing before the separator, or no robot's name after it.
std::optional<RobotChannel> parse_robot_channel(std::string_view name);

/// Canonical names of what a robot says of itself, its pose the last of them: at levels 1 and 2 outputs of
/// the simulated robot (its pose only where the scenario wants no SLAM).
const std::vector<std::string>& sensor_channels();

/// The name on the bus of a canonical name.
std::string bus_name(const std::map<std::string, std::string>& channels, const std::string& canonical);

/// What is wrong with a name on the bus (1 to 63 letters, digits, '_', '-', '.', '/'), or empty.
std::string channel_name_fault(std::string_view name);
inline constexpr std::size_t kMaxRobotName = 32;  ///< bytes of an agent's or a robot's name
/// What is wrong with an agent's name (1 to 32 letters, digits, '_', '-'), or empty.
std::string agent_name_fault(std::string_view name);
/// What is wrong with a robot's name, which may stand behind a separator; as an agent's, or empty.
std::string robot_name_fault(std::string_view name);

}  // namespace parhelion
