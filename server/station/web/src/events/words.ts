/** Text of an event for a list. */
import type { SessionEvent } from "../session/protocol";
import { groupOf } from "./kinds";
import { strings } from "../strings.en";

export function nameOfEvent(event: Pick<SessionEvent, "kind">): string {
  if (event.kind === "mark") return strings.events.mark;  // an instructor's, of the page alone
  const plain = event.kind.replaceAll("_", " ");
  return strings.eventKinds[event.kind] ?? plain.charAt(0).toUpperCase() + plain.slice(1);
}

/** The bus carries no personal names: a user of a page appears with role and number. */
function personOf(name: string): string {
  const role = /^(trainee|instructor|observer|admin)_[0-9a-f]{6}$/.exec(name)?.[1] as keyof typeof strings.roles | undefined;
  return role ? strings.roles[role] : name;
}

/** Subject, object, strength and further text. `named`: whose task it is, where several robots have the same ones. */
export function detailOf(event: SessionEvent, named = false): string {
  const object = (strings.instruct.faultKinds as Record<string, string>)[event.object] ?? event.object;
  const whom = (groupOf(event.kind) === "task" && !named ? [event.object] : [personOf(event.subject), object]).filter(Boolean).join(" – ");
  const impulse = event.impulse > 0 ? `${event.impulse.toFixed(1)}\u00a0N\u00a0s` : "";
  // The server's text is a sentence or an identifier.
  const text = event.text?.replaceAll("_", event.kind === "speed_limited" ? " " : "_");
  return [whom, impulse, text].filter(Boolean).join(" · ");
}
