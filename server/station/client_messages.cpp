#include "server/station/client_messages.hpp"

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validator.hpp>

#include "protocols/fault.hpp"
#include "protocols/nearest_name.hpp"
#include "server/station/client_message_schema.hpp"

namespace parhelion::station {
namespace {

using Json = nlohmann::json;
using Kind = ClientMessage::Kind;

constexpr int kDeepest = 8;  // our messages nest three levels

/// True if brackets nest too deep: the parser is recursive.
bool too_deep(std::string_view text) {
  int depth = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (quoted && text[i] == '\\') {
      ++i;
    } else if (text[i] == '"') {
      quoted = !quoted;
    } else if (!quoted && (text[i] == '{' || text[i] == '[')) {
      if (++depth > kDeepest) return true;
    } else if (!quoted && (text[i] == '}' || text[i] == ']')) {
      --depth;
    }
  }
  return false;
}

/// A schema for each type of message.
const std::map<std::string, valijson::Schema, std::less<>>& schemas() {
  static const auto compiled = [] {
    const Json whole = Json::parse(kClientMessageSchemaText);
    std::map<std::string, valijson::Schema, std::less<>> all;
    for (const auto& [type, definition] : whole.at("definitions").items()) {
      if (!definition.contains("properties")) continue;
      Json schema = definition;
      schema["definitions"] = whole.at("definitions");
      valijson::SchemaParser parser(valijson::SchemaParser::kDraft7);
      parser.populateSchema(valijson::adapters::NlohmannJsonAdapter(schema), all[type]);
    }
    return all;
  }();
  return compiled;
}

/// Of keys that exclude one another, which is what `not` in our schema means.
std::string excluded_text(const std::string& type) {
  const Json whole = Json::parse(kClientMessageSchemaText);
  std::string keys;
  for (const Json& key : whole.at("definitions").at(type).at("not").at("required"))
    keys += (keys.empty() ? "'" : " and '") + key.get<std::string>() + "'";
  return keys + " exclude one another: give one of them";
}

/// The innermost error in one line, with the key.
std::string fault_text(const std::string& type, valijson::ValidationResults& results) {
  std::string where, what;
  std::size_t depth = 0;
  for (const auto& fault : results) {
    if (!what.empty() && fault.context.size() < depth) continue;
    depth = fault.context.size();
    where.clear();
    for (std::size_t i = 1; i < fault.context.size(); ++i) where += fault.context[i];
    what = fault.description.find("'not' constraint") == std::string::npos ? fault.description
                                                                           : excluded_text(type);
  }
  return where.empty() ? what : where + ": " + what;
}

std::string word(const Json& message, const char* key, std::string otherwise = {}) {
  const auto found = message.find(key);
  return found == message.end() ? otherwise : found->get<std::string>();
}
double number(const Json& message, const char* key, double otherwise) {
  const auto found = message.find(key);
  return found == message.end() ? otherwise : found->get<double>();
}
bool flag(const Json& message, const char* key, bool otherwise) {
  const auto found = message.find(key);
  return found == message.end() ? otherwise : found->get<bool>();
}

/// The enumerator with this name, which the schema has validated.
template <class Enum>
Enum named(const std::string& name, Enum last) {
  for (int i = 0; i < static_cast<int>(last); ++i) {
    if (name == to_string(static_cast<Enum>(i))) return static_cast<Enum>(i);
  }
  return last;
}

Subscription subscription(const Json& message) {
  Subscription wanted;
  if (message.contains("robot")) wanted.robot = message["robot"].get<std::string>();
  wanted.scan = flag(message, "scan", wanted.scan);
  wanted.points = flag(message, "points", wanted.points);
  wanted.world_hz = number(message, "world_hz", wanted.world_hz);
  if (message.contains("agent_scans"))
    wanted.agent_scans = message["agent_scans"].get<std::vector<std::string>>();
  return wanted;
}

using Commands = std::map<std::string, InstructorCommand (*)(const Json& message), std::less<>>;

Transform<Map, Base> place(const Json& message) {
  return Transform<Map, Base>::planar(number(message, "x", 0), number(message, "y", 0),
                                      number(message, "yaw", 0), number(message, "z", 0));
}

Behaviour behaviour_of(const Json& message) {
  Behaviour behaviour;
  behaviour.kind = named(word(message, "behaviour", "stay"), kLastBehaviourKind);
  behaviour.speed = number(message, "speed", behaviour.speed);
  behaviour.target = word(message, "target");
  behaviour.distance = number(message, "distance", behaviour.distance);
  behaviour.yields = flag(message, "yields", behaviour.yields);
  behaviour.opens_doors = flag(message, "opens_doors", behaviour.opens_doors);
  for (const Json& point : message.value("waypoints", Json::array()))
    behaviour.waypoints.emplace_back(point[0].get<double>(), point[1].get<double>());
  return behaviour;
}

InstructorCommand spawn_command(const Json& message) {
  AgentSpawn command;
  AgentDefinition& agent = command.agent;
  agent.name = word(message, "name");
  agent.kind = named(word(message, "kind", "box"), kLastAgentKind);
  agent.T_map_base = place(message);
  if (message.contains("size")) {
    for (std::size_t i = 0; i < 3; ++i)
      agent.size[static_cast<Eigen::Index>(i)] = message["size"][i].get<double>();
  }
  agent.behaviour = behaviour_of(message);
  agent.laser = word(message, "laser");
  agent.model = word(message, "model");
  return command;
}

InstructorCommand freeze_command(const Json& message, bool frozen) {
  return AgentFreeze{.all = !message.contains("name"), .agent = word(message, "name"), .frozen = frozen};
}

/// The actions of a message of type 'agent'.
const Commands& agent_commands() {
  static const Commands commands{
      {"spawn", spawn_command},
      {"move",
       [](const Json& message) -> InstructorCommand {
         return AgentMove{.agent = word(message, "name"), .T_map_base = place(message)};
       }},
      {"remove",
       [](const Json& message) -> InstructorCommand { return AgentRemove{.agent = word(message, "name")}; }},
      {"remove_all", [](const Json&) -> InstructorCommand { return AgentRemove{.all = true}; }},
      {"behave",
       [](const Json& message) -> InstructorCommand {
         return AgentBehaviour{.agent = word(message, "name"), .behaviour = behaviour_of(message)};
       }},
      {"freeze", [](const Json& message) { return freeze_command(message, true); }},
      {"unfreeze", [](const Json& message) { return freeze_command(message, false); }},
      {"door",
       [](const Json& message) -> InstructorCommand {
         return DoorCommand{.door = word(message, "name"), .opening = number(message, "opening", 0)};
       }},
      {"door_unknown",
       [](const Json& message) -> InstructorCommand { return DoorCommand{.door = word(message, "name")}; }}};
  return commands;
}

/// Required fields of a command.
Status check_agent(const Json& message, const std::string& action) {
  const auto lacks = [&](const char* key) { return Error{"'" + action + "' needs '" + key + "'"}; };
  const bool may_mean_all = action == "remove_all" || action == "freeze" || action == "unfreeze";
  if (!may_mean_all && !message.contains("name")) return lacks("name");
  if (action == "spawn" || action == "move") {
    if (!message.contains("x")) return lacks("x");
    if (!message.contains("y")) return lacks("y");
  }
  if (action == "door" && !message.contains("opening")) return lacks("opening");
  return {};
}

Result<InstructorCommand> agent_command(const Json& message) {
  const std::string action = word(message, "action");
  if (const Status whole = check_agent(message, action); !whole) return whole.error();
  return agent_commands().at(action)(message);
}

Result<InstructorCommand> report_command(const Json& message) {
  if (message.contains("x") != message.contains("y"))
    return Error{"'report' has one of 'x' and 'y'; expected both or neither"};
  ObjectReport report;
  report.object = word(message, "name");
  if (message.contains("x")) report.position.emplace(number(message, "x", 0), number(message, "y", 0));
  return InstructorCommand(report);
}

InstructorCommand script_command(const Json& message) { return ScriptStart{.script = word(message, "name")}; }

Result<InstructorCommand> fault_command(const Json& message) {
  const std::string kind = word(message, "kind");
  FaultCommand command;
  command.kind = named(kind, kLastFaultKind);
  command.begins = flag(message, "on", true);
  if (!command.begins) return InstructorCommand(command);
  const char* needed = command.kind == Fault::Kind::dead_wheel ? "side" : "amount";
  if (!message.contains(needed)) return Error{"'fault': '" + kind + "' needs '" + needed + "'"};
  command.amount = number(message, "amount", 0);
  command.right = word(message, "side") == "right";
  if (const double lasting = number(message, "lasting", 0); lasting > 0) command.duration = lasting;
  return InstructorCommand(command);
}

Status fill(const Json& message, const std::string& type, ClientMessage& read) {
  const auto take = [&](Result<InstructorCommand> command) -> Status {
    if (!command) return command.error();
    read.command = std::move(*command);
    return {};
  };
  read.name = word(message, type == "chat"                               ? "to_person"
                            : type == "estop" || type == "estop_release" ? "robot"
                                                                         : "name");
  read.text = word(message, "text");
  read.role = role_of(word(message, "to_role"));
  read.value = number(message, "value", 0);
  if (message.contains("seen")) read.seen = number(message, "seen", 0);
  if (type == "control") {
    const std::string action = word(message, "action");
    if ((action == "rate" || action == "seek") && !message.contains("value"))
      return Error{"'control': '" + action + "' needs 'value'"};
    read.kind = action == "pause"    ? Kind::pause
                : action == "resume" ? Kind::resume
                : action == "step"   ? Kind::step
                : action == "rate"   ? Kind::rate
                                     : Kind::seek;
    return {};
  }
  read.kind = named(type, Kind::estop_release);
  if (read.kind == Kind::subscribe) read.subscription = subscription(message);
  if (read.kind == Kind::agent) return take(agent_command(message));
  if (read.kind == Kind::report) return take(report_command(message));
  if (read.kind == Kind::script) return take(script_command(message));
  if (read.kind == Kind::fault) return take(fault_command(message));
  if (read.kind == Kind::start) return take(InstructorCommand(TrainingStart{}));
  return {};
}

}  // namespace

