#include "protocols/channel_map.hpp"

#include <algorithm>
#include <cctype>

#include "protocols/channels.hpp"
#include "protocols/instructor_command.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion {
namespace {

constexpr char kSensorSeparator = '_';
constexpr std::size_t kMaxSensorName = 16;  // so that MR_SCAN_INFO_<name>.<robot> fits a channel's name

std::string name_fault(std::string_view name, std::size_t longest, std::string_view others) {
  const bool good = std::all_of(name.begin(), name.end(), [&](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || others.find(c) != std::string_view::npos;
  });
  if (good && !name.empty() && name.size() <= longest) return {};
  std::string allowed = "letters, digits";
  for (const char c : others) allowed += std::string(c == others.back() ? " and '" : ", '") + c + "'";
  return "expected 1 to " + std::to_string(longest) + " " + allowed + ", found '" + yaml::printable(name) +
         "'";
}

/// The names with those that each robot has replaced by one for each robot.
std::vector<std::string> of_each_robot(const std::vector<std::string>& names,
                                       const std::vector<std::string>& robots) {
  if (robots.empty()) return names;
  std::vector<std::string> all;
  for (const std::string& name : names) {
    if (!is_robot_channel(name)) {
      all.push_back(name);
      continue;
    }
    for (const std::string& robot : robots) all.push_back(robot_channel(name, robot));
  }
  return all;
}

}  // namespace

std::span<const char* const> robot_channels() {
  static constexpr const char* names[] = {
      channel::kRobot,      channel::kScan,          channel::kLines,   channel::kOdometry,
      channel::kPoseCov,    channel::kPose,          channel::kCamera,  channel::kReferencePose,
      channel::kDepth,      channel::kImu,           channel::kTeleop,  channel::kJointCmd,
      channel::kJointState, channel::kBumper,        channel::kHazard,  channel::kMrScan,
      channel::kMrCamera,   channel::kMrScanInfo,    channel::kMrDepth, channel::kMrCmd,
      channel::kMrJointCmd, channel::kMrObjectReport};
  return names;
}

bool is_robot_channel(std::string_view canonical) {
  const auto names = robot_channels();
  return std::find(names.begin(), names.end(), parse_sensor_channel(canonical).canonical) != names.end();
}

std::span<const char* const> laser_channels() {
  static constexpr const char* names[] = {channel::kScan, channel::kMrScan, channel::kMrScanInfo};
  return names;
}

std::span<const char* const> camera_channels() {
  static constexpr const char* names[] = {channel::kCamera, channel::kDepth, channel::kMrCamera,
                                          channel::kMrDepth};
  return names;
}

std::string sensor_channel(std::string_view canonical, std::string_view sensor) {
  std::string name(canonical);
  if (!sensor.empty()) name.append(1, kSensorSeparator).append(sensor);
  return name;
}

SensorChannel parse_sensor_channel(std::string_view name) {
  for (const auto names : {laser_channels(), camera_channels()}) {
    for (const std::string_view canonical : names) {
      if (!name.starts_with(canonical) || name.size() <= canonical.size() + 1 ||
          name[canonical.size()] != kSensorSeparator)
        continue;
      const std::string_view sensor = name.substr(canonical.size() + 1);
      if (sensor_name_fault(sensor).empty()) return {canonical, sensor};
    }
  }
  return {name, {}};
}

std::string without_sensor(std::string_view name) {
  const auto parts = parse_robot_channel(name);
  if (!parts) return std::string(name);
  return robot_channel(parse_sensor_channel(parts->canonical).canonical, parts->robot);
}

std::string sensor_channel_pattern(std::string_view canonical) {
  for (const auto names : {laser_channels(), camera_channels()}) {
    if (std::find(names.begin(), names.end(), canonical) != names.end())
      return std::string(canonical) + kSensorSeparator + "[A-Za-z0-9_]+(\\..+)?";
  }
  return {};
}

