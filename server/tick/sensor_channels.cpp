#include "server/tick/sensor_channels.hpp"

#include <algorithm>

#include "protocols/channel_map.hpp"
#include "protocols/channels.hpp"
#include "protocols/nearest_name.hpp"
#include "protocols/scenario_robots.hpp"

namespace parhelion::tick {
namespace {

/// Canonical names of the further sensors' channels.
struct OwnChannels {
  std::vector<std::string> inputs, outputs;

  void add(const Scenario& scenario, std::span<const char* const> channels,
           const std::vector<std::string>& names, std::string_view robot) {
    for (const std::string& name : names) {
      for (const std::string_view canonical : channels) {
        const bool input = !canonical.starts_with("MR_") && !simulates_trainee(scenario);
        (input ? inputs : outputs).push_back(robot_channel(sensor_channel(canonical, name), robot));
      }
    }
  }
};

OwnChannels own_channels_of(const Scenario& scenario, const SensorNames& sensors) {
  const std::vector<std::string> robots = robots_in_channels(scenario);
  OwnChannels all;
  for (std::size_t i = 0; i < sensors.size(); ++i) {
    const std::string_view robot = robots.empty() ? std::string_view() : robots[i];
    all.add(scenario, laser_channels(), sensors[i].lasers, robot);
    all.add(scenario, camera_channels(), sensors[i].cameras, robot);
  }
  return all;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

Status check_sensor_channels(const Scenario& scenario, const SensorNames& sensors) {
  const OwnChannels own = own_channels_of(scenario, sensors);
  const std::string who = "scenario '" + scenario.name + "': ";
  std::vector<std::string> known = own.inputs;
  known.insert(known.end(), own.outputs.begin(), own.outputs.end());
  for (const auto& [canonical, renamed] : scenario.channels) {
    if (without_sensor(canonical) == canonical || contains(known, canonical)) continue;
    return Error{who + "'channels' renames " + canonical +
                 ", but no robot's 'lasers' or 'cameras' has that name" +
                 suggestion_or_known(canonical, known)};
  }
  if (known.empty()) return {};
  std::vector<std::string> agents;
  for (const AgentDefinition& agent : scenario.agents) agents.push_back(agent.name);
  const std::vector<std::string> robots = robots_in_channels(scenario);
  auto inputs = input_channels(agents, robots);
  auto outputs = output_channels(agents, robots);
  inputs.insert(inputs.end(), own.inputs.begin(), own.inputs.end());
  outputs.insert(outputs.end(), own.outputs.begin(), own.outputs.end());
  const auto meetings = find_meetings(scenario.channels, inputs, outputs);
  if (meetings.empty()) return {};
  return Error{who + meetings.front().text};
}

}  // namespace parhelion::tick
