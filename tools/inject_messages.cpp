#include "tools/inject_messages.hpp"

#include <unistd.h>

#include <map>

#include "protocols/enumerators.hpp"
#include "protocols/nearest_name.hpp"
#include "server/runtime/wall_clock.hpp"
#include "tools/place_argument.hpp"

namespace parhelion::tools {
namespace {

Result<Transform<Map, Base>> read_place(const InjectArguments& arguments) {
  if (arguments.at.empty())
    return Error{std::string("--at is missing; give --at X,Y or --at ") + kPlaceFormat};
  const auto place = parse_place(arguments.at, false);
  if (!place) return Error{"--at '" + arguments.at + "': " + place.error().message};
  return Transform<Map, Base>::planar(place->x(), place->y(), place->z());
}

Result<Behaviour> read_behaviour(const InjectArguments& arguments) {
  Behaviour behaviour;
  behaviour.kind = enumerator(arguments.behaviour, kLastBehaviourKind).value();
  behaviour.speed = arguments.speed;
  behaviour.target = arguments.target;
  behaviour.distance = arguments.distance;
  behaviour.yields = arguments.yields;
  behaviour.opens_doors = !arguments.leaves_doors;
  for (const std::string& text : arguments.waypoints) {
    const auto waypoint = parse_point(text);
    if (!waypoint) return Error{"--waypoint '" + text + "': " + waypoint.error().message};
    behaviour.waypoints.push_back(*waypoint);
  }
  return behaviour;
}

Result<InstructorCommand> spawn(const InjectArguments& arguments) {
  AgentSpawn command;
  AgentDefinition& agent = command.agent;
  agent.name = arguments.name;
  agent.kind = enumerator(arguments.kind, kLastAgentKind).value();
  agent.laser = arguments.laser;
  agent.model = arguments.model;
  agent.camera_rate = arguments.rate.value_or(0);
  const auto behaviour = read_behaviour(arguments);
  if (!behaviour) return behaviour.error();
  agent.behaviour = *behaviour;
  const auto place = read_place(arguments);
  if (!place) return place.error();
  agent.T_map_base = *place;
  if (arguments.size.empty()) return InstructorCommand(command);
  const auto size = parse_lengths(arguments.size);
  if (!size) return Error{"--size '" + arguments.size + "': " + size.error().message};
  agent.size = *size;
  return InstructorCommand(command);
}

Result<InstructorCommand> move(const InjectArguments& arguments) {
  const auto place = read_place(arguments);
  if (!place) return place.error();
  return InstructorCommand(AgentMove{.agent = arguments.name, .T_map_base = *place});
}

/// find_place() fills in its pose.
Result<InstructorCommand> reset(const InjectArguments& arguments) {
  return InstructorCommand(AgentMove{.agent = arguments.name});
}

Result<InstructorCommand> behave(const InjectArguments& arguments) {
  const auto behaviour = read_behaviour(arguments);
  if (!behaviour) return behaviour.error();
  return InstructorCommand(AgentBehaviour{.agent = arguments.name, .behaviour = *behaviour});
}

Result<InstructorCommand> remove(const InjectArguments& arguments) {
  return InstructorCommand(AgentRemove{.agent = arguments.name});
}

Result<InstructorCommand> remove_all(const InjectArguments& /*arguments*/) {
  return InstructorCommand(AgentRemove{.all = true});
}

Result<InstructorCommand> freeze(const InjectArguments& arguments) {
  return InstructorCommand(AgentFreeze{.all = arguments.name.empty(), .agent = arguments.name});
}

Result<InstructorCommand> unfreeze(const InjectArguments& arguments) {
  return InstructorCommand(
      AgentFreeze{.all = arguments.name.empty(), .agent = arguments.name, .frozen = false});
}

Result<InstructorCommand> door(const InjectArguments& arguments) {
  return InstructorCommand(DoorCommand{.door = arguments.name, .opening = arguments.opening});
}

Result<FaultCommand> named_fault(const InjectArguments& arguments) {
  const auto kind = enumerator(arguments.name, kLastFaultKind);
  if (!kind)
    return Error{"--name: no fault '" + arguments.name + "'" +
                 suggestion_or_known(arguments.name, names_up_to(kLastFaultKind))};
  return FaultCommand{.kind = *kind};
}

Result<InstructorCommand> fault(const InjectArguments& arguments) {
  auto command = named_fault(arguments);
  if (!command) return command.error();
  const bool wheel = command->kind == Fault::Kind::dead_wheel;
  if (wheel && arguments.side.empty()) return Error{"expected --side left or --side right"};
  if (!wheel && !arguments.amount)
    return Error{
        "--amount is missing: seconds for camera_delay, the lost fraction for camera_loss and "
        "laser_dropouts"};
  command->amount = wheel ? 0 : *arguments.amount;
  command->right = arguments.side == "right";
  if (arguments.lasting > 0) command->duration = arguments.lasting;
  return InstructorCommand(*command);
}

Result<InstructorCommand> end_fault(const InjectArguments& arguments) {
  auto command = named_fault(arguments);
  if (!command) return command.error();
  command->begins = false;
  return InstructorCommand(*command);
}

Result<InstructorCommand> camera(const InjectArguments& arguments) {
  if (!arguments.rate) return Error{"expected --rate, pictures per second, 0 for none"};
  return InstructorCommand(CameraRate{.agent = arguments.name, .rate = *arguments.rate});
}

Result<InstructorCommand> report(const InjectArguments& arguments) {
  ObjectReport command;
  command.object = arguments.name;
  if (!arguments.at.empty()) {
    const auto place = read_place(arguments);
    if (!place) return place.error();
    command.position = place->translation().head<2>();
  }
  return InstructorCommand(command);
}

Result<InstructorCommand> script(const InjectArguments& arguments) {
  return InstructorCommand(ScriptStart{.script = arguments.name});
}

Result<InstructorCommand> start(const InjectArguments& /*arguments*/) {
  return InstructorCommand(TrainingStart{});
}

Result<InstructorCommand> emergency_stop(const InjectArguments& arguments) {
  return InstructorCommand(EmergencyStopCommand{.robot = arguments.name});
}

Result<InstructorCommand> release_emergency_stop(const InjectArguments& arguments) {
  return InstructorCommand(EmergencyStopCommand{.robot = arguments.name, .engaged = false});
}

struct Action {
  const char* about;  ///< the meaning of --name; nullptr: it may be omitted, and all are meant
  Result<InstructorCommand> (*make)(const InjectArguments& arguments);
};
const std::map<std::string, Action> kActions{{"spawn", {"agent", spawn}},
                                             {"move", {"agent", move}},
                                             {"reset", {"agent", reset}},
                                             {"behave", {"agent", behave}},
                                             {"remove", {"agent", remove}},
                                             {"remove-all", {nullptr, remove_all}},
                                             {"freeze", {nullptr, freeze}},
                                             {"unfreeze", {nullptr, unfreeze}},
                                             {"door", {"door", door}},
                                             {"fault", {"fault", fault}},
                                             {"end-fault", {"fault", end_fault}},
                                             {"camera", {"agent", camera}},
                                             {"report", {"object", report}},
                                             {"script", {"script", script}},
                                             {"start", {nullptr, start}},
                                             {"emergency-stop", {nullptr, emergency_stop}},
                                             {"release-emergency-stop", {nullptr, release_emergency_stop}}};

}  // namespace

std::vector<std::string> inject_actions() {
  std::vector<std::string> names;
  for (const auto& [name, action] : kActions) names.push_back(name);
  return names;
}

Result<InstructorCommand> make_command(const InjectArguments& arguments) {
  const Action& action = kActions.at(arguments.action);
  if (action.about != nullptr && arguments.name.empty())
    return Error{std::string("--name is missing; give --name NAME of the ") + action.about};
  auto command = action.make(arguments);
  if (!command) return command.error();
  set_request(
      *command, {runtime::wall_now().ns},
      static_cast<std::uint64_t>(runtime::wall_now().ns) ^ (static_cast<std::uint64_t>(getpid()) << 48));
  return command;
}

}  // namespace parhelion::tools
