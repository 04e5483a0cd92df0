/** A game pad (Gamepad API, standard mapping) as a console, mapped as in server/station/console/mappings. The left
 * shoulder button is the dead-man. It counts only after it was seen released since the pad was plugged in or the
 * page regained the focus. */
import { type DriveInput, releasedInput, shaped } from "./twist";

/** The part of the browser's Gamepad that is used. */
export interface PadState {
  axes: readonly number[];
  buttons: readonly { pressed: boolean; value: number }[];
}

const button = { a: 0, b: 1, x: 2, y: 3, leftShoulder: 4, rightShoulder: 5, back: 8, start: 9, up: 12, down: 13, left: 14, right: 15 };
const slowFraction = 1 / 3;

/** Joints by function, -1..1 of their speed. */
export interface PadJoints { turret: number; shoulder: number; elbow: number; wrist: number; gripper: number; flippers: number }

export interface PadCommand { drive: DriveInput; joints: PadJoints; nextRobot: boolean; stop: boolean }

const still: PadJoints = { turret: 0, shoulder: 0, elbow: 0, wrist: 0, gripper: 0, flippers: 0 };

export class PadDrive {
  private seenReleased = false;
  private nextWasDown = true;
  private stopWasDown = true;

  /** The pad was unplugged, or the page lost the focus. */
  restart(): void {
    this.seenReleased = false;
    this.nextWasDown = true;
    this.stopWasDown = true;
  }

  command(pad: PadState | null): PadCommand {
    if (!pad) {
      this.restart();
      return { drive: releasedInput, joints: still, nextRobot: false, stop: false };
    }
    const down = (index: number): boolean => pad.buttons[index]?.pressed ?? false;
    const held = down(button.leftShoulder);
    if (!held) this.seenReleased = true;
    const nextRobot = down(button.start) && !this.nextWasDown;
    const stop = down(button.back) && !this.stopWasDown;
    this.nextWasDown = down(button.start);
    this.stopWasDown = down(button.back);
    if (!held || !this.seenReleased) return { drive: releasedInput, joints: still, nextRobot, stop };
    const slow = down(button.rightShoulder) ? slowFraction : 1;
    const axis = (index: number): number => -shaped(pad.axes[index] ?? 0) * slow || 0;
    const pair = (up: number, low: number): number => (Number(down(up)) - Number(down(low))) * slow;
    return {
      drive: { held: true, forward: axis(1), left: 0, turn: axis(0) },
      joints: {
        turret: axis(2), shoulder: axis(3),
        elbow: pair(button.up, button.down), wrist: pair(button.right, button.left),
        gripper: pair(button.a, button.b), flippers: pair(button.y, button.x),
      },
      nextRobot,
      stop,
    };
  }
}