const char* to_string(ClientMessage::Kind kind) {
  static constexpr const char* names[] = {"subscribe", "agent",  "script", "fault", "start",        "end",
                                          "save",      "report", "chat",   "mark",  "pause",        "resume",
                                          "step",      "rate",   "seek",   "estop", "estop_release"};
  return names[static_cast<std::size_t>(kind)];
}

Result<ClientMessage> read_client_message(std::string_view text, std::uint64_t& request) {
  request = 0;
  if (text.size() > kMaxClientMessage)
    return Error{"a message of " + std::to_string(text.size()) + " bytes; expected at most " +
                 std::to_string(kMaxClientMessage)};
  if (too_deep(text)) return Error{"a message with too deep nesting"};
  const Json message = Json::parse(text, nullptr, false);
  if (!message.is_object()) return Error{"expected a JSON object"};
  if (const auto given = message.find("request"); given != message.end() && given->is_number_unsigned())
    request = given->get<std::uint64_t>();
  const auto type = message.find("type");
  std::vector<std::string> types;
  for (const auto& [name, schema] : schemas()) types.push_back(name);
  if (type == message.end() || !type->is_string())
    return Error{"'type' is missing" + suggestion_or_known("", types)};
  const auto schema = schemas().find(type->get_ref<const std::string&>());
  if (schema == schemas().end())
    return Error{"unknown type" + suggestion_or_known(type->get_ref<const std::string&>(), types)};
  valijson::Validator validator(valijson::Validator::kStrongTypes);
  valijson::ValidationResults results;
  if (!validator.validate(schema->second, valijson::adapters::NlohmannJsonAdapter(message), &results))
    return Error{"'" + schema->first + "': " + fault_text(schema->first, results)};
  ClientMessage read;
  read.request = request;
  if (const Status filled = fill(message, schema->first, read); !filled) return filled.error();
  return read;
}

}  // namespace parhelion::station
