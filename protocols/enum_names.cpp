// The names of events, agents and states in messages and files.
#include "protocols/agent.hpp"
#include "protocols/event.hpp"
#include "protocols/pose.hpp"

namespace parhelion {

const char* to_string(SlamState state) {
  switch (state) {
    case SlamState::initializing:
      return "initializing";
    case SlamState::tracking:
      return "tracking";
    case SlamState::lost:
      return "lost";
    case SlamState::unsure:
      return "unsure";
  }
  return "unknown";
}

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
    case AgentKind::container:
      return "container";
    case AgentKind::cable:
      return "cable";
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
    case BehaviourKind::follow:
      return "follow";
    case BehaviourKind::flee:
      return "flee";
    case BehaviourKind::block:
      return "block";
    case BehaviourKind::go:
      return "go";
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
    case EventKind::contact_started:
      return "contact_started";
    case EventKind::contact_ended:
      return "contact_ended";
    case EventKind::localization_lost:
      return "localization_lost";
    case EventKind::localized:
      return "localized";
    case EventKind::relocalized:
      return "relocalized";
    case EventKind::speed_limited:
      return "speed_limited";
    case EventKind::speed_limit_lifted:
      return "speed_limit_lifted";
    case EventKind::injection_suspended:
      return "injection_suspended";
    case EventKind::injection_active:
      return "injection_active";
    case EventKind::model_changed:
      return "model_changed";
    case EventKind::contact_continues:
      return "contact_continues";
    case EventKind::movement_started:
      return "movement_started";
    case EventKind::movement_stopped:
      return "movement_stopped";
    case EventKind::joint_broken:
      return "joint_broken";
    case EventKind::joint_overload:
      return "joint_overload";
    case EventKind::joints_restored:
      return "joints_restored";
    case EventKind::door_opened:
      return "door_opened";
    case EventKind::door_closed:
      return "door_closed";
    case EventKind::door_unhinged:
      return "door_unhinged";
    case EventKind::door_space_entered:
      return "door_space_entered";
    case EventKind::door_space_left:
      return "door_space_left";
    case EventKind::step_climbed:
      return "step_climbed";
    case EventKind::fell:
      return "fell";
    case EventKind::tipped_over:
      return "tipped_over";
    case EventKind::pitch_warning:
      return "pitch_warning";
    case EventKind::pitch_limit:
      return "pitch_limit";
    case EventKind::roll_warning:
      return "roll_warning";
    case EventKind::roll_limit:
      return "roll_limit";
    case EventKind::yaw_rate_warning:
      return "yaw_rate_warning";
    case EventKind::yaw_rate_limit:
      return "yaw_rate_limit";
    case EventKind::gripped:
      return "gripped";
    case EventKind::lifted:
      return "lifted";
    case EventKind::dropped:
      return "dropped";
    case EventKind::placed:
      return "placed";
    case EventKind::zone_entered:
      return "zone_entered";
    case EventKind::zone_left:
      return "zone_left";
    case EventKind::collision_predicted:
      return "collision_predicted";
    case EventKind::tipping_predicted:
      return "tipping_predicted";
    case EventKind::hazard_triggered:
      return "hazard_triggered";
    case EventKind::radio_lost:
      return "radio_lost";
    case EventKind::radio_restored:
      return "radio_restored";
    case EventKind::battery_low:
      return "battery_low";
    case EventKind::battery_empty:
      return "battery_empty";
    case EventKind::operator_switched:
      return "operator_switched";
    case EventKind::console_lost:
      return "console_lost";
    case EventKind::foreign_publisher:
      return "foreign_publisher";
    case EventKind::goal_reached:
      return "goal_reached";
    case EventKind::goal_unreachable:
      return "goal_unreachable";
    case EventKind::script_started:
      return "script_started";
    case EventKind::task_started:
      return "task_started";
    case EventKind::task_done:
      return "task_done";
    case EventKind::task_failed:
      return "task_failed";
    case EventKind::points_deducted:
      return "points_deducted";
    case EventKind::score_changed:
      return "score_changed";
    case EventKind::grading_ended:
      return "grading_ended";
    case EventKind::object_reported:
      return "object_reported";
    case EventKind::dead_man_pressed:
      return "dead_man_pressed";
    case EventKind::dead_man_released:
      return "dead_man_released";
    case EventKind::fault_started:
      return "fault_started";
    case EventKind::fault_ended:
      return "fault_ended";
    case EventKind::near_miss:
      return "near_miss";
    case EventKind::agent_hidden:
      return "agent_hidden";
    case EventKind::agent_shown:
      return "agent_shown";
    case EventKind::odometry_changed:
      return "odometry_changed";
    case EventKind::poses_conflict:
      return "poses_conflict";
    case EventKind::dose_warning:
      return "dose_warning";
    case EventKind::dose_limit:
      return "dose_limit";
    case EventKind::payload_exceeded:
      return "payload_exceeded";
    case EventKind::joint_limited:
      return "joint_limited";
    case EventKind::joint_limit_lifted:
      return "joint_limit_lifted";
    case EventKind::encoders_lost:
      return "encoders_lost";
    case EventKind::encoders_back:
      return "encoders_back";
    case EventKind::person_touched:
      return "person_touched";
    case EventKind::training_started:
      return "training_started";
    case EventKind::scans_conflict:
      return "scans_conflict";
  }
  return "unknown";
}

}  // namespace parhelion
