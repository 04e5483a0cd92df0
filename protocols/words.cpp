// The names of events, agents and actions, as they are printed and written to files.
#include "protocols/command.hpp"
#include "protocols/event.hpp"

namespace parhelion {

const char* to_string(AgentKind kind) {
  switch (kind) {
    case AgentKind::box:
      return "box";
    case AgentKind::barrel:
      return "barrel";
    case AgentKind::person:
      return "person";
    case AgentKind::robot:
      return "robot";
  }
  return "unknown";
}

const char* to_string(BehaviourKind kind) {
  switch (kind) {
    case BehaviourKind::stay:
      return "stay";
    case BehaviourKind::patrol:
      return "patrol";
    case BehaviourKind::wander:
      return "wander";
    case BehaviourKind::teleop:
      return "teleop";
  }
  return "unknown";
}

const char* to_string(AgentCommand::Action action) {
  switch (action) {
    case AgentCommand::Action::spawn:
      return "spawn";
    case AgentCommand::Action::move:
      return "move";
    case AgentCommand::Action::remove:
      return "remove";
    case AgentCommand::Action::behave:
      return "behave";
    case AgentCommand::Action::remove_all:
      return "remove_all";
    case AgentCommand::Action::freeze:
      return "freeze";
    case AgentCommand::Action::unfreeze:
      return "unfreeze";
  }
  return "unknown";
}

const char* to_string(EventKind kind) {
  switch (kind) {
    case EventKind::command_accepted:
      return "command_accepted";
    case EventKind::command_refused:
      return "command_refused";
    case EventKind::agent_spawned:
      return "agent_spawned";
    case EventKind::agent_moved:
      return "agent_moved";
    case EventKind::agent_removed:
      return "agent_removed";
    case EventKind::collision_started:
      return "collision_started";
    case EventKind::collision_stopped:
      return "collision_stopped";
    case EventKind::pose_lost:
      return "pose_lost";
    case EventKind::pose_recovered:
      return "pose_recovered";
    case EventKind::relocalized:
      return "relocalized";
    case EventKind::command_reduced:
      return "command_reduced";
    case EventKind::command_restored:
      return "command_restored";
    case EventKind::injection_degraded:
      return "injection_degraded";
    case EventKind::injection_restored:
      return "injection_restored";
    case EventKind::model_changed:
      return "model_changed";
  }
  return "unknown";
}

}  // namespace parhelion
