/** `seen` of a request: by it the server notices that the connection has delayed it. */
import type { Ask, Control } from "./protocol";

/** What the server refuses if it comes late: by then the page has reported that it failed, and who asked may have
 * asked again. A scenario that is saved late is only saved again. */
const TIMED: ReadonlySet<Ask["type"]> = new Set<Ask["type"]>(["agent", "script", "fault", "start", "end", "report", "chat", "mark", "control", "estop_release"]);

/** The clock of the newest `control`; nothing if there is none yet. */
export function seenAt(message: Pick<Ask, "type">, control: Pick<Control, "clock"> | null): { seen?: number } {
  return TIMED.has(message.type) && control ? { seen: control.clock } : {};
}
