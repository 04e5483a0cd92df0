/** An event in words for a list. */
import type { SessionEvent } from "../session/protocol";
import { groupOf } from "./kinds";
import { strings } from "../strings.en";

export function nameOfEvent(event: Pick<SessionEvent, "kind">): string {
  return strings.eventKinds[event.kind] ?? event.kind.replaceAll("_", " ");
}

/** Who, whom, how hard and what else was said. */
export function detailOf(event: SessionEvent): string {
  const object = (strings.instruct.lessonKinds as Record<string, string>)[event.object] ?? event.object;
  const whom = (groupOf(event.kind) === "task" ? [event.object] : [event.subject, object]).filter(Boolean).join(" – ");
  const impulse = event.impulse > 0 ? `${event.impulse.toFixed(1)}\u00a0N\u00a0s` : "";
  // The server's words are a sentence or one of its own names.
  const text = event.text?.replaceAll("_", event.kind === "command_reduced" ? " " : "_");
  return [whom, impulse, text].filter(Boolean).join(" · ");
}
