#include "server/station/placed_agents.hpp"

#include <algorithm>

namespace parhelion::station {
namespace {

constexpr std::size_t kMaxUnanswered = 256;  // for a server that does not reply: the oldest are dropped

}  // namespace

PlacedAgents::PlacedAgents(const Scenario& scenario) : scenario_(scenario) {
  for (const Script& script : scenario.scripts) {
    for (const AgentCommand& command : script.actions) {
      if (const auto* spawn = std::get_if<AgentSpawn>(&command)) scripted_[spawn->agent.name] = spawn->agent;
    }
  }
  restart();
}

void PlacedAgents::restart() {
  agents_.clear();
  asked_.clear();
  frozen_ = false;
  for (const AgentDefinition& agent : scenario_.agents) agents_[agent.name] = agent;
}

void PlacedAgents::take(const InstructorCommand& command) {
  const std::uint64_t request = request_of(command);
  if (request == 0) return;
  asked_[request] = command;
  if (asked_.size() <= kMaxUnanswered) return;
  const auto stamp = [](const auto& each) {
    return std::visit([](const auto& asked) { return asked.stamp; }, each.second);
  };
  asked_.erase(std::min_element(asked_.begin(), asked_.end(),
                                [&](const auto& a, const auto& b) { return stamp(a) < stamp(b); }));
}

void PlacedAgents::take(const Event& event) {
  if (event.kind == EventKind::agent_removed) agents_.erase(event.subject);
  // Spawned by a script: no command has its request number.
  if (event.kind == EventKind::agent_spawned && event.request == 0) {
    if (const auto known = scripted_.find(event.subject); known != scripted_.end())
      agents_[event.subject] = known->second;
  }
  const auto asked = event.request == 0 ? asked_.end() : asked_.find(event.request);
  if (asked == asked_.end()) return;
  // The spawn event precedes the reply to its command, and the world may show the agent in between.
  const auto* spawn = std::get_if<AgentSpawn>(&asked->second);
  if (event.kind == EventKind::agent_spawned && spawn != nullptr) agents_[event.subject] = spawn->agent;
  if (event.kind == EventKind::command_accepted) done(asked->second);
  if (event.kind == EventKind::command_accepted || event.kind == EventKind::command_refused)
    asked_.erase(asked);
}

void PlacedAgents::done(const InstructorCommand& command) {
  if (const auto* freeze = std::get_if<AgentFreeze>(&command); freeze != nullptr && freeze->all)
    frozen_ = freeze->frozen;
  const auto agent = agents_.find(subject_of(command));
  if (agent == agents_.end()) return;
  if (const auto* changed = std::get_if<AgentBehaviour>(&command))
    agent->second.behaviour = changed->behaviour;
  if (const auto* camera = std::get_if<CameraRate>(&command)) agent->second.camera_rate = camera->rate;
  if (const auto* move = std::get_if<AgentMove>(&command)) agent->second.T_map_base = move->T_map_base;
}

const AgentDefinition* PlacedAgents::find(const std::string& agent) const {
  const auto found = agents_.find(agent);
  return found == agents_.end() ? nullptr : &found->second;
}

}  // namespace parhelion::station
