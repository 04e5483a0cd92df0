/** The commands of the operator's inputs, and the resulting twist of a robot. */

/** m/s forward and left, rad/s counter-clockwise, in the robot's frame. */
export interface Twist { vx: number; vy: number; wz: number }

/** Fractions of the robot's maximum, -1..1; `held`: the dead-man of this device is held, otherwise all are zero. */
export interface DriveInput { held: boolean; forward: number; left: number; turn: number }

export const releasedInput: DriveInput = { held: false, forward: 0, left: 0, turn: 0 };

/** Speed steps as in the terminal's keyboard console; the initial step is half of them. */
export const speedSteps = 10;
export const firstStep = speedSteps / 2;

export function clampStep(step: number): number {
  return Math.min(speedSteps, Math.max(1, Math.round(step)));
}

/** 0 within the dead zone, 1 at the end, |.|^curve between; odd in x. Not finite: 0. */
export function shaped(x: number, deadZone = 0.12, curve = 1.5): number {
  if (!Number.isFinite(x) || Math.abs(x) <= deadZone) return 0;
  const fraction = Math.min(1, (Math.abs(x) - deadZone) / (1 - deadZone));
  return Math.sign(x) * fraction ** curve;
}

const unit = (x: number): number => (Number.isFinite(x) ? Math.min(1, Math.max(-1, x)) : 0);

/** `limits`: the robot's limits at the highest step. */
export function twistOf(input: DriveInput, limits: Twist, step: number): Twist {
  if (!input.held) return { vx: 0, vy: 0, wz: 0 };
  const fraction = clampStep(step) / speedSteps;
  const scaled = (x: number, limit: number): number => unit(x) * limit * fraction || 0;
  return { vx: scaled(input.forward, limits.vx), vy: scaled(input.left, limits.vy), wz: scaled(input.turn, limits.wz) };
}

/** The first device whose dead-man is held drives; commands of two devices are not added. */
export function chosen(inputs: DriveInput[]): DriveInput {
  return inputs.find((input) => input.held) ?? releasedInput;
}
