#include "tools/play/played_bus.hpp"

#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "protocols/instructor_command.hpp"
#include "protocols/scenario_robots.hpp"

namespace parhelion::tools {

Result<PlayedBus> PlayedBus::open(Bus& bus, const Scenario& scenario, const std::string& prefix) {
  constexpr std::size_t longest = 20;
  if (!prefix.empty()) {
    const std::string fault = channel_name_fault(prefix);
    if (!fault.empty() || prefix.size() > longest)
      return Error{"prefix '" + prefix + "': expected at most 20 letters, digits, '_', '-', '.', '/'"};
  }
  PlayedBus played(bus, prefix);
  std::vector<std::string> robots = robots_in_channels(scenario);
  if (robots.empty()) robots.emplace_back();
  const auto add = [&](const char* command) {
    for (const std::string& robot : robots) {
      const std::string name =
          is_robot_channel(command) ? robot_channel(command, robot) : std::string(command);
      played.commands_.insert(bus_name(scenario.channels, name));
    }
  };
  for (const char* command :
       {channel::kTeleop, channel::kJointCmd, channel::kMrCmd, channel::kMrJointCmd, channel::kOperators})
    add(command);
  for (const char* command : kInstructorChannels) add(command);
  return played;
}

bool PlayedBus::is_command(const std::string& channel) const {
  return commands_.count(channel) > 0 || (channel.starts_with("MR_AGENT_") &&
                                          (channel.ends_with("_TELEOP") || channel.ends_with("_JOINT_CMD")));
}

Status PlayedBus::publish(const Message& message) {
  if (prefix_.empty() && is_command(message.channel)) {
    ++suppressed_commands_;
    return {};
  }
  return bus_->publish(prefix_ + message.channel, message.payload);
}

}  // namespace parhelion::tools
