/** Where the parts of an entity are, by the newest world frame. */
import type { PosedPart } from "./side_view";
import type { WorldFrame } from "../session/frames";
import type { Entity } from "../session/protocol";

const rows = new WeakMap<WorldFrame, Map<number, number>>();

function rowOf(world: WorldFrame, id: number): number | undefined {
  let map = rows.get(world);
  if (!map) rows.set(world, (map = new Map(Array.from(world.ids, (each, row) => [each, row]))));
  return map.get(id);
}

/** Those that the frame tells of; the entity's first part first. */
export function posesOf(entity: Entity | undefined, world: WorldFrame | null): PosedPart[] {
  if (!entity || !world) return [];
  return entity.parts.flatMap((part): PosedPart[] => {
    const row = rowOf(world, part.id);
    if (row === undefined) return [];
    const [x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 1] = world.poses.subarray(row * 7, row * 7 + 7);
    return [{ part, pose: { x, y, z, qx, qy, qz, qw } }];
  });
}
