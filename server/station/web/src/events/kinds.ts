/** Topic and importance of the event kinds (protocols/event.hpp). */
import type { SessionEvent } from "../session/protocol";
import { strings } from "../strings.en";

export type EventGroup = "contact" | "motion" | "task" | "robot" | "session" | "agent";
export const eventGroups: EventGroup[] = ["contact", "motion", "task", "robot", "session", "agent"];

export type Weight = "bad" | "warning" | "good" | "plain";

const groups: Record<EventGroup, string[]> = {
  contact: ["person_touched", "contact_started", "contact_ended", "contact_continues", "collision_predicted", "near_miss", "hazard_triggered", "speed_limited", "speed_limit_lifted"],
  motion: ["step_climbed", "fell", "tipped_over", "tipping_predicted", "pitch_warning", "pitch_limit", "roll_warning", "roll_limit", "yaw_rate_warning",
    "yaw_rate_limit", "zone_entered", "zone_left", "movement_started", "movement_stopped", "door_opened", "door_closed", "door_unhinged",
    "door_space_entered", "door_space_left", "gripped", "lifted", "dropped", "placed"],
  task: ["task_started", "task_done", "task_failed", "points_deducted", "score_changed", "grading_ended", "object_reported"],
  robot: ["joint_broken", "joint_overload", "payload_exceeded", "joint_limited", "joint_limit_lifted", "joints_restored", "encoders_lost", "encoders_back", "battery_low", "battery_empty", "dose_warning", "dose_limit", "radio_lost", "radio_restored", "localization_lost",
    "localized", "relocalized", "odometry_changed", "poses_conflict", "scans_conflict", "injection_suspended", "injection_active", "dead_man_pressed", "dead_man_released"],
  session: ["command_accepted", "command_refused", "model_changed", "operator_switched", "console_lost", "foreign_publisher", "script_started", "training_started",
    "fault_started", "fault_ended", "mark"],
  agent: ["agent_spawned", "agent_moved", "agent_removed", "goal_reached", "goal_unreachable", "agent_hidden", "agent_shown"],
};
const groupOfKind = new Map(eventGroups.flatMap((group) => groups[group].map((kind) => [kind, group] as const)));

export function groupOf(kind: string): EventGroup {
  return groupOfKind.get(kind) ?? "session";
}

const bad = new Set(["person_touched", "contact_started", "hazard_triggered", "fell", "tipped_over", "door_unhinged", "dropped", "task_failed", "points_deducted",
  "joint_broken", "battery_empty", "dose_limit", "radio_lost", "localization_lost", "console_lost", "pitch_limit", "roll_limit", "yaw_rate_limit"]);
const warning = new Set(["collision_predicted", "near_miss", "tipping_predicted", "pitch_warning", "roll_warning", "yaw_rate_warning", "joint_overload", "payload_exceeded", "joint_limited", "encoders_lost", "battery_low", "dose_warning",
  "injection_suspended", "command_refused", "goal_unreachable", "foreign_publisher", "scans_conflict", "speed_limited"]);
const good = new Set(["task_done", "placed", "lifted", "localized", "injection_active", "radio_restored"]);

export function weightOf(kind: string): Weight {
  return bad.has(kind) ? "bad" : warning.has(kind) ? "warning" : good.has(kind) ? "good" : "plain";
}

/** So frequent that the list hides them by default. */
const chatter = new Set(["contact_continues", "command_accepted", "score_changed", "movement_started", "movement_stopped", "dead_man_pressed",
  "dead_man_released", "contact_ended", "speed_limit_lifted"]);

/** A limited speed is no news while nobody drives the robot. */
const idle = (event: SessionEvent) => event.kind === "speed_limited" && event.text === "silence";

export interface EventFilter { groups: ReadonlySet<EventGroup>; all: boolean; text: string }

/** Events that pass the filter, newest first. `all`: includes frequent kinds. */
export function filtered(events: readonly SessionEvent[], filter: EventFilter): SessionEvent[] {
  const words = filter.text.toLowerCase().split(/\s+/).filter(Boolean);
  const passes = (event: SessionEvent): boolean => {
    if (!filter.groups.has(groupOf(event.kind)) || (!filter.all && (chatter.has(event.kind) || idle(event)))) return false;
    const searchText = `${event.kind.replaceAll("_", " ")} ${strings.eventKinds[event.kind] ?? ""} ${event.subject} ${event.object} ${event.text ?? ""}`.toLowerCase();
    return words.every((word) => searchText.includes(word));
  };
  return events.filter(passes).reverse();
}

/** The marks of a seek bar: important events, thinned so that no two of equal weight are closer than `apart` s. */
export function seekMarks(events: readonly SessionEvent[], apart: number): SessionEvent[] {
  const last = new Map<Weight, number>();
  return events.filter((event) => {
    const weight = weightOf(event.kind);
    if (weight === "plain" || event.t - (last.get(weight) ?? -Infinity) < apart) return false;
    last.set(weight, event.t);
    return true;
  });
}
