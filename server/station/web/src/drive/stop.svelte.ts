/** The emergency stop: on every screen of every permitted role, by a button, Escape and Space. It is sent on both
 * connections, so that the loss of one does not matter. */
import { dialogues } from "../parts/dialogue.svelte";
import { inPopup } from "../parts/popup";
import { plan } from "../plan/tool.svelte";
import { session } from "../session/session.svelte";
import { isTyping, takesKeys } from "./keys";
import { teleop } from "./teleop.svelte";

class StopState {
  /** Neither connection accepted the last one; somebody beside the robot must be told. */
  failed = $state(false);
  /** The stops that count here: of several robots a trainee's own. */
  #own = $derived([...teleop.stops].filter(([robot]) => session.robots.length < 2 || session.instructs || robot === (teleop.driven || session.robot)));
  latched = $derived(this.#own.length > 0 || (session.robots.length < 2 && (session.control?.estop ?? false)));
  by = $derived([...new Set(this.#own.map(([, by]) => by))].join(", "));
}
export const stopState = new StopState();

/** Stops the robot of this name; empty: all robots. */
export function stopRobot(robot: string) {
  const named = robot ? { robot } : {};
  const overTeleop = teleop.emergencyStop(robot), overState = session.send({ type: "estop", ...named });
  stopState.failed = !overTeleop && !overState;
}

/** Of several robots a trainee stops the one that he drives or follows, an instructor all. */
export function emergencyStop() {
  const one = session.robots.length > 1 && !session.instructs;
  stopRobot(one ? teleop.driven || session.robot : "");
}

/** Space activates the focused control only if Tab moved the focus there; after a click or a driving key it stops. */
class StopKeys {
  private tabbed = false;

  /** True: stop. */
  press(event: KeyboardEvent): boolean {
    if (event.ctrlKey || event.altKey || event.metaKey) return false;
    if (event.code === "Tab") this.tabbed = true;
    else if (/^(Key[WASD]|Arrow)/.test(event.code) && !takesKeys(event.target as HTMLElement | null)) this.tabbed = false;
    // Driving is disabled while a dialogue is open or the focus is in a menu: Escape closes them.
    if (event.code === "Escape") return plan.tool === null && dialogues.open === null && !inPopup(event.target);
    return event.code === "Space" && !this.tabbed && !isTyping(event.target as HTMLElement | null);
  }
  point() {
    this.tabbed = false;
  }
}

/** Active until the returned function is called. Runs before all other handlers, so that no panel can intercept the
 * key. */
export function listenForStop(): () => void {
  const keys = new StopKeys();
  const listening = new AbortController(), options = { signal: listening.signal, capture: true };
  let swallow = false;
  addEventListener("keydown", (event) => {
    if (!keys.press(event)) return;
    swallow = event.code === "Space";
    event.preventDefault();
    event.stopPropagation();
    if (!event.repeat) emergencyStop();
  }, options);
  // A button is activated when Space is released.
  addEventListener("keyup", (event) => {
    if (event.code === "Space" && swallow) event.preventDefault();
    if (event.code === "Space") swallow = false;
  }, options);
  addEventListener("pointerdown", () => keys.point(), options);
  return () => listening.abort();
}
