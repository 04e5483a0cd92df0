/** Gestures on the plan: a press sets the position, a drag the heading. Pure: metres in map. */
import type { MapPoint } from "./palette";

export interface Placement { at: MapPoint; yaw: number }

/** m: a shorter drag than this is a click. */
const leastDrag = 0.15;

/** Pose from a press and a drag; without a drag the heading is `yaw`. */
export function placement(from: MapPoint, to: MapPoint, yaw: number): Placement {
  const dx = to.x - from.x, dy = to.y - from.y;
  return { at: from, yaw: Math.hypot(dx, dy) < leastDrag ? yaw : Math.atan2(dy, dx) };
}

/** The outline of an object of this size. */
export function outline({ at, yaw }: Placement, size: readonly number[]): [number, number][] {
  const [length = 0.5, width = 0.5] = size, c = Math.cos(yaw), s = Math.sin(yaw);
  const corners: [number, number][] = [[1, 1], [-1, 1], [-1, -1], [1, -1]];
  return corners.map(([i, j]) => {
    const x = (i * length) / 2, y = (j * width) / 2;
    return [at.x + c * x - s * y, at.y + s * x + c * y];
  });
}

/** The path with one more point; null: the point equals the last one, which ends the path. */
export function pathWith(path: readonly [number, number][], point: MapPoint): [number, number][] | null {
  const last = path.at(-1);
  if (last && Math.hypot(point.x - last[0], point.y - last[1]) < leastDrag) return null;
  return [...path, [point.x, point.y]];
}
