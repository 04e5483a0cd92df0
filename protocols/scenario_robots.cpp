#include "protocols/scenario_robots.hpp"

#include <algorithm>
#include <map>

#include "protocols/channel_map.hpp"
#include "protocols/nearest_name.hpp"
#include "protocols/yaml/parts.hpp"
#include "protocols/yaml/utf8.hpp"

namespace parhelion {
namespace {

void check_names(const yaml::Node& list, const Scenario& scenario, yaml::Problems& problems) {
  std::map<std::string_view, int> first;
  for (std::size_t i = 0; i < scenario.robots.size(); ++i) {
    const std::string& name = scenario.robots[i].name;
    const int line = list.items[i].find("name")->line;
    if (const std::string fault = robot_name_fault(name); !fault.empty())
      problems.add(line, "'name' of a robot, part of channel names: " + fault);
    const auto [known, inserted] = first.emplace(name, line);
    if (!inserted) {
      problems.add(line, "name '" + yaml::printable(name) + "' is taken by the robot in line " +
                             std::to_string(known->second) + ": names must be unique");
    }
    if (std::any_of(scenario.agents.begin(), scenario.agents.end(),
                    [&](const AgentDefinition& agent) { return agent.name == name; }))
      problems.add(line, "name '" + yaml::printable(name) + "' is taken by an agent: names must be unique");
  }
}

std::vector<std::string> bare_robot_channels() {
  std::vector<std::string> names;
  for (const auto& all : {input_channels({}), output_channels({})})
    std::copy_if(all.begin(), all.end(), std::back_inserter(names), is_robot_channel);
  return names;
}

/// `channels` of one robot: bare canonical names.
void read_own_channels(const yaml::Node& node, const std::string& robot, Scenario& scenario,
                       yaml::Problems& problems) {
  const std::vector<std::string> known = bare_robot_channels();
  for (std::size_t i = 0; i < node.keys.size(); ++i) {
    const std::string& canonical = node.keys[i];
    if (std::find(known.begin(), known.end(), without_sensor(canonical)) == known.end()) {
      problems.add(node.key_lines[i], "'" + yaml::printable(canonical) + "' is no channel of a robot" +
                                          suggestion(canonical, known));
    }
    if (const std::string fault = channel_name_fault(node.items[i].text); !fault.empty())
      problems.add(node.items[i].line, "name of a channel: " + fault);
    scenario.channels[robot_channel(canonical, robot)] = node.items[i].text;
  }
}

}  // namespace

void read_robots(const yaml::Node& node, Scenario& scenario, yaml::Problems& problems) {
  const yaml::Node& list = *node.find("robots");
  if (const yaml::Node* one = node.find("robot"))
    problems.add(one->line, "'robot' is for a session of one robot: make it one of the 'robots'");
  for (const yaml::Node& item : list.items) {
    ScenarioRobot& robot = scenario.robots.emplace_back();
    yaml::read(item, "name", robot.name);
    yaml::read(item, "description", robot.description);
  }
  check_names(list, scenario, problems);
  const std::vector<std::string> named = robots_in_channels(scenario);
  for (std::size_t i = 0; i < list.items.size(); ++i) {
    if (const yaml::Node* channels = list.items[i].find("channels"))
      read_own_channels(*channels, named.empty() ? std::string() : named[i], scenario, problems);
  }
}

void write_robots(const std::vector<ScenarioRobot>& robots, yaml::Writer& writer) {
  if (robots.empty()) return;
  writer.open("robots");
  for (const ScenarioRobot& robot : robots) {
    writer.begin_item();
    writer.text("name", robot.name);
    if (!robot.description.empty()) writer.text("description", robot.description);
    writer.end_item();
  }
  writer.close();
}

std::vector<std::string> robots_in_channels(const Scenario& scenario) {
  std::vector<std::string> names;
  if (scenario.robots.size() < 2) return names;
  for (const ScenarioRobot& robot : scenario.robots) names.push_back(robot.name);
  return names;
}

}  // namespace parhelion
