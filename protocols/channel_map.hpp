// Input and output channels of the server, and their remapping by a scenario.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace parhelion {

/// Canonical names of the server's inputs, including the agents' TELEOP channels. `agents`: names of the
/// agents; `robots`: names of the robots, if there are several.
std::vector<std::string> input_channels(const std::vector<std::string>& agents,
                                        const std::vector<std::string>& robots = {});
/// Canonical names of the server's outputs; agents' own scans included.
std::vector<std::string> output_channels(const std::vector<std::string>& agents,
                                         const std::vector<std::string>& robots = {});
/// Canonical (bare) names of the channels of which each robot has its own; the others are the session's.
std::span<const char* const> robot_channels();
/// Also true for channels of a sensor after the first of its kind.
bool is_robot_channel(std::string_view canonical);

/// Canonical (bare) names of the channels of which each planar laser has its own.
std::span<const char* const> laser_channels();
/// Those of which each pair of cameras has its own.
std::span<const char* const> camera_channels();
/// The canonical name of a channel of a sensor after the first of its kind: "SCAN_rear". `sensor` empty: the
/// first, whose channels have no name behind them.
std::string sensor_channel(std::string_view canonical, std::string_view sensor);
/// Views into the name that was parsed; `sensor` empty: of no sensor after the first.
struct SensorChannel {
  std::string_view canonical, sensor;
};
/// The inverse, of a name without a robot's.
SensorChannel parse_sensor_channel(std::string_view name);
/// The channel of the first sensor of the kind, whether or not `name` carries a robot's name; a channel that
/// is of no later sensor stays as it is.
std::string without_sensor(std::string_view name);
/// Regular expression of all channels of sensors after the first whose first has `canonical`, of any robot;
/// empty: there is one sensor of that kind.
std::string sensor_channel_pattern(std::string_view canonical);
/// MR_AGENT_<name>_CAMERA: images of a virtual robot's camera.
std::string agent_camera_channel(std::string_view agent);

/// Separates a canonical name from a robot's name; neither may contain it.
inline constexpr char kRobotSeparator = '.';
/// The canonical name of a channel of one of several robots: "SCAN.rover_2". `robot` empty: there is one
/// robot, and the channel has its bare name (docs/decisions/robot-channels.md).
std::string robot_channel(std::string_view canonical, std::string_view robot);
/// Views into the name that was parsed; `robot` empty: a bare name.
struct RobotChannel {
  std::string_view canonical, robot;
};
/// The inverse. nullopt: nothing before the separator, or no valid robot name after it.
std::optional<RobotChannel> parse_robot_channel(std::string_view name);

/// Canonical names of the channels on which a robot reports its own state, its pose last: at levels 1 and 2
/// outputs of the simulated robot (its pose only where the scenario does not use SLAM).
const std::vector<std::string>& sensor_channels();

/// The name on the bus of a canonical name.
std::string bus_name(const std::map<std::string, std::string>& channels, const std::string& canonical);

/// Two canonical channels that would have one name on the bus.
struct ChannelMeeting {
  std::string channel, other;
  std::string text;  ///< says so, and what to do
};
/// An output that is an input would feed the server its own messages. `channels`: as in bus_name().
std::vector<ChannelMeeting> find_meetings(const std::map<std::string, std::string>& channels,
                                          const std::vector<std::string>& inputs,
                                          const std::vector<std::string>& outputs);

/// Why a name on the bus is invalid (1 to 63 letters, digits, '_', '-', '.', '/'), or empty.
std::string channel_name_fault(std::string_view name);
inline constexpr std::size_t kMaxRobotName = 32;  ///< bytes of an agent's or a robot's name
/// Why an agent's name is invalid (1 to 32 letters, digits, '_', '-'), or empty.
std::string agent_name_fault(std::string_view name);
/// Why a robot's name, which may follow a separator, is invalid (rules as for an agent), or empty.
std::string robot_name_fault(std::string_view name);
/// Why the name of a sensor after the first of its kind is invalid (1 to 16 letters, digits, '_'; not INFO,
/// INFO_... or RATE, which MR_SCAN_INFO and MR_CAMERA_RATE have taken), or empty.
std::string sensor_name_fault(std::string_view name);

}  // namespace parhelion
