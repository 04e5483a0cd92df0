/** The joints of a robot by what they do, and how fast each may go. */
import { strings } from "../strings.en";
import type { PadJoints } from "./pad";

export interface RobotJoint { name: string; kind?: string; lower?: number; upper?: number; speed?: number }

export type JointRole = keyof PadJoints | "head" | "other";

const roles: [RegExp, JointRole][] = [
  [/pan|tilt|head|mast|camera/, "head"],
  [/finger|grip|jaw|claw/, "gripper"],
  [/flipper/, "flippers"],
  [/turret|waist|swivel/, "turret"],
  [/shoulder|boom|lift/, "shoulder"],
  [/elbow|arm/, "elbow"],
  [/wrist|roll/, "wrist"],
];

export function roleOf(joint: string): JointRole {
  return roles.find(([pattern]) => pattern.test(joint.toLowerCase()))?.[1] ?? "other";
}

/** What a press moves: one joint, or both flippers as one, which stairs ask for. */
export interface Movable { name: string; joints: RobotJoint[] }

export function movables(joints: RobotJoint[]): Movable[] {
  const flippers = joints.filter(({ name }) => roleOf(name) === "flippers");
  const single = joints.map((joint) => ({ name: joint.name, joints: [joint] }));
  return flippers.length > 1 ? [{ name: strings.joints.bothFlippers, joints: flippers }, ...single] : single;
}

/** rad/s of a joint that turns, m/s of one that slides, where the robot does not say. */
export function speedOf(joint: RobotJoint): number {
  if (joint.speed && Number.isFinite(joint.speed)) return joint.speed;
  return joint.kind === "prismatic" ? 0.05 : 0.5;
}

/** Speeds asked of joints; those that stand are left out. `step`: share of their speed. */
export function jointCommand(joints: RobotJoint[], asked: Map<string, number>): { names: string[]; velocities: number[] } {
  const moving = joints.filter((joint) => asked.get(joint.name));
  return {
    names: moving.map((joint) => joint.name),
    velocities: moving.map((joint) => (asked.get(joint.name) ?? 0) * speedOf(joint)),
  };
}

/** What the pad asks of each joint; the first asked for wins over `also`, what the keyboard and the panel hold. */
export function askedOf(joints: RobotJoint[], pad: PadJoints, also: Map<string, number>): Map<string, number> {
  const asked = new Map(also);
  for (const { name } of joints) {
    const role = roleOf(name);
    if (role === "other" || role === "head" || !pad[role]) continue;
    // Closing moves both fingers together; if the robot has one joint for both, the second is geared to the
    // first.
    if (!asked.get(name)) asked.set(name, pad[role]);
  }
  return asked;
}
