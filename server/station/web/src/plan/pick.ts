/** Finds the entity at a point of the plan. */
import type { WorldFrame } from "../session/frames";
import { poseOf } from "../session/poses";
import type { Entity } from "../session/protocol";
import type { MapPoint } from "./tool.svelte";

/** The nearest within `reach` m; null: none. */
export function entityAt(entities: Entity[], world: WorldFrame | null, p: MapPoint, reach: number): Entity | null {
  let found: Entity | null = null, best = reach;
  for (const entity of entities) {
    const pose = poseOf(entity, world);
    if (!pose) continue;
    const distance = Math.hypot(pose.x - p.x, pose.y - p.y);
    if (distance > best) continue;
    best = distance;
    found = entity;
  }
  return found;
}
