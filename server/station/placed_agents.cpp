#include "server/station/placed_agents.hpp"

namespace parhelion::station {
namespace {

constexpr std::size_t most_unanswered = 256;  // a server that does not answer: the oldest are forgotten

}  // namespace

PlacedAgents::PlacedAgents(const Scenario& scenario) : scenario_(scenario) {
  for (const Script& script : scenario.scripts) {
    for (const AgentCommand& command : script.actions) {
      if (command.action == AgentCommand::Action::spawn) scripted_[command.agent.name] = command.agent;
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

void PlacedAgents::take(const AgentCommand& command) {
  if (command.request == 0) return;
  asked_[command.request] = command;
  if (asked_.size() <= most_unanswered) return;
  auto oldest = asked_.begin();
  for (auto each = asked_.begin(); each != asked_.end(); ++each) {
    if (each->second.stamp < oldest->second.stamp) oldest = each;
  }
  asked_.erase(oldest);
}

void PlacedAgents::take(const Event& event) {
  if (event.kind == EventKind::agent_removed) agents_.erase(event.subject);
  // Of a script: no command carries its request.
  if (event.kind == EventKind::agent_spawned && event.request == 0) {
    if (const auto known = scripted_.find(event.subject); known != scripted_.end())
      agents_[event.subject] = known->second;
  }
  const auto asked = event.request == 0 ? asked_.end() : asked_.find(event.request);
  if (asked == asked_.end()) return;
  // The spawn is said before its command is answered, and the world may show it in between.
  if (event.kind == EventKind::agent_spawned) agents_[event.subject] = asked->second.agent;
  if (event.kind == EventKind::command_accepted) done(asked->second);
  if (event.kind == EventKind::command_accepted || event.kind == EventKind::command_refused)
    asked_.erase(asked);
}

void PlacedAgents::done(const AgentCommand& command) {
  using Action = AgentCommand::Action;
  const std::string& name = command.agent.name;
  if (command.action == Action::freeze && name.empty()) frozen_ = true;
  if (command.action == Action::unfreeze && name.empty()) frozen_ = false;
  const auto agent = agents_.find(name);
  if (agent == agents_.end()) return;
  if (command.action == Action::behave) agent->second.behaviour = command.agent.behaviour;
  if (command.action == Action::camera)
    agent->second.camera_rate = command.agent.T_map_base.translation().x();
  if (command.action == Action::move) agent->second.T_map_base = command.agent.T_map_base;
}

const AgentDefinition* PlacedAgents::find(const std::string& agent) const {
  const auto found = agents_.find(agent);
  return found == agents_.end() ? nullptr : &found->second;
}

}  // namespace parhelion::station
