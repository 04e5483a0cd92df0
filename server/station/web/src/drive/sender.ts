/** When commands are sent to the server: at once on a change, at 20 Hz while a dead-man is held, and one `release`
 * when all are released. The server has a timeout on wheels and on joints: after a joint command, both are sent
 * until the release. Pure: instants (ms) are arguments. */
import type { Twist } from "./twist";

export interface JointSpeeds { names: string[]; velocities: number[] }

export type TeleopMessage =
  | { type: "twist"; seq: number; at_ms: number; vx: number; vy: number; wz: number }
  | ({ type: "joints"; seq: number; at_ms: number } & JointSpeeds)
  | { type: "release" };

/** command_period of protocols/driving_timing.hpp: the server treats 300 ms of silence as a release. */
export const beat = 50;
/** Between two changes, because a thumb on a stick changes in each frame of a fast screen. */
const soonest = 10;

const same = (a: Twist, b: Twist): boolean => a.vx === b.vx && a.vy === b.vy && a.wz === b.wz;

class Beat<Value> {
  private value: Value | undefined;
  private at = -Infinity;
  constructor(private readonly equal: (a: Value, b: Value) => boolean) {}

  isDue(now: number, value: Value): boolean {
    const due = this.value === undefined || now - this.at >= (this.equal(value, this.value) ? beat : soonest);
    if (due) [this.value, this.at] = [value, now];
    return due;
  }
  restart(): void {
    this.value = undefined;
  }
}

export class DriveSender {
  private seq = 0;
  private held = false;
  /** The server waits for a release before anything moves. */
  private owesRelease = true;
  private moved = new Map<string, number>();
  private twists = new Beat<Twist>(same);
  private joints = new Beat<string>((a, b) => a === b);

  /** The messages to send now. `held`: a dead-man is held; `asked`: joint commands. */
  step(now: number, held: boolean, twist: Twist, asked: JointSpeeds): TeleopMessage[] {
    if (!held && asked.names.length === 0) return this.release();
    this.held = true;
    const messages: TeleopMessage[] = [];
    if (this.twists.isDue(now, twist)) messages.push({ type: "twist", seq: ++this.seq, at_ms: now, ...twist });
    for (const name of this.moved.keys()) this.moved.set(name, 0);
    asked.names.forEach((name, i) => this.moved.set(name, asked.velocities[i] ?? 0));
    if (this.moved.size && this.joints.isDue(now, JSON.stringify([...this.moved])))
      messages.push({ type: "joints", seq: ++this.seq, at_ms: now, names: [...this.moved.keys()], velocities: [...this.moved.values()] });
    return messages;
  }
  /** The connection or the robot is new, or the server stopped the robot. */
  restart(): void {
    this.owesRelease = true;
  }

  private release(): TeleopMessage[] {
    const messages: TeleopMessage[] = this.held || this.owesRelease ? [{ type: "release" }] : [];
    this.held = false;
    this.owesRelease = false;
    this.moved.clear();
    this.twists.restart();
    this.joints.restart();
    return messages;
  }
}
