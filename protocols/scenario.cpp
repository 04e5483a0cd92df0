#include "protocols/scenario.hpp"

#include <arpa/inet.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <map>

#include "protocols/channel_map.hpp"
#include "protocols/nearest_name.hpp"
#include "protocols/scenario_robots.hpp"
#include "protocols/scenario_site.hpp"
#include "protocols/yaml/agent.hpp"
#include "protocols/yaml/faults.hpp"
#include "protocols/yaml/parts.hpp"
#include "protocols/yaml/ranges.hpp"
#include "protocols/yaml/schema.hpp"
#include "protocols/yaml/script.hpp"
#include "protocols/yaml/training.hpp"
#include "protocols/yaml/utf8.hpp"
#include "protocols/yaml/writer.hpp"

namespace parhelion {
namespace {

using yaml::Node;
using yaml::Quantity;

Trainee read_trainee(const Node& node, yaml::Problems& problems) {
  Trainee trainee;
  yaml::read(node, "name", trainee.name);
  yaml::read(node, "model", trainee.model);
  yaml::read(node, "pose", trainee.T_map_base, problems);
  yaml::read(node, "slam", trainee.slam);
  const Node* name = node.find("name");
  if (const std::string fault = robot_name_fault(trainee.name); !fault.empty())
    problems.add(name ? name->line : node.line, "'name' of the trainee's robot: " + fault);
  if (!(trainee.T_map_base.rotation()(2, 2) > 1 - 1e-9))
    problems.add(node.find("pose")->line, "'pose': a robot starts upright: expected roll = pitch = 0 rad");
  return trainee;
}

DoorSettings read_door(const Node& node) {
  DoorSettings door;
  yaml::read(node, "name", door.name);
  if (node.find("virtual")) yaml::read(node, "virtual", door.is_virtual.emplace());
  yaml::read(node, "friction", door.friction);
  yaml::read(node, "closer", door.closer);
  yaml::read(node, "break_impulse", door.break_impulse);
  if (node.find("angle")) yaml::read(node, "angle", door.angle.emplace());
  yaml::read(node, "locked", door.locked);
  return door;
}

void read_doors(const Node& list, std::vector<DoorSettings>& doors, yaml::Problems& problems) {
  std::map<std::string, int> first;
  for (const Node& node : list.items) {
    doors.push_back(read_door(node));
    const auto [known, inserted] = first.emplace(doors.back().name, node.line);
    if (!inserted) {
      problems.add(node.line, "door '" + yaml::printable(doors.back().name) + "' is a duplicate of line " +
                                  std::to_string(known->second));
    }
  }
}

void check_agent_names(const std::vector<AgentDefinition>& agents, const Node& list,
                       yaml::Problems& problems) {
  std::map<std::string_view, int> first;
  for (std::size_t i = 0; i < agents.size(); ++i) {
    const int line = list.items[i].find("name")->line;
    if (const std::string fault = agent_name_fault(agents[i].name); !fault.empty()) {
      problems.add(line, "'name' of an agent, part of channel names: " + fault);
    }
    const auto [known, inserted] = first.emplace(agents[i].name, line);
    if (!inserted) {
      problems.add(line, "name '" + yaml::printable(agents[i].name) + "' is taken by the agent in line " +
                             std::to_string(known->second) + ": names must be unique");
    }
  }
}

/// Line that renames the channel, in the scenario's 'channels' or in those of a robot; 0: none does.
int line_of_channel(const Node& document, const std::string& canonical) {
  const auto line = [](const Node* channels, std::string_view key) {
    const Node* entry = channels == nullptr ? nullptr : channels->find(key);
    return entry == nullptr ? 0 : entry->line;
  };
  if (const int found = line(document.find("channels"), canonical); found > 0) return found;
  const Node* robots = document.find("robots");
  const auto parts = parse_robot_channel(canonical);
  if (robots == nullptr || !parts) return 0;
  for (const Node& robot : robots->items) {
    if (robots->items.size() > 1 && robot.find("name")->text != parts->robot) continue;
    if (const int found = line(robot.find("channels"), parts->canonical); found > 0) return found;
  }
  return 0;
}

/// Adds channels of sensors after the first of their kind that the scenario renames: which there are, the
/// robots' descriptions say.
void add_further_sensors(const Scenario& scenario, std::vector<std::string>& inputs,
                         std::vector<std::string>& outputs) {
  for (const auto& [canonical, renamed] : scenario.channels) {
    const std::string of_first = without_sensor(canonical);
    if (of_first == canonical) continue;
    const bool input = std::find(inputs.begin(), inputs.end(), of_first) != inputs.end();
    (input ? inputs : outputs).push_back(canonical);
  }
}

void read_channels(const Node& document, Scenario& scenario, yaml::Problems& problems) {
  std::vector<std::string> agents;
  for (const AgentDefinition& agent : scenario.agents) agents.push_back(agent.name);
  const std::vector<std::string> robots = robots_in_channels(scenario);
  auto inputs = input_channels(agents, robots);
  auto outputs = output_channels(agents, robots);
  std::vector<std::string> known = inputs;
  known.insert(known.end(), outputs.begin(), outputs.end());
  const Node* node = document.find("channels");
  for (std::size_t i = 0; node != nullptr && i < node->keys.size(); ++i) {
    const std::string& canonical = node->keys[i];
    if (std::find(known.begin(), known.end(), without_sensor(canonical)) == known.end()) {
      problems.add(node->key_lines[i],
                   "unknown channel '" + yaml::printable(canonical) + "'" + suggestion(canonical, known));
    }
    if (const std::string fault = channel_name_fault(node->items[i].text); !fault.empty()) {
      problems.add(node->items[i].line, "name of a channel: " + fault);
    }
    scenario.channels[canonical] = node->items[i].text;
  }
  if (!problems.empty()) return;
  add_further_sensors(scenario, inputs, outputs);
  for (const ChannelMeeting& meeting : find_meetings(scenario.channels, inputs, outputs)) {
    const auto line_of = [&](const std::string& canonical) { return line_of_channel(document, canonical); };
    problems.add(std::max(line_of(meeting.channel), line_of(meeting.other)), meeting.text);
  }
}

void read_contact(const Node& node, ContactLimits& contact, yaml::Problems& problems) {
  yaml::read(node, "slow_distance", contact.slow_distance);
  yaml::read(node, "stop_distance", contact.stop_distance);
  yaml::read(node, "crawl_speed", contact.crawl_speed);
  yaml::read(node, "silence", contact.silence);
  if (!(contact.stop_distance < contact.slow_distance)) {
    problems.add(node.line, "'contact': expected stop_distance < slow_distance, found " +
                                yaml::format_quantity(contact.stop_distance, Quantity::length) + " and " +
                                yaml::format_quantity(contact.slow_distance, Quantity::length));
  }
}

/// At level 3 the trainee's robot is real: its radio range and its battery cannot be configured.
void check_supply(const Scenario& scenario, const Node& node, const char* key, yaml::Problems& problems) {
  if (scenario.level < 3) return;
  const auto simulated = [](const AgentDefinition& agent) { return !agent.model.empty(); };
  bool any = std::any_of(scenario.agents.begin(), scenario.agents.end(), simulated);
  for (const Script& script : scenario.scripts) {
    for (const AgentCommand& action : script.actions) {
      const auto* spawn = std::get_if<AgentSpawn>(&action);
      any = any || (spawn != nullptr && simulated(spawn->agent));
    }
  }
  if (any) return;
  problems.add(node.line,
               std::string("'") + key +
                   "' is of simulated robots, and this scenario of level 3 has none: the real robot has "
                   "its own; remove it, or give an agent a 'model'");
}

/// Reported at the line of the first agent whose picture rate exceeds the limit.
void check_agent_pictures(const Scenario& scenario, const Node& list, yaml::Problems& problems) {
  double asked = 0;
  std::optional<int> line;
  for (std::size_t i = 0; i < scenario.agents.size(); ++i) {
    asked += scenario.agents[i].camera_rate;
    if (asked > scenario.max_agent_image_rate && !line) line = list.items[i].find("camera")->line;
  }
  if (!line) return;
  problems.add(*line, "'camera': the agents' cameras take " + yaml::format_quantity(asked, Quantity::rate) +
                          " together, more than max_agent_image_rate, " +
                          yaml::format_quantity(scenario.max_agent_image_rate, Quantity::rate) +
                          "; lower some rates, or raise the limit if the machine can render as many");
}

std::vector<std::string> read_hosts(const Node& list, yaml::Problems& problems) {
  std::vector<std::string> hosts;
  for (const Node& each : list.items) {
    in_addr address{};
    if (inet_pton(AF_INET, each.text.c_str(), &address) != 1)
      problems.add(each.line, "'hosts': expected an IPv4 address, as 192.168.1.20, not '" +
                                  yaml::printable(each.text) + "'");
    hosts.push_back(each.text);
  }
  return hosts;
}

void read_shown(const Node& list, Scenario& scenario, yaml::Problems& problems) {
  std::vector<std::string> known = agent_names(scenario);
  for (const Zone& zone : scenario.zones) known.push_back(zone.name);
  for (const Node& each : list.items) {
    if (std::find(known.begin(), known.end(), each.text) == known.end())
      problems.add(each.line, "'shown': no agent or zone '" + yaml::printable(each.text) + "'" +
                                  suggestion(each.text, known));
    scenario.shown.push_back(each.text);
  }
}

Scenario read_scenario(Node& node, yaml::Problems& problems) {
  Scenario scenario;
  yaml::read(node, "name", scenario.name);
  yaml::read(node, "level", scenario.level);
  yaml::read(node, "seed", scenario.seed);
  yaml::read(node, "physics_rate", scenario.physics_rate);
  yaml::read(node, "model", scenario.model);
  yaml::read(node, "map", scenario.map);
  if (const Node* matching = node.find("scan_matching")) scenario.scan_matching = matching->text != "off";
  yaml::read(node, "robot", scenario.robot);
  if (const Node* mode = node.find("authentication")) scenario.authentication = mode->text == "sign";
  if (const Node* hosts = node.find("hosts")) scenario.hosts = read_hosts(*hosts, problems);
  yaml::read(node, "mapping", scenario.mapping);
  yaml::read(node, "max_agents", scenario.max_agents);
  yaml::read(node, "max_agent_image_rate", scenario.max_agent_image_rate);
  if (const Node* injection = node.find("injection")) {
    yaml::read(*injection, "max_error", scenario.injection.max_error);
    yaml::read(*injection, "restore", scenario.injection.restore);
  }
  if (const Node* contact = node.find("contact")) read_contact(*contact, scenario.contact, problems);
  if (const Node* pose = node.find("pose")) {
    PoseInput& input = scenario.pose.emplace();
    yaml::read(*pose, "position_sigma", input.position_sigma);
    yaml::read(*pose, "yaw_sigma", input.yaw_sigma);
    yaml::read(*pose, "map_id", input.map_id);
  }
  if (const Node* agents = node.find("agents")) {
    for (const Node& agent : agents->items) scenario.agents.push_back(yaml::read_agent(agent, problems));
    check_agent_names(scenario.agents, *agents, problems);
    check_agent_pictures(scenario, *agents, problems);
  }
  if (const Node* zones = node.find("zones")) scenario.zones = read_zones(*zones, problems);
  if (const Node* trainee = node.find("trainee")) {
    scenario.trainee = read_trainee(*trainee, problems);
    for (const AgentDefinition& agent : scenario.agents) {
      if (agent.name == scenario.trainee->name)
        problems.add(trainee->line, "'trainee': an agent has the same name '" + agent.name + "'");
    }
  }
  if (const Node* scripts = node.find("scripts"))
    scenario.scripts = yaml::read_scripts(*scripts, scenario.agents, problems);
  if (const Node* shown = node.find("shown")) read_shown(*shown, scenario, problems);
  if (const Node* doors = node.find("doors")) read_doors(*doors, scenario.doors, problems);
  if (const Node* hazards = node.find("hazards")) scenario.hazards = read_hazards(*hazards, problems);
  if (const Node* sensor = node.find("hazard_sensor"))
    scenario.hazard_sensor = read_hazard_sensor(*sensor, problems);
  if (const Node* limits = node.find("dose_limits"))
    scenario.dose_limits = read_dose_limits(*limits, problems);
  if (const Node* radio = node.find("radio")) {
    scenario.radio = read_radio(*radio, problems);
    check_supply(scenario, *radio, "radio", problems);
  }
  if (const Node* battery = node.find("battery")) {
    scenario.battery = read_battery(*battery, problems);
    check_supply(scenario, *battery, "battery", problems);
  }
  if (const Node* faults = node.find("faults"))
    scenario.faults = yaml::read_faults(*faults, scenario.level, problems);
  if (const Node* drawn = node.find("drawn")) scenario.drawn_values = yaml::read_drawn(*drawn);
  if (Node* training = node.find("training")) scenario.training = yaml::read_training(*training, problems);
  if (node.find("robots")) read_robots(node, scenario, problems);
  if (node.find("channels") || node.find("robots")) read_channels(node, scenario, problems);
  return scenario;
}

void write_door(yaml::Writer& writer, const DoorSettings& door) {
  writer.begin_item();
  writer.text("name", door.name);
  if (door.is_virtual) writer.word("virtual", *door.is_virtual ? "true" : "false");
  writer.quantity("friction", door.friction, Quantity::torque);
  writer.quantity("closer", door.closer, Quantity::torque);
  writer.quantity("break_impulse", door.break_impulse, Quantity::impulse);
  if (door.angle) writer.quantity("angle", *door.angle, Quantity::angle);
  if (door.locked) writer.word("locked", "true");
  writer.end_item();
}

/// A value of another type is rejected by the schema.
std::uint64_t written_seed(const Node& document) {
  std::uint64_t seed = Scenario{}.seed;
  if (const Node* node = document.kind == Node::Kind::map ? document.find("seed") : nullptr)
    std::from_chars(node->text.data(), node->text.data() + node->text.size(), seed);
  return seed;
}

void resolve(std::string& path, const std::filesystem::path& folder) {
  if (!path.empty()) path = (folder / path).lexically_normal().string();
}

}  // namespace

std::vector<std::string> agent_names(const Scenario& scenario) {
  std::vector<std::string> names;
  for (const AgentDefinition& agent : scenario.agents) names.push_back(agent.name);
  for (const Script& script : scenario.scripts) {
    for (const AgentCommand& action : script.actions) {
      if (const auto* spawn = std::get_if<AgentSpawn>(&action)) names.push_back(spawn->agent.name);
    }
  }
  return names;
}

Result<Scenario> parse_scenario(const std::string& yaml, const std::string& origin,
                                std::optional<std::uint64_t> seed) {
  auto document = yaml::read_document_for(yaml, origin, "scenario");
  if (!document) return document.error();
  yaml::Problems problems(origin);
  const std::vector<DrawnValue> drawn =
      yaml::draw_ranges(*document, seed.value_or(written_seed(*document)), problems);
  yaml::check(*document, "scenario", problems);
  if (!problems.empty()) return problems.error();
  Scenario scenario = read_scenario(*document, problems);
  if (!problems.empty()) return problems.error();
  if (seed) scenario.seed = *seed;
  scenario.drawn_values.insert(scenario.drawn_values.end(), drawn.begin(), drawn.end());
  return scenario;
}

Result<Scenario> load_scenario(const std::string& path, std::optional<std::uint64_t> seed) {
  const auto text = yaml::read_text(path);
  if (!text) return text.error();
  auto scenario = parse_scenario(*text, path, seed);
  if (!scenario) return scenario;
  const auto folder = std::filesystem::path(path).parent_path();
  resolve(scenario->model, folder);
  resolve(scenario->map, folder);
  resolve(scenario->robot, folder);
  for (ScenarioRobot& robot : scenario->robots) resolve(robot.description, folder);
  // Models without a file extension are installed ones, by name.
  for (AgentDefinition& agent : scenario->agents) {
    if (agent.model.ends_with(".yaml")) resolve(agent.model, folder);
  }
  if (scenario->trainee && scenario->trainee->model.ends_with(".yaml"))
    resolve(scenario->trainee->model, folder);
  return scenario;
}

std::string to_yaml(const Scenario& scenario) {
  yaml::Writer writer;
  writer.text("name", scenario.name);
  writer.integer("level", scenario.level);
  writer.integer("seed", scenario.seed);
  writer.quantity("physics_rate", scenario.physics_rate, Quantity::rate);
  if (!scenario.model.empty()) writer.text("model", scenario.model);
  if (!scenario.map.empty()) writer.text("map", scenario.map);
  if (!scenario.scan_matching) writer.text("scan_matching", "off");
  if (!scenario.robot.empty()) writer.text("robot", scenario.robot);
  write_robots(scenario.robots, writer);
  if (scenario.authentication) writer.word("authentication", "sign");
  writer.texts("hosts", scenario.hosts);
  if (scenario.mapping) writer.word("mapping", "true");
  writer.integer("max_agents", scenario.max_agents);
  writer.quantity("max_agent_image_rate", scenario.max_agent_image_rate, Quantity::rate);
  writer.open("injection");
  writer.quantity("max_error", scenario.injection.max_error, Quantity::length);
  writer.number("restore", scenario.injection.restore);
  writer.close();
  writer.open("contact");
  writer.quantity("slow_distance", scenario.contact.slow_distance, Quantity::length);
  writer.quantity("stop_distance", scenario.contact.stop_distance, Quantity::length);
  writer.quantity("crawl_speed", scenario.contact.crawl_speed, Quantity::speed);
  writer.quantity("silence", scenario.contact.silence, Quantity::time);
  writer.close();
  if (scenario.pose) {
    writer.open("pose");
    writer.quantity("position_sigma", scenario.pose->position_sigma, Quantity::length);
    writer.quantity("yaw_sigma", scenario.pose->yaw_sigma, Quantity::angle);
    if (!scenario.pose->map_id.empty()) writer.text("map_id", scenario.pose->map_id);
    writer.close();
  }
  if (scenario.trainee) {
    writer.open("trainee");
    writer.text("name", scenario.trainee->name);
    writer.text("model", scenario.trainee->model);
    writer.line("pose", yaml::format_isometry(scenario.trainee->T_map_base.isometry()));
    writer.flag("slam", scenario.trainee->slam);
    writer.close();
  }
  if (!scenario.agents.empty()) {
    writer.open("agents");
    for (const AgentDefinition& agent : scenario.agents) {
      writer.begin_item();
      yaml::write_agent(writer, agent);
      writer.end_item();
    }
    writer.close();
  }
  writer.texts("shown", scenario.shown);
  write_zones(scenario.zones, writer);
  yaml::write_scripts(writer, scenario.scripts);
  if (!scenario.doors.empty()) {
    writer.open("doors");
    for (const DoorSettings& door : scenario.doors) write_door(writer, door);
    writer.close();
  }
  write_hazards(scenario.hazards, writer);
  if (!(scenario.hazard_sensor == HazardSensor())) write(scenario.hazard_sensor, writer);
  if (!(scenario.dose_limits == DoseLimits())) write(scenario.dose_limits, writer);
  if (scenario.radio) write(*scenario.radio, writer);
  if (scenario.battery) write(*scenario.battery, writer);
  yaml::write_faults(writer, scenario.faults);
  if (scenario.training) yaml::write_training(writer, *scenario.training);
  yaml::write_drawn(writer, scenario.drawn_values);
  if (!scenario.channels.empty()) {
    writer.open("channels");
    for (const auto& [canonical, name] : scenario.channels) writer.line(canonical, yaml::Writer::quote(name));
    writer.close();
  }
  return writer.take();
}

}  // namespace parhelion
