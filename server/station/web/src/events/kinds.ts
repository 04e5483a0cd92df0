/** Topic and importance of the event kinds (protocols/event.hpp). */
import type { SessionEvent } from "../session/protocol";
import { strings } from "../strings.en";

export type EventGroup = "contact" | "motion" | "task" | "robot" | "session" | "agent";
export const eventGroups: EventGroup[] = ["contact", "motion", "task", "robot", "session", "agent"];

export type Weight = "bad" | "warning" | "good" | "plain";

const groups: Record<EventGroup, string[]> = {
  contact: ["collision_started", "collision_stopped", "collision_continued", "collision_predicted", "near_miss", "hazard_set_off", "command_reduced", "command_restored"],
  motion: ["step_climbed", "fell", "tipped_over", "tipping_predicted", "pitch_warning", "pitch_limit", "roll_warning", "roll_limit", "yaw_rate_warning",
    "yaw_rate_limit", "zone_entered", "zone_left", "movement_started", "movement_stopped", "door_opened", "door_closed", "door_unhinged",
    "door_space_entered", "door_space_left", "gripped", "lifted", "dropped", "placed"],
  task: ["task_started", "task_done", "task_failed", "penalty_charged", "score_changed", "grading_ended", "object_reported"],
  robot: ["joint_broken", "joint_overload", "joints_restored", "battery_low", "battery_empty", "radio_lost", "radio_restored", "pose_lost",
    "pose_recovered", "relocalized", "injection_degraded", "injection_restored", "deadman_pressed", "deadman_released"],
  session: ["command_accepted", "command_refused", "model_changed", "operator_switched", "console_lost", "foreign_publisher", "script_started",
    "lesson_started", "lesson_ended"],
  agent: ["agent_spawned", "agent_moved", "agent_removed", "goal_reached", "goal_unreachable", "agent_withheld", "agent_shown"],
};
const groupOfKind = new Map(eventGroups.flatMap((group) => groups[group].map((kind) => [kind, group] as const)));

export function groupOf(kind: string): EventGroup {
  return groupOfKind.get(kind) ?? "session";
}

const bad = new Set(["collision_started", "hazard_set_off", "fell", "tipped_over", "door_unhinged", "dropped", "task_failed", "penalty_charged",
  "joint_broken", "battery_empty", "radio_lost", "pose_lost", "console_lost", "pitch_limit", "roll_limit", "yaw_rate_limit"]);
const warning = new Set(["collision_predicted", "near_miss", "tipping_predicted", "pitch_warning", "roll_warning", "yaw_rate_warning", "joint_overload", "battery_low",
  "injection_degraded", "command_refused", "goal_unreachable", "foreign_publisher", "command_reduced"]);
const good = new Set(["task_done", "placed", "lifted", "pose_recovered", "injection_restored", "radio_restored"]);

export function weightOf(kind: string): Weight {
  return bad.has(kind) ? "bad" : warning.has(kind) ? "warning" : good.has(kind) ? "good" : "plain";
}

/** So frequent that the list hides them by default. */
const chatter = new Set(["collision_continued", "command_accepted", "score_changed", "movement_started", "movement_stopped", "deadman_pressed",
  "deadman_released", "collision_stopped", "command_restored"]);

/** A limited speed is no news while nobody drives the robot. */
const idle = (event: SessionEvent) => event.kind === "command_reduced" && event.text === "silence";

export interface EventFilter { groups: ReadonlySet<EventGroup>; all: boolean; text: string }

/** Events that pass the filter, newest first. `all`: includes frequent kinds. */
export function filtered(events: readonly SessionEvent[], filter: EventFilter): SessionEvent[] {
  const words = filter.text.toLowerCase().split(/\s+/).filter(Boolean);
  const passes = (event: SessionEvent): boolean => {
    if (!filter.groups.has(groupOf(event.kind)) || (!filter.all && (chatter.has(event.kind) || idle(event)))) return false;
    const said = `${event.kind.replaceAll("_", " ")} ${strings.eventKinds[event.kind] ?? ""} ${event.subject} ${event.object} ${event.text ?? ""}`.toLowerCase();
    return words.every((word) => said.includes(word));
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
