/** The joints of a robot by function, and their maximum speeds. */
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

/** The joints that one key moves: a single joint, or both flippers together, as for stairs. */
export interface MovableJoint { name: string; joints: RobotJoint[] }

export function movableJoints(joints: RobotJoint[]): MovableJoint[] {
  const flippers = joints.filter(({ name }) => roleOf(name) === "flippers");
  const single = joints.map((joint) => ({ name: joint.name, joints: [joint] }));
  return flippers.length > 1 ? [{ name: strings.joints.bothFlippers, joints: flippers }, ...single] : single;
}

/** Default speed: rad/s of a revolute joint, m/s of a prismatic one. */
export function speedOf(joint: RobotJoint): number {
  if (joint.speed && Number.isFinite(joint.speed)) return joint.speed;
  return joint.kind === "prismatic" ? 0.05 : 0.5;
}

/** Commanded joint speeds, without zeros. `step`: fraction of the maximum speed. */
export function jointCommand(joints: RobotJoint[], asked: Map<string, number>): { names: string[]; velocities: number[] } {
  const moving = joints.filter((joint) => asked.get(joint.name));
  return {
    names: moving.map((joint) => joint.name),
    velocities: moving.map((joint) => (asked.get(joint.name) ?? 0) * speedOf(joint)),
  };
}

/** Joint commands of the pad; they have priority over `also`, those of keyboard and panel. */
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
