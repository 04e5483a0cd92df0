/** Shapes seen from above. */
import type { Quaternion, Shape, Triple } from "../session/protocol";

/** Rotates v by q. */
export function turned(q: ArrayLike<number>, v: ArrayLike<number>): Triple {
  const qx = q[0] as number, qy = q[1] as number, qz = q[2] as number, qw = q[3] as number;
  const x = v[0] as number, y = v[1] as number, z = v[2] as number;
  const tx = 2 * (qy * z - qz * y), ty = 2 * (qz * x - qx * z), tz = 2 * (qx * y - qy * x);
  return [x + qw * tx + qy * tz - qz * ty, y + qw * ty + qz * tx - qx * tz, z + qw * tz + qx * ty - qy * tx];
}

/** Apply b, then a. */
export function product(a: ArrayLike<number>, b: ArrayLike<number>): Quaternion {
  const ax = a[0] as number, ay = a[1] as number, az = a[2] as number, aw = a[3] as number;
  const bx = b[0] as number, by = b[1] as number, bz = b[2] as number, bw = b[3] as number;
  return [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz];
}

export interface Placed { at: ArrayLike<number>; turn: ArrayLike<number> }

/** Either a circle or a convex polygon (x, y alternating), in the target frame of `place`. */
export type Outline = { circle: [x: number, y: number, radius: number] } | { polygon: number[] };

export function shapeOutline(shape: Shape, place: Placed): Outline {
  const offset = turned(place.turn, shape.at);
  const x = (place.at[0] as number) + offset[0], y = (place.at[1] as number) + offset[1];
  if (shape.shape === "sphere") return { circle: [x, y, shape.size[0]] };
  const q = product(place.turn, shape.turn);
  if (shape.shape === "box") return { polygon: hull(corners(q, shape.size[0] / 2, shape.size[1] / 2, shape.size[2] / 2, x, y)) };
  const radius = shape.size[0];
  const half = shape.size[2] / 2;
  const axis = turned(q, [0, 0, half]);
  if (Math.hypot(axis[0], axis[1]) < 0.02) return { circle: [x, y, radius] };
  // Lying or inclined: a bounding box is accurate enough from above.
  return { polygon: hull(corners(q, radius, radius, half + (shape.shape === "capsule" ? radius : 0), x, y)) };
}

function corners(q: Quaternion, hx: number, hy: number, hz: number, x: number, y: number): number[] {
  const points: number[] = [];
  const upright = Math.abs(q[0]) < 1e-3 && Math.abs(q[1]) < 1e-3;
  for (const sz of upright ? [1] : [-1, 1])
    for (const [sx, sy] of [[-1, -1], [1, -1], [1, 1], [-1, 1]] as const) {
      const c = turned(q, [sx * hx, sy * hy, sz * hz]);
      points.push(x + c[0], y + c[1]);
    }
  return points;
}

/** Convex hull (Andrew's monotone chain), counter-clockwise. */
export function hull(points: number[]): number[] {
  if (points.length <= 8) return points;
  const sorted: [number, number][] = [];
  for (let i = 0; i < points.length; i += 2) sorted.push([points[i] as number, points[i + 1] as number]);
  sorted.sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (list: [number, number][]) => {
    const chain: [number, number][] = [];
    for (const p of list) {
      while (chain.length > 1) {
        const a = chain[chain.length - 2] as [number, number], b = chain[chain.length - 1] as [number, number];
        if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
        chain.pop();
      }
      chain.push(p);
    }
    chain.pop();
    return chain;
  };
  return [...half(sorted), ...half(sorted.reverse())].flat();
}
