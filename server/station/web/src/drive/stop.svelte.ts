/** The emergency stop: on every screen of every permitted role, by a button, X and Pause. It is sent on both
 * connections, so that the loss of one does not matter. */
import { session } from "../session/session.svelte";
import { isTyping, takesKeys } from "./keys";
import { teleop } from "./teleop.svelte";

class StopState {
  /** Neither connection accepted the last one; somebody beside the robot must be told. */
  failed = $state(false);
  /** The stops that count here: of several robots a trainee's own. */
  #own = $derived([...teleop.stops].filter(([robot]) => session.robots.length < 2 || session.instructs || robot === (teleop.driven || session.robot)));
  latched = $derived(this.#own.length > 0 || (session.robots.length < 2 && (session.control?.estop ?? false)));
  /** The user may release it: an instructor any, a trainee his own stop of a simulated robot. */
  releasable = $derived(session.instructs || ((session.hello?.session.level ?? 3) < 3 && this.#own.length > 0 && this.#own.every(([, by]) => by === session.hello?.who.name)));
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

/** Keys that stop whatever has the focus, but that letters are typed in text fields; nothing else uses them. */
function isStop(event: KeyboardEvent): boolean {
  if (event.ctrlKey || event.altKey || event.metaKey) return false;
  return event.code === "Pause" || (event.code === "KeyX" && !isTyping(event.target as HTMLElement | null));
}

/** Space brakes. It activates the focused control instead if Tab moved the focus there; after a click or a driving
 * key it brakes. */
class BrakeKey {
  private tabbed = false;

  /** True: brake. */
  press(event: KeyboardEvent): boolean {
    if (event.ctrlKey || event.altKey || event.metaKey) return false;
    if (event.code === "Tab") this.tabbed = true;
    else if (/^(Key[WASD]|Arrow)/.test(event.code) && !takesKeys(event.target as HTMLElement | null)) this.tabbed = false;
    return event.code === "Space" && !this.tabbed && !isTyping(event.target as HTMLElement | null);
  }
  point() {
    this.tabbed = false;
  }
}

/** Active until the returned function is called. Runs before all other handlers, so that no panel can intercept the
 * keys. `brake`: releases all that drives. */
export function listenForStop(brake: () => void): () => void {
  const brakeKey = new BrakeKey();
  const listening = new AbortController(), options = { signal: listening.signal, capture: true };
  let swallow = false;
  addEventListener("keydown", (event) => {
    const stops = isStop(event), brakes = brakeKey.press(event);
    if (!stops && !brakes) return;
    swallow = brakes;
    event.preventDefault();
    event.stopPropagation();
    if (stops && !event.repeat) emergencyStop();
    if (brakes) brake();
  }, options);
  // A button is activated when Space is released.
  addEventListener("keyup", (event) => {
    if (event.code === "Space" && swallow) event.preventDefault();
    if (event.code === "Space") swallow = false;
  }, options);
  addEventListener("pointerdown", () => brakeKey.point(), options);
  return () => listening.abort();
}
