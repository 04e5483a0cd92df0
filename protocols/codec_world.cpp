// agent_cmd_t, operator_t, event_t, world_t.
#include <algorithm>

#include "parhelion/agent_cmd_t.hpp"
#include "parhelion/event_t.hpp"
#include "parhelion/operator_t.hpp"
#include "parhelion/world_t.hpp"
#include "protocols/codec_wire.hpp"

namespace parhelion {
namespace {

constexpr std::size_t max_waypoints = 10'000;
constexpr std::size_t max_bodies = 100'000;
constexpr std::size_t max_name =
    40;  // MR_AGENT_<name>_CAMERA must stay within the 63 bytes of an LCM channel
constexpr std::size_t max_entity_name = 200;
constexpr double max_size = 100;  // m
constexpr std::size_t least_body_size = 2 * 5 + 2 + 8 + 13 * sizeof(double);

bool is_name(const std::string& name) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  return name.size() <= max_name && std::all_of(name.begin(), name.end(), allowed);
}

void check_name(wire::Reader& reader, const AgentCommand& command) {
  using Action = AgentCommand::Action;
  if (command.action >= Action::door) {
    // Doors and what is found have the names of the model, scripts any.
    reader.check(!command.agent.name.empty() && command.agent.name.size() <= max_entity_name, "name",
                 "empty or too long", "the thing that the action is about, as the model calls it");
    return;
  }
  reader.check(is_name(command.agent.name), "name", "a name that cannot be part of a channel",
               "at most 40 letters, digits, '_' and '-'");
  const bool may_mean_all = command.action == Action::remove_all || command.action == Action::freeze ||
                            command.action == Action::unfreeze;
  reader.check(may_mean_all || !command.agent.name.empty(), "name", "empty",
               "the agent that the action is about");
}

}  // namespace

Status decode(std::string_view channel, Bytes bytes, AgentCommand& command) {
  wire::Reader reader(channel, "agent_cmd_t", agent_cmd_t::getHash(), bytes);
  AgentDefinition& agent = command.agent;
  command.stamp = reader.utime();
  command.request = static_cast<std::uint64_t>(reader.number<std::int64_t>("request"));
  command.action = reader.enumeration("action", AgentCommand::last_action);
  reader.text("name", agent.name);
  check_name(reader, command);
  agent.kind = reader.enumeration("kind", kLastAgentKind);
  const Eigen::Vector3d position = reader.vector("x, y, z", wire::max_position);
  agent.T_map_base = Transform<Map, Base>::planar(position.x(), position.y(),
                                                  reader.bounded("yaw", wire::max_rate), position.z());
  agent.size = reader.vector("size", max_size);
  if (command.action == AgentCommand::Action::spawn && agent.size.minCoeff() <= 0) {
    reader.fail_value("size", agent.size.minCoeff(), "metres, greater than 0");
  }
  agent.behaviour.kind = reader.enumeration("behaviour", kLastBehaviourKind);
  agent.behaviour.speed = reader.bounded("speed", wire::max_rate);
  if (agent.behaviour.speed < 0) reader.fail_value("speed", agent.behaviour.speed, "m/s, not negative");
  agent.behaviour.waypoints.resize(reader.count("nwaypoints", 2 * sizeof(double), max_waypoints));
  for (Eigen::Vector2d& p_map : agent.behaviour.waypoints) {
    for (int i = 0; i < 2; ++i) p_map[i] = reader.bounded("waypoints", wire::max_position);
  }
  reader.text("laser", agent.laser);
  reader.text("model", agent.model);
  reader.text("target", agent.behaviour.target);
  agent.behaviour.distance = reader.bounded("distance", wire::max_position);
  if (agent.behaviour.distance < 0)
    reader.fail_value("distance", agent.behaviour.distance, "metres, not negative");
  agent.behaviour.yields = reader.boolean("yields");
  agent.behaviour.opens_doors = reader.boolean("opens_doors");
  return reader.status();
}

void encode(const AgentCommand& command, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(agent_cmd_t::getHash(), bytes);
  const AgentDefinition& agent = command.agent;
  writer.number(command.stamp.utime());
  writer.number(static_cast<std::int64_t>(command.request));
  writer.enumeration(command.action);
  writer.text(agent.name);
  writer.enumeration(agent.kind);
  writer.vector(agent.T_map_base.translation());
  writer.number(agent.T_map_base.yaw());
  writer.vector(agent.size);
  writer.enumeration(agent.behaviour.kind);
  writer.number(agent.behaviour.speed);
  writer.count(agent.behaviour.waypoints.size());
  for (const Eigen::Vector2d& p_map : agent.behaviour.waypoints) {
    for (int i = 0; i < 2; ++i) writer.number(p_map[i]);
  }
  writer.text(agent.laser);
  writer.text(agent.model);
  writer.text(agent.behaviour.target);
  writer.number(agent.behaviour.distance);
  writer.boolean(agent.behaviour.yields);
  writer.boolean(agent.behaviour.opens_doors);
}

