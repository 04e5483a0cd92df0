#include "protocols/yaml/agent.hpp"

#include <array>

#include "protocols/yaml/parts.hpp"

namespace parhelion::yaml {
namespace {

constexpr std::size_t kKinds = static_cast<std::size_t>(kLastAgentKind) + 1;
const std::array<const char*, kKinds> kKindNames = [] {
  std::array<const char*, kKinds> names{};
  for (std::size_t i = 0; i < kKinds; ++i) names[i] = to_string(static_cast<AgentKind>(i));
  return names;
}();
constexpr std::size_t kBehaviours = static_cast<std::size_t>(kLastBehaviourKind) + 1;
const std::array<const char*, kBehaviours> kBehaviourNames = [] {
  std::array<const char*, kBehaviours> names{};
  for (std::size_t i = 0; i < kBehaviours; ++i) names[i] = to_string(static_cast<BehaviourKind>(i));
  return names;
}();

}  // namespace

void read_behaviour(const Node& node, Behaviour& behaviour, Problems& problems) {
  read(node, "kind", kBehaviourNames, behaviour.kind);
  read(node, "speed", behaviour.speed);
  if (const Node* waypoints = node.find("waypoints")) {
    for (const Node& point : waypoints->items) behaviour.waypoints.push_back(vector2(point));
  }
  read(node, "target", behaviour.target);
  read(node, "distance", behaviour.distance);
  read(node, "yields", behaviour.yields);
  read(node, "opens_doors", behaviour.opens_doors);
  const bool needs_waypoints = behaviour.kind == BehaviourKind::patrol || behaviour.kind == BehaviourKind::go;
  if (needs_waypoints && behaviour.waypoints.empty()) {
    problems.add(node.line, std::string("'behaviour': ") + to_string(behaviour.kind) +
                                " needs waypoints, such as 'waypoints: [[1 m, 2 m], [3 m, 2 m]]'");
  }
}

void read_agent_pose(const Node& node, Transform<Map, Base>& T_map_base, Problems& problems) {
  read(node, "pose", T_map_base, problems);
  if (!(T_map_base.rotation()(2, 2) > 1 - 1e-9)) {
    problems.add(node.find("pose")->line, "'pose': an agent stands upright: expected roll = pitch = 0 rad");
  }
}

AgentDefinition read_agent(const Node& node, Problems& problems) {
  AgentDefinition agent;
  read(node, "name", agent.name);
  read(node, "kind", kKindNames, agent.kind);
  read_agent_pose(node, agent.T_map_base, problems);
  if (const Node* size = node.find("size")) agent.size = vector3(*size);
  if (const Node* behaviour = node.find("behaviour")) read_behaviour(*behaviour, agent.behaviour, problems);
  read(node, "laser", agent.laser);
  read(node, "model", agent.model);
  if (!agent.model.empty() && agent.kind != AgentKind::robot)
    problems.add(node.find("model")->line, "'model': only an agent of kind robot has a robot model");
  read(node, "mass", agent.mass);
  const bool is_thing =
      agent.kind == AgentKind::box || agent.kind == AgentKind::barrel || agent.kind == AgentKind::container;
  if (agent.mass > 0 && !is_thing)
    problems.add(node.find("mass")->line, "'mass' is for boxes, barrels and containers");
  read(node, "camera", agent.camera_rate);
  if (agent.camera_rate > 0 && agent.model.empty())
    problems.add(
        node.find("camera")->line,
        "'camera' is the robot model's, and this agent has none; add 'model', such as 'model: rover'");
  return agent;
}

void write_behaviour(Writer& writer, const Behaviour& behaviour) {
  writer.open("behaviour");
  writer.word("kind", to_string(behaviour.kind));
  writer.quantity("speed", behaviour.speed, Quantity::speed);
  if (!behaviour.waypoints.empty()) {
    writer.open("waypoints");
    for (const Eigen::Vector2d& point : behaviour.waypoints) writer.item(format_lengths(point.data(), 2));
    writer.close();
  }
  if (!behaviour.target.empty()) writer.text("target", behaviour.target);
  writer.quantity("distance", behaviour.distance, Quantity::length);
  if (behaviour.yields) writer.flag("yields", true);
  if (!behaviour.opens_doors) writer.flag("opens_doors", false);
  writer.close();
}

void write_agent(Writer& writer, const AgentDefinition& agent) {
  writer.text("name", agent.name);
  writer.word("kind", to_string(agent.kind));
  writer.line("pose", format_isometry(agent.T_map_base.isometry()));
  writer.line("size", format_lengths(agent.size.data(), 3));
  write_behaviour(writer, agent.behaviour);
  if (!agent.laser.empty()) writer.text("laser", agent.laser);
  if (!agent.model.empty()) writer.text("model", agent.model);
  if (agent.mass > 0) writer.quantity("mass", agent.mass, Quantity::mass);
  if (agent.camera_rate > 0) writer.quantity("camera", agent.camera_rate, Quantity::rate);
}

}  // namespace parhelion::yaml
