/** Paths of robots in the last minute, for drawing. */
import type { WorldFrame } from "./frames";
import { poseOf } from "./poses";
import type { Entity } from "./protocol";

interface Trail { points: number[]; times: number[] }
const KEPT_S = 60, STEP_M = 0.08, JUMP_M = 1.5, MOST = 40;

export class Trails {
  readonly of = new Map<string, Trail>();
  #last = -Infinity;

  /** A frame older than the last one (a seek) clears them. */
  take(entities: Entity[], world: WorldFrame) {
    if (world.t < this.#last) this.of.clear();
    this.#last = world.t;
    let taken = 0;
    for (const entity of entities) {
      if (entity.kind !== "robot" || ++taken > MOST) continue;
      const pose = poseOf(entity, world);
      if (pose) this.#add(entity.name, pose.x, pose.y, world.t);
    }
  }

  #add(name: string, x: number, y: number, t: number) {
    let trail = this.of.get(name);
    if (!trail) this.of.set(name, (trail = { points: [], times: [] }));
    const n = trail.points.length;
    const moved = n ? Math.hypot(x - (trail.points[n - 2] as number), y - (trail.points[n - 1] as number)) : Infinity;
    if (moved > JUMP_M) trail.points.length = trail.times.length = 0;  // it was repositioned: no path in between
    if (moved >= STEP_M) {
      trail.points.push(x, y);
      trail.times.push(t);
    }
    let old = 0;
    while (old < trail.times.length && (trail.times[old] as number) < t - KEPT_S) ++old;
    if (old) {
      trail.times.splice(0, old);
      trail.points.splice(0, 2 * old);
    }
  }
}