Status decode(std::string_view channel, Bytes bytes, OperatorWord& word) {
  wire::Reader reader(channel, "operator_t", operator_t::getHash(), bytes);
  word.stamp = reader.utime();
  reader.text("name", word.name);
  reader.check(is_name(word.name) && !word.name.empty(), "name", "no name of an operator",
               "1 to 40 letters, digits, '_' and '-'");
  reader.text("robot", word.robot);
  reader.check(is_name(word.robot), "robot", "a name that no robot has",
               "at most 40 letters, digits, '_' and '-'");
  word.state = reader.enumeration("state", OperatorWord::State::lost);
  reader.text("text", word.text);
  return reader.status();
}

void encode(const OperatorWord& word, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(operator_t::getHash(), bytes);
  writer.number(word.stamp.utime());
  writer.text(word.name);
  writer.text(word.robot);
  writer.enumeration(word.state);
  writer.text(word.text);
}

Status decode(std::string_view channel, Bytes bytes, Event& event) {
  wire::Reader reader(channel, "event_t", event_t::getHash(), bytes);
  event.stamp.ns = reader.nanosecond_stamp();
  event.kind = reader.enumeration("kind", kLastEventKind);
  reader.text("subject", event.subject);
  reader.text("object", event.object);
  event.pair = reader.enumeration("pair", PairKind::virtual_virtual);
  event.position = reader.vector("position", wire::max_position);
  event.impulse = reader.bounded("impulse", 1e12);
  event.value = reader.bounded("value", 1e12);
  event.unsensed = reader.boolean("unsensed");
  event.request = static_cast<std::uint64_t>(reader.number<std::int64_t>("request"));
  reader.text("text", event.text);
  return reader.status();
}

void encode(const Event& event, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(event_t::getHash(), bytes);
  writer.nanosecond_stamp(event.stamp);
  writer.enumeration(event.kind);
  writer.text(event.subject);
  writer.text(event.object);
  writer.enumeration(event.pair);
  writer.vector(event.position);
  writer.number(event.impulse);
  writer.number(event.value);
  writer.boolean(event.unsensed);
  writer.number(static_cast<std::int64_t>(event.request));
  writer.text(event.text);
}

Status decode(std::string_view channel, Bytes bytes, WorldMessage& world) {
  wire::Reader reader(channel, "world_t", world_t::getHash(), bytes);
  world.stamp.ns = reader.nanosecond_stamp();
  world.step = static_cast<std::uint64_t>(reader.number<std::int64_t>("step"));
  world.attitude_known = reader.boolean("attitude_known");
  world.bodies.resize(reader.count("nbodies", least_body_size, max_bodies));
  for (WorldMessage::Entry& body : world.bodies) {
    reader.text("entity", body.entity);
    reader.text("part", body.part);
    body.kind = reader.enumeration("kind", kLastAgentKind);
    body.owner = reader.enumeration("owner", BodyOwner::building);
    const auto epoch = reader.number<std::int64_t>("epoch");
    reader.check_range("epoch", epoch, 0, UINT32_MAX);
    body.epoch = static_cast<std::uint32_t>(epoch);
    const Eigen::Vector3d position = reader.vector("pos", wire::max_position);
    body.T_map_body = {reader.orientation("orientation"), position};
    body.velocity = reader.vector("velocity", wire::max_rate);
    body.rotation_rate = reader.vector("rotation_rate", wire::max_rate);
  }
  return reader.status();
}

void encode(const WorldMessage& world, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(world_t::getHash(), bytes);
  writer.nanosecond_stamp(world.stamp);
  writer.number(static_cast<std::int64_t>(world.step));
  writer.boolean(world.attitude_known);
  writer.count(world.bodies.size());
  for (const WorldMessage::Entry& body : world.bodies) {
    writer.text(body.entity);
    writer.text(body.part);
    writer.enumeration(body.kind);
    writer.enumeration(body.owner);
    writer.number(std::int64_t{body.epoch});
    writer.vector(body.T_map_body.translation());
    writer.orientation(body.T_map_body.quaternion());
    writer.vector(body.velocity);
    writer.vector(body.rotation_rate);
  }
}

}  // namespace parhelion
