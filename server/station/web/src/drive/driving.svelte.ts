/** Input devices of the operator: keyboard, game pad and on-screen stick, and the commands made from them. When the
 * page loses the operator (another window, a hidden tab, a lost connection), all inputs are released. */
import { dialogues } from "../parts/dialogue.svelte";
import { plan } from "../plan/tool.svelte";
import { askedOf, jointCommand, movableJoints } from "./joints";
import { HeldKeys, takesKeys, type DriveKey } from "./keys";
import { PadDrive, type PadCommand } from "./pad";
import { DriveSender } from "./sender";
import { session } from "../session/session.svelte";
import { stickInput } from "./stick";
import { emergencyStop, stopState } from "./stop.svelte";
import { teleop } from "./teleop.svelte";
import { chosen, clampStep, firstStep, twistOf, type Twist } from "./twist";

/** ms between polls of the pad; keys are handled at once. */
const lookEvery = 10;

class Driving {
  step = $state(firstStep);
  /** A dead-man is held. */
  held = $state(false);
  twist = $state.raw<Twist>({ vx: 0, vy: 0, wz: 0 });
  /** Name of the game pad in use; empty: none. */
  pad = $state("");
  /** Name of the joint, or of those (`movableJoints`), that R and F move. */
  joint = $state("");
  /** The on-screen stick, -1..1 right and down; null: not touched. */
  stick = $state.raw<{ x: number; y: number } | null>(null);
  /** Joint commands of the panel's buttons, -1..1. */
  jointButtons = $state.raw<Map<string, number>>(new Map());

  #keys = new HeldKeys();
  #pad = new PadDrive();
  #sender = new DriveSender();
  #stopListening: (() => void) | undefined;

  start() {
    if (this.#stopListening) return;
    teleop.start(() => this.releaseControl());
    const listening = new AbortController();
    const { signal } = listening;
    addEventListener("keydown", (event) => this.#keyDown(event), { signal });
    addEventListener("keyup", (event) => this.#keyUp(event), { signal });
    addEventListener("blur", () => this.releaseControl(), { signal });
    addEventListener("pagehide", () => this.releaseControl(), { signal });
    document.addEventListener("visibilitychange", () => document.hidden && this.releaseControl(), { signal });
    const timer = setInterval(() => this.#look(), lookEvery);
    this.#stopListening = () => {
      listening.abort();
      clearInterval(timer);
    };
  }
  stop() {
    this.releaseControl();
    this.#stopListening?.();
    this.#stopListening = undefined;
    teleop.stop();
  }

  /** All inputs must be pressed again, and the server receives a release. */
  releaseControl() {
    this.#releaseHands();
    this.#sender.restart();
    this.#look();
  }

  setStick(at: { x: number; y: number } | null) {
    this.stick = at;
    this.#look();
  }
  /** A button of the panel is held (-1 or 1) or released (0). */
  moveJoint(name: string, direction: number) {
    const buttons = new Map(this.jointButtons);
    if (direction) buttons.set(name, direction);
    else buttons.delete(name);
    this.jointButtons = buttons;
    this.#look();
  }
  chooseJoint(by: number) {
    const all = movableJoints(teleop.robot?.joints ?? []);
    if (all.length === 0) return;
    const at = all.findIndex((each) => each.name === this.joint);
    this.joint = all[(Math.max(at, by < 0 ? 0 : -1) + by + all.length) % all.length]!.name;
  }

  #keyDown(event: KeyboardEvent) {
    if (event.defaultPrevented || takesKeys(event.target as HTMLElement | null)) return;
    const key = this.#keys.press(event);
    if (!key) return;
    if (key.startsWith("joint") || ["forward", "backward", "left", "right"].includes(key)) event.preventDefault();
    this.#once(key);
    this.#look();
  }
  #keyUp(event: KeyboardEvent) {
    if (this.#keys.release(event.code)) this.#look();
  }
  #once(key: DriveKey) {
    switch (key) {
      case "faster": this.step = clampStep(this.step + 1); break;
      case "slower": this.step = clampStep(this.step - 1); break;
      case "nextRobot": teleop.driveNext(); break;
      case "nextJoint": this.chooseJoint(1); break;
      case "previousJoint": this.chooseJoint(-1); break;
    }
  }

  #look() {
    // After a stop, inputs held before it no longer drive.
    if (stopState.latched) this.#releaseHands();
    const pad = this.#lookAtPad();
    const input = chosen([this.#keys.input(), pad.drive, stickInput(this.stick)]);
    const robot = teleop.robot;
    const held = input.held && robot !== undefined && !session.ended && !plan.tool && !dialogues.open;
    if (held && session.pastTime !== null) session.lookBack(null);  // nobody drives by a past view
    const twist = robot && held ? twistOf(input, robot.limits, this.step) : { vx: 0, vy: 0, wz: 0 };
    const joints = robot ? jointCommand(robot.joints, askedOf(robot.joints, pad.joints, this.#jointsAsked())) : { names: [], velocities: [] };
    if (robot) teleop.send(this.#sender.step(performance.now(), held, twist, joints));
    this.held = held || joints.names.length > 0;
    if (twist.vx !== this.twist.vx || twist.vy !== this.twist.vy || twist.wz !== this.twist.wz) this.twist = twist;
  }
  #releaseHands() {
    this.#keys.releaseAll();
    this.#pad.restart();
    this.stick = null;
    if (this.jointButtons.size) this.jointButtons = new Map();
  }
  #jointsAsked(): Map<string, number> {
    const asked = new Map<string, number>(), key = this.#keys.joint();
    for (const { name, joints } of movableJoints(teleop.robot?.joints ?? [])) {
      const direction = (name === this.joint && key) || this.jointButtons.get(name);
      if (direction) for (const joint of joints) asked.set(joint.name, direction);
    }
    return asked;
  }
  #lookAtPad(): PadCommand {
    const pad = document.hidden ? undefined : navigator.getGamepads?.().find((each) => each?.connected && each.mapping === "standard");
    const command = this.#pad.command(pad ?? null);
    if (this.pad !== (pad?.id ?? "")) this.pad = pad?.id ?? "";
    if (command.nextRobot) teleop.driveNext();
    if (command.stop) emergencyStop();
    return command;
  }
}

export const driving = new Driving();
