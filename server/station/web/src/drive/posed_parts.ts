/** Poses of an entity's solids in the newest world frame. */
import { product, turned } from "../plan/outline";
import type { WorldFrame } from "../session/frames";
import { rowOf } from "../session/poses";
import type { Entity, Part, Shape } from "../session/protocol";
import type { Pose, PosedPart } from "./side_view";

/** `base`: its first part; null, without solids, if the frame does not contain it. */
export function posesOf(entity: Entity | undefined, world: WorldFrame | null, shapesOf: (part: Part) => Shape[]): { base: Pose | null; parts: PosedPart[] } {
  let base: Pose | null = null;
  const parts: PosedPart[] = [];
  for (const part of world ? (entity?.parts ?? []) : []) {
    const row = rowOf(world as WorldFrame, part.id);
    if (row < 0) continue;
    const [x = 0, y = 0, z = 0, ...q] = (world as WorldFrame).poses.subarray(row * 7, row * 7 + 7);
    base ??= pose([x, y, z], q);
    for (const { shape, size, colour, at, turn } of shapesOf(part)) {
      const offset = turned(q, at);
      parts.push({ name: part.name, shape, size, colour, pose: pose([x + offset[0], y + offset[1], z + offset[2]], product(q, turn)) });
    }
  }
  return { base, parts };
}

function pose([x = 0, y = 0, z = 0]: number[], [qx = 0, qy = 0, qz = 0, qw = 1]: number[]): Pose {
  return { x, y, z, qx, qy, qz, qw };
}
