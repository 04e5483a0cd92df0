// Commands of an instructor: agent_spawn_t to emergency_stop_t.
#include "parhelion/agent_behaviour_t.hpp"
#include "parhelion/agent_freeze_t.hpp"
#include "parhelion/agent_move_t.hpp"
#include "parhelion/agent_remove_t.hpp"
#include "parhelion/agent_spawn_t.hpp"
#include "parhelion/camera_rate_t.hpp"
#include "parhelion/door_cmd_t.hpp"
#include "parhelion/emergency_stop_t.hpp"
#include "parhelion/fault_cmd_t.hpp"
#include "parhelion/object_report_t.hpp"
#include "parhelion/script_start_t.hpp"
#include "parhelion/training_start_t.hpp"
#include "protocols/codec_wire.hpp"

namespace parhelion {
namespace {

constexpr std::size_t kMaxWaypoints = 10'000;
constexpr double kMaxSize = 100;  // m

enum class Side : std::uint8_t { left, right };

template <class Command>
void read_head(wire::Reader& reader, Command& command) {
  command.stamp = reader.utime();
  command.request = static_cast<std::uint64_t>(reader.number<std::int64_t>("request"));
}

template <class Command>
void write_head(wire::Writer& writer, const Command& command) {
  writer.number(command.stamp.utime());
  writer.number(static_cast<std::int64_t>(command.request));
}

void read_agent_name(wire::Reader& reader, std::string& name) {
  reader.text("name", name);
  wire::check_agent_name(reader, "name", name);
}

/// One agent by its name, or all of them without one.
template <class Command>
void read_agent_or_all(wire::Reader& reader, Command& command) {
  command.all = reader.boolean("all");
  reader.text("name", command.agent);
  if (command.all) {
    reader.check(command.agent.empty(), "name", "a name together with 'all'",
                 "an empty name, as all are meant");
  } else {
    wire::check_agent_name(reader, "name", command.agent);
  }
}

/// Names of doors, objects and scripts come from the model or the scenario and may contain any bytes.
void read_entity_name(wire::Reader& reader, const char* field, std::string& name) {
  reader.name(field, name);
  reader.check(!name.empty(), field, "empty", "a name of the model or the scenario");
}

double read_not_negative(wire::Reader& reader, const char* field, double limit, const char* expected) {
  const double value = reader.bounded(field, limit);
  if (value < 0) reader.fail_value(field, value, expected);
  return value;
}

Transform<Map, Base> read_place(wire::Reader& reader) {
  const Eigen::Vector3d position = reader.vector("x, y, z", wire::kMaxPosition);
  return Transform<Map, Base>::planar(position.x(), position.y(), reader.bounded("yaw", wire::kMaxRate),
                                      position.z());
}

void write_place(wire::Writer& writer, const Transform<Map, Base>& T_map_base) {
  writer.vector(T_map_base.translation());
  writer.number(T_map_base.yaw());
}

void read_behaviour(wire::Reader& reader, Behaviour& behaviour) {
  behaviour.kind = reader.enumeration("behaviour.kind", kLastBehaviourKind);
  behaviour.speed = read_not_negative(reader, "speed", wire::kMaxRate, "m/s, not negative");
  behaviour.waypoints.resize(reader.count("nwaypoints", 2 * sizeof(double), kMaxWaypoints));
  for (Eigen::Vector2d& p_map : behaviour.waypoints) {
    for (int i = 0; i < 2; ++i) p_map[i] = reader.bounded("waypoints", wire::kMaxPosition);
  }
  reader.name("target", behaviour.target);
  behaviour.distance = read_not_negative(reader, "distance", wire::kMaxPosition, "metres, not negative");
  behaviour.yields = reader.boolean("yields");
  behaviour.opens_doors = reader.boolean("opens_doors");
}

void write_behaviour(wire::Writer& writer, const Behaviour& behaviour) {
  writer.enumeration(behaviour.kind);
  writer.number(behaviour.speed);
  writer.count(behaviour.waypoints.size());
  for (const Eigen::Vector2d& p_map : behaviour.waypoints) {
    for (int i = 0; i < 2; ++i) writer.number(p_map[i]);
  }
  writer.text(behaviour.target);
  writer.number(behaviour.distance);
  writer.boolean(behaviour.yields);
  writer.boolean(behaviour.opens_doors);
}

}  // namespace

Status decode(std::string_view channel, Bytes bytes, AgentSpawn& command) {
  wire::Reader reader(channel, "agent_spawn_t", agent_spawn_t::getHash(), bytes);
  AgentDefinition& agent = command.agent;
  read_head(reader, command);
  read_agent_name(reader, agent.name);
  agent.kind = reader.enumeration("kind", kLastAgentKind);
  agent.T_map_base = read_place(reader);
  agent.size = reader.vector("size", kMaxSize);
  if (agent.size.minCoeff() <= 0) reader.fail_value("size", agent.size.minCoeff(), "metres, greater than 0");
  read_behaviour(reader, agent.behaviour);
  reader.name("laser", agent.laser);
  reader.name("model", agent.model);
  agent.camera_rate = read_not_negative(reader, "camera_rate", wire::kMaxRate, "Hz, not negative");
  return reader.status();
}

void encode(const AgentSpawn& command, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(agent_spawn_t::getHash(), bytes);
  const AgentDefinition& agent = command.agent;
  write_head(writer, command);
  writer.text(agent.name);
  writer.enumeration(agent.kind);
  write_place(writer, agent.T_map_base);
  writer.vector(agent.size);
  write_behaviour(writer, agent.behaviour);
  writer.text(agent.laser);
  writer.text(agent.model);
  writer.number(agent.camera_rate);
}

Status decode(std::string_view channel, Bytes bytes, AgentMove& command) {
  wire::Reader reader(channel, "agent_move_t", agent_move_t::getHash(), bytes);
  read_head(reader, command);
  read_agent_name(reader, command.agent);
  command.T_map_base = read_place(reader);
  return reader.status();
}

void encode(const AgentMove& command, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(agent_move_t::getHash(), bytes);
  write_head(writer, command);
  writer.text(command.agent);
  write_place(writer, command.T_map_base);
}

Status decode(std::string_view channel, Bytes bytes, AgentBehaviour& command) {
  wire::Reader reader(channel, "agent_behaviour_t", agent_behaviour_t::getHash(), bytes);
  read_head(reader, command);
  read_agent_name(reader, command.agent);
  read_behaviour(reader, command.behaviour);
  return reader.status();
}

void encode(const AgentBehaviour& command, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(agent_behaviour_t::getHash(), bytes);
  write_head(writer, command);
  writer.text(command.agent);
  write_behaviour(writer, command.behaviour);
}

Status decode(std::string_view channel, Bytes bytes, AgentRemove& command) {
  wire::Reader reader(channel, "agent_remove_t", agent_remove_t::getHash(), bytes);
  read_head(reader, command);
  read_agent_or_all(reader, command);
  return reader.status();
}

void encode(const AgentRemove& command, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(agent_remove_t::getHash(), bytes);
  write_head(writer, command);
  writer.boolean(command.all);
  writer.text(command.agent);
}

Status decode(std::string_view channel, Bytes bytes, AgentFreeze& command) {
  wire::Reader reader(channel, "agent_freeze_t", agent_freeze_t::getHash(), bytes);
  read_head(reader, command);
  read_agent_or_all(reader, command);
  command.frozen = reader.boolean("frozen");
  return reader.status();
}

void encode(const AgentFreeze& command, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(agent_freeze_t::getHash(), bytes);
  write_head(writer, command);
  writer.boolean(command.all);
  writer.text(command.agent);
  writer.boolean(command.frozen);
}

Status decode(std::string_view channel, Bytes bytes, DoorCommand& command) {
  wire::Reader reader(channel, "door_cmd_t", door_cmd_t::getHash(), bytes);
  read_head(reader, command);
  read_entity_name(reader, "name", command.door);
  const bool known = reader.boolean("known");
  const double opening = reader.bounded("opening", wire::kMaxRate);
  command.opening = known ? std::optional(opening) : std::nullopt;
  return reader.status();
}

void encode(const DoorCommand& command, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(door_cmd_t::getHash(), bytes);
  write_head(writer, command);
  writer.text(command.door);
  writer.boolean(command.opening.has_value());
  writer.number(command.opening.value_or(0));
}

Status decode(std::string_view channel, Bytes bytes, FaultCommand& command) {
  wire::Reader reader(channel, "fault_cmd_t", fault_cmd_t::getHash(), bytes);
  read_head(reader, command);
  command.kind = reader.enumeration("kind", kLastFaultKind);
  command.begins = reader.boolean("begins");
  command.amount = reader.bounded("amount", wire::kMaxRate);
  command.right = reader.enumeration("side", Side::right) == Side::right;
  const double duration = read_not_negative(reader, "duration", wire::kMaxRate, "s, not negative");
  command.duration = duration > 0 ? std::optional(duration) : std::nullopt;
  return reader.status();
}

void encode(const FaultCommand& command, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(fault_cmd_t::getHash(), bytes);
  write_head(writer, command);
  writer.enumeration(command.kind);
  writer.boolean(command.begins);
  writer.number(command.amount);
  writer.enumeration(command.right ? Side::right : Side::left);
  writer.number(command.duration.value_or(0));
}

Status decode(std::string_view channel, Bytes bytes, CameraRate& command) {
  wire::Reader reader(channel, "camera_rate_t", camera_rate_t::getHash(), bytes);
  read_head(reader, command);
  read_agent_name(reader, command.agent);
  command.rate = read_not_negative(reader, "rate", wire::kMaxRate, "Hz, not negative");
  return reader.status();
}

void encode(const CameraRate& command, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(camera_rate_t::getHash(), bytes);
  write_head(writer, command);
  writer.text(command.agent);
  writer.number(command.rate);
}

Status decode(std::string_view channel, Bytes bytes, ObjectReport& command) {
  wire::Reader reader(channel, "object_report_t", object_report_t::getHash(), bytes);
  read_head(reader, command);
  read_entity_name(reader, "name", command.object);
  const bool known = reader.boolean("position_known");
  Eigen::Vector2d position;
  for (int i = 0; i < 2; ++i) position[i] = reader.bounded("x, y", wire::kMaxPosition);
  command.position = known ? std::optional(position) : std::nullopt;
  return reader.status();
}

void encode(const ObjectReport& command, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(object_report_t::getHash(), bytes);
  write_head(writer, command);
  writer.text(command.object);
  writer.boolean(command.position.has_value());
  const Eigen::Vector2d position = command.position.value_or(Eigen::Vector2d::Zero());
  for (int i = 0; i < 2; ++i) writer.number(position[i]);
}

Status decode(std::string_view channel, Bytes bytes, ScriptStart& command) {
  wire::Reader reader(channel, "script_start_t", script_start_t::getHash(), bytes);
  read_head(reader, command);
  read_entity_name(reader, "script", command.script);
  return reader.status();
}

void encode(const ScriptStart& command, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(script_start_t::getHash(), bytes);
  write_head(writer, command);
  writer.text(command.script);
}

Status decode(std::string_view channel, Bytes bytes, TrainingStart& command) {
  wire::Reader reader(channel, "training_start_t", training_start_t::getHash(), bytes);
  read_head(reader, command);
  return reader.status();
}

void encode(const TrainingStart& command, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(training_start_t::getHash(), bytes);
  write_head(writer, command);
}

Status decode(std::string_view channel, Bytes bytes, EmergencyStopCommand& command) {
  wire::Reader reader(channel, "emergency_stop_t", emergency_stop_t::getHash(), bytes);
  read_head(reader, command);
  reader.text("robot", command.robot);
  if (!command.robot.empty()) wire::check_agent_name(reader, "robot", command.robot);
  command.engaged = reader.boolean("engaged");
  return reader.status();
}

void encode(const EmergencyStopCommand& command, std::vector<std::uint8_t>& bytes) {
  wire::Writer writer(emergency_stop_t::getHash(), bytes);
  write_head(writer, command);
  writer.text(command.robot);
  writer.boolean(command.engaged);
}

Status decode(std::string_view channel, Bytes bytes, InstructorCommand& command) {
  return std::visit([&](auto& each) { return decode(channel, bytes, each); }, command);
}

void encode(const InstructorCommand& command, std::vector<std::uint8_t>& bytes) {
  std::visit([&](const auto& each) { encode(each, bytes); }, command);
}

}  // namespace parhelion