std::vector<std::string> input_channels(const std::vector<std::string>& agents,
                                        const std::vector<std::string>& robots) {
  std::vector<std::string> names{
      channel::kRobot,  channel::kScan,          channel::kLines,    channel::kOdometry, channel::kPoseCov,
      channel::kPose,   channel::kReferencePose, channel::kCamera,   channel::kDepth,    channel::kImu,
      channel::kTeleop, channel::kJointState,    channel::kJointCmd, channel::kOperators};
  names.insert(names.end(), kInstructorChannels.begin(), kInstructorChannels.end());
  names = of_each_robot(names, robots);
  for (const std::string& agent : agents) {
    names.push_back("MR_AGENT_" + agent + "_TELEOP");
    names.push_back("MR_AGENT_" + agent + "_JOINT_CMD");
  }
  return names;
}

std::vector<std::string> output_channels(const std::vector<std::string>& agents,
                                         const std::vector<std::string>& robots) {
  std::vector<std::string> names{
      channel::kLoop,       channel::kMrScan,  channel::kMrScanInfo, channel::kMrCamera, channel::kMrDepth,
      channel::kMrSession,  channel::kMrWorld, channel::kMrEvents,   channel::kMrStatus, channel::kMrCmd,
      channel::kMrJointCmd, channel::kMrModel, channel::kBumper,     channel::kHazard};
  names = of_each_robot(names, robots);
  for (const std::string& agent : agents) {
    names.push_back("MR_AGENT_" + agent + "_SCAN");
    names.push_back(agent_camera_channel(agent));
  }
  return names;
}

std::string agent_camera_channel(std::string_view agent) {
  return "MR_AGENT_" + std::string(agent) + "_CAMERA";
}

const std::vector<std::string>& sensor_channels() {
  static const std::vector<std::string> names{channel::kRobot,      channel::kScan,   channel::kOdometry,
                                              channel::kImu,        channel::kCamera, channel::kDepth,
                                              channel::kJointState, channel::kBumper, channel::kPoseCov};
  return names;
}

std::string bus_name(const std::map<std::string, std::string>& channels, const std::string& canonical) {
  const auto found = channels.find(canonical);
  return found == channels.end() ? canonical : found->second;
}

std::string robot_channel(std::string_view canonical, std::string_view robot) {
  std::string name(canonical);
  if (!robot.empty()) name.append(1, kRobotSeparator).append(robot);
  return name;
}

std::optional<RobotChannel> parse_robot_channel(std::string_view name) {
  const std::size_t dot = name.find(kRobotSeparator);
  if (dot == 0 || name.empty()) return std::nullopt;
  if (dot == std::string_view::npos) return RobotChannel{name, {}};
  const RobotChannel parts{name.substr(0, dot), name.substr(dot + 1)};
  if (!robot_name_fault(parts.robot).empty()) return std::nullopt;
  return parts;
}

std::vector<ChannelMeeting> find_meetings(const std::map<std::string, std::string>& channels,
                                          const std::vector<std::string>& inputs,
                                          const std::vector<std::string>& outputs) {
  std::vector<ChannelMeeting> meetings;
  std::map<std::string, std::string> taken;  // name on the bus -> canonical
  for (const auto* side : {&inputs, &outputs}) {
    for (const std::string& canonical : *side) {
      const std::string name = bus_name(channels, canonical);
      const auto [other, inserted] = taken.emplace(name, canonical);
      if (inserted) continue;
      const bool other_is_input = std::find(inputs.begin(), inputs.end(), other->second) != inputs.end();
      const std::string what = side == &outputs && other_is_input
                                   ? "the output " + canonical + " and the input " + other->second
                                   : canonical + " and " + other->second;
      meetings.push_back({canonical, other->second,
                          "'channels': " + what + " would both be named '" + name +
                              "' on the bus: give one of them another name"});
    }
  }
  return meetings;
}

std::string channel_name_fault(std::string_view name) { return name_fault(name, 63, "_-./"); }
std::string agent_name_fault(std::string_view name) { return name_fault(name, kMaxRobotName, "_-"); }
std::string robot_name_fault(std::string_view name) { return agent_name_fault(name); }

std::string sensor_name_fault(std::string_view name) {
  if (name == "INFO" || name.starts_with("INFO_") || name == "RATE")
    return "'" + std::string(name) +
           "' would give names that MR_SCAN_INFO or MR_CAMERA_RATE has; choose another";
  return name_fault(name, kMaxSensorName, "_");
}

}  // namespace parhelion
