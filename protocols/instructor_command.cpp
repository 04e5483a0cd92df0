#include "protocols/instructor_command.hpp"

#include <algorithm>
#include <utility>

namespace parhelion {
namespace {

std::string subject(const AgentSpawn& command) { return command.agent.name; }
std::string subject(const AgentMove& command) { return command.agent; }
std::string subject(const AgentBehaviour& command) { return command.agent; }
std::string subject(const AgentRemove& command) { return command.agent; }
std::string subject(const AgentFreeze& command) { return command.agent; }
std::string subject(const DoorCommand& command) { return command.door; }
std::string subject(const FaultCommand& command) { return to_string(command.kind); }
std::string subject(const CameraRate& command) { return command.agent; }
std::string subject(const ObjectReport& command) { return command.object; }
std::string subject(const ScriptStart& command) { return command.script; }
std::string subject(const EmergencyStopCommand& command) { return command.robot; }
std::string subject(const TrainingStart& /*command*/) { return {}; }

const char* action(const AgentSpawn& /*command*/) { return "spawn"; }
const char* action(const AgentMove& /*command*/) { return "move"; }
const char* action(const AgentBehaviour& /*command*/) { return "behave"; }
const char* action(const AgentRemove& command) { return command.all ? "remove_all" : "remove"; }
const char* action(const AgentFreeze& command) { return command.frozen ? "freeze" : "unfreeze"; }
const char* action(const DoorCommand& command) { return command.opening ? "door" : "door_unknown"; }
const char* action(const FaultCommand& command) { return command.begins ? "fault" : "end_fault"; }
const char* action(const CameraRate& /*command*/) { return "camera"; }
const char* action(const ObjectReport& /*command*/) { return "report"; }
const char* action(const ScriptStart& /*command*/) { return "script"; }
const char* action(const EmergencyStopCommand& command) {
  return command.engaged ? "emergency_stop" : "release_emergency_stop";
}
const char* action(const TrainingStart& /*command*/) { return "start"; }

template <std::size_t... Index>
InstructorCommand empty_command(std::size_t index, std::index_sequence<Index...> /*all*/) {
  InstructorCommand command;
  static_cast<void>(((index == Index && (command.emplace<Index>(), true)) || ...));
  return command;
}

}  // namespace

std::optional<InstructorCommand> command_on(std::string_view canonical_channel) {
  const auto found = std::find(kInstructorChannels.begin(), kInstructorChannels.end(), canonical_channel);
  if (found == kInstructorChannels.end()) return std::nullopt;
  return empty_command(static_cast<std::size_t>(found - kInstructorChannels.begin()),
                       std::make_index_sequence<std::variant_size_v<InstructorCommand>>{});
}

std::uint64_t request_of(const InstructorCommand& command) {
  return std::visit([](const auto& each) { return each.request; }, command);
}

void set_request(InstructorCommand& command, SensorTime stamp, std::uint64_t request) {
  std::visit(
      [&](auto& each) {
        each.stamp = stamp;
        each.request = request;
      },
      command);
}

std::string subject_of(const InstructorCommand& command) {
  return std::visit([](const auto& each) { return subject(each); }, command);
}

Eigen::Vector3d position_of(const InstructorCommand& command) {
  if (const auto* spawn = std::get_if<AgentSpawn>(&command)) return spawn->agent.T_map_base.translation();
  if (const auto* move = std::get_if<AgentMove>(&command)) return move->T_map_base.translation();
  const auto* report = std::get_if<ObjectReport>(&command);
  if (report != nullptr && report->position) return {report->position->x(), report->position->y(), 0};
  return Eigen::Vector3d::Zero();
}

const char* action_of(const InstructorCommand& command) {
  return std::visit([](const auto& each) { return action(each); }, command);
}

const char* action_of(const AgentCommand& command) {
  return std::visit([](const auto& each) { return action(each); }, command);
}

InstructorCommand to_instructor_command(const AgentCommand& command) {
  return std::visit([](const auto& each) { return InstructorCommand(each); }, command);
}

}  // namespace parhelion
