/** The on-screen stick: a thumb's distance from its centre. The thumb on it is the dead-man. */
import { type DriveInput, releasedInput, shaped } from "./twist";

export interface Well { x: number; y: number; radius: number }

/** Position of the knob within the stick, -1..1 right and down. */
export function knob(well: Well, x: number, y: number): { x: number; y: number } {
  const dx = (x - well.x) / well.radius, dy = (y - well.y) / well.radius;
  const length = Math.hypot(dx, dy);
  if (!Number.isFinite(length)) return { x: 0, y: 0 };
  return length > 1 ? { x: dx / length, y: dy / length } : { x: dx, y: dy };
}

export function stickInput(at: { x: number; y: number } | null): DriveInput {
  if (!at) return releasedInput;
  return { held: true, forward: -shaped(at.y) || 0, left: 0, turn: -shaped(at.x) || 0 };
}
