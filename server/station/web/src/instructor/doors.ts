/** Manual control of doors: their commands, and the door at a position on the plan. */
import type { MapPoint } from "./palette";

export type DoorState = "closed" | "ajar" | "open" | "unknown";
/** Opening angle, rad; undefined: from the sensors. */
export const openings: Record<DoorState, number | undefined> = { closed: 0, ajar: 0.5, open: 1.5, unknown: undefined };
export const doorStates = Object.keys(openings) as DoorState[];

export interface DoorPlace { name: string; x: number; y: number }
/** m from the click to the middle of the leaf. */
const reach = 1.5;

/** The nearest door within reach; null: none. */
export function doorAt(doors: readonly DoorPlace[], at: MapPoint): DoorPlace | null {
  let found: DoorPlace | null = null, best = reach;
  for (const door of doors) {
    const distance = Math.hypot(door.x - at.x, door.y - at.y);
    if (distance > best) continue;
    best = distance;
    found = door;
  }
  return found;
}
