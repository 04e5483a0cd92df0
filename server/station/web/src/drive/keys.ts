/** A keyboard as a console. A driving key is its own dead-man: releasing it stops. Keys are identified by position
 * (KeyboardEvent.code), so that WASD are adjacent on every layout. */
import { type DriveInput, releasedInput } from "./twist";

export type DriveKey =
  | "forward" | "backward" | "left" | "right"
  | "faster" | "slower" | "nextRobot"
  | "nextJoint" | "previousJoint" | "jointUp" | "jointDown";

const keys: Record<string, DriveKey> = {
  KeyW: "forward", ArrowUp: "forward",
  KeyS: "backward", ArrowDown: "backward",
  KeyA: "left", ArrowLeft: "left",
  KeyD: "right", ArrowRight: "right",
  Equal: "faster", NumpadAdd: "faster", BracketRight: "nextJoint", BracketLeft: "previousJoint",
  Minus: "slower", NumpadSubtract: "slower",
  KeyN: "nextRobot", KeyR: "jointUp", KeyF: "jointDown",
};

export interface KeyPress { code: string; repeat: boolean; ctrlKey: boolean; altKey: boolean; metaKey: boolean }

export function keyOf(press: Pick<KeyPress, "code">): DriveKey | undefined {
  return keys[press.code];
}

const drives = new Set<DriveKey>(["forward", "backward", "left", "right", "jointUp", "jointDown"]);

/** The keys that are held. */
export class HeldKeys {
  private held = new Set<string>();

  /** The action of a press, once: repeats and browser shortcuts have none. */
  press(press: KeyPress): DriveKey | undefined {
    if (press.ctrlKey || press.altKey || press.metaKey || press.repeat) return undefined;
    const key = keyOf(press);
    if (key && drives.has(key)) this.held.add(press.code);
    return key;
  }
  /** True: it was held. */
  release(code: string): boolean {
    return this.held.delete(code);
  }
  /** The page lost the focus: held keys must be pressed again. */
  releaseAll(): void {
    this.held.clear();
  }

  private isHeld(key: DriveKey): number {
    for (const code of this.held) if (keys[code] === key) return 1;
    return 0;
  }
  input(): DriveInput {
    const any = ["forward", "backward", "left", "right"].some((key) => this.isHeld(key as DriveKey));
    if (!any) return releasedInput;
    const forward = this.isHeld("forward") - this.isHeld("backward");
    const turn = this.isHeld("left") - this.isHeld("right");
    // In reverse, the wheel turns as in a car.
    return { held: true, forward, left: 0, turn: forward < 0 ? -turn : turn };
  }
  /** -1, 0 or 1: the selected joint. */
  joint(): number {
    return this.isHeld("jointUp") - this.isHeld("jointDown");
  }
}

interface Focused { tagName: string; type?: string; isContentEditable?: boolean; role?: string | null }

/** True if the focus is in a text field. */
export function isTyping(target: Focused | null): boolean {
  if (!target) return false;
  if (target.isContentEditable || target.tagName === "TEXTAREA") return true;
  return target.tagName === "INPUT" && !["checkbox", "radio", "range", "button", "submit"].includes(target.type ?? "text");
}

/** True if it handles letters or arrows itself. */
export function takesKeys(target: Focused | null): boolean {
  if (!target) return false;
  return isTyping(target) || target.tagName === "SELECT" || (target.tagName === "INPUT" && ["radio", "range"].includes(target.type ?? ""))
    || ["tab", "slider", "option", "application"].includes(target.role ?? "");
}
