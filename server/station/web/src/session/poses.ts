/** Look-ups in a world frame. */
import type { WorldFrame } from "./frames";
import type { Entity } from "./protocol";

const rows = new WeakMap<WorldFrame, Int32Array>();

/** Row of a part in the frame, or -1. */
export function rowOf(world: WorldFrame, part: number): number {
  let table = rows.get(world);
  if (!table) {
    table = new Int32Array(world.ids.reduce((largest, id) => Math.max(largest, id), -1) + 1).fill(-1);
    for (let row = 0; row < world.count; ++row) table[world.ids[row] as number] = row;
    rows.set(world, table);
  }
  return table[part] ?? -1;
}

export interface FlatPose { x: number; y: number; z: number; yaw: number; flags: number }

/** Position and heading of a row. */
export function flatPose(world: WorldFrame, row: number): FlatPose {
  const p = world.poses, k = row * 7;
  const qx = p[k + 3] as number, qy = p[k + 4] as number, qz = p[k + 5] as number, qw = p[k + 6] as number;
  return {
    x: p[k] as number, y: p[k + 1] as number, z: p[k + 2] as number,
    yaw: Math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz)), flags: world.flags[row] as number,
  };
}

/** Of an entity, by its first part; null if the frame does not contain it. */
export function poseOf(entity: Entity | undefined, world: WorldFrame | null): FlatPose | null {
  const part = entity?.parts[0];
  if (!part || !world) return null;
  const row = rowOf(world, part.id);
  return row < 0 ? null : flatPose(world, row);
}
