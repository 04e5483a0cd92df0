/** A robot from its right side, upright with respect to gravity: each part's outline in metres forward and up from
 * the robot's origin. */
import type { ShapeKind } from "../session/protocol";

export interface Pose { x: number; y: number; z: number; qx: number; qy: number; qz: number; qw: number }
/** A simple solid; `pose` is that of its centre. Sizes as in `Shape`. */
export interface PosedPart { name: string; shape: ShapeKind; size: readonly number[]; colour: readonly number[]; pose: Pose }
export interface Outline { name: string; points: [number, number][]; colour: readonly number[]; lateral: number }

type Point = [number, number, number];

const circle = Array.from({ length: 16 }, (_, i) => [Math.cos((i * Math.PI) / 8), Math.sin((i * Math.PI) / 8)] as const);

/** Points whose convex hull is the shape, in its own frame. */
function surface({ shape, size }: PosedPart): Point[] {
  const [a = 0, b = 0, c = 0] = size;
  switch (shape) {
    case "box":
      return [-1, 1].flatMap((i) => [-1, 1].flatMap((j) => [-1, 1].map((k): Point => [(i * a) / 2, (j * b) / 2, (k * c) / 2])));
    case "sphere":
      return [...circle.map(([u, v]): Point => [a * u, a * v, 0]), ...circle.map(([u, v]): Point => [a * u, 0, a * v]), ...circle.map(([u, v]): Point => [0, a * u, a * v])];
    case "cylinder":
      return [-c / 2, c / 2].flatMap((z) => circle.map(([u, v]): Point => [a * u, a * v, z]));
    case "capsule":
      return [-1, 1].flatMap((end) => circle.flatMap(([u, v]): Point[] => [[a * u, a * v, (end * c) / 2], [a * u, 0, (end * c) / 2 + end * Math.abs(a * v)]]));
  }
}

function turned({ qx, qy, qz, qw }: Pose, [x, y, z]: Point): Point {
  // v + 2 q x (q x v + w v)
  const cx = qy * z - qz * y + qw * x, cy = qz * x - qx * z + qw * y, cz = qx * y - qy * x + qw * z;
  return [x + 2 * (qy * cz - qz * cy), y + 2 * (qz * cx - qx * cz), z + 2 * (qx * cy - qy * cx)];
}

/** Counter-clockwise hull (Andrew's monotone chain). */
export function hull(points: [number, number][]): [number, number][] {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (from: [number, number][]): [number, number][] => {
    const chain: [number, number][] = [];
    for (const p of from) {
      for (;;) {
        const b = chain.at(-1), a = chain.at(-2);
        if (!a || !b || (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
        chain.pop();
      }
      chain.push(p);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

export function headingOf({ qx, qy, qz, qw }: Pose): number {
  return Math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz));
}

/** `base`: the robot's own part; its position is the origin, and its heading is forward. Farthest first. */
export function sideView(parts: PosedPart[], base: Pose): Outline[] {
  const heading = headingOf(base), c = Math.cos(heading), s = Math.sin(heading);
  return parts
    .map((part): Outline => {
      const { pose } = part;
      const dx = pose.x - base.x, dy = pose.y - base.y;
      const points = surface(part).map((point): [number, number] => {
        const [x, y, z] = turned(pose, point);
        return [c * (dx + x) + s * (dy + y), pose.z - base.z + z];
      });
      return { name: part.name, points: hull(points), colour: part.colour, lateral: -s * dx + c * dy };
    })
    .sort((a, b) => b.lateral - a.lateral);
}

/** Extent of the drawing in metres: left, bottom, width, height, with a margin. */
export function viewBox(outlines: Outline[], margin = 0.1): [number, number, number, number] {
  const points = outlines.flatMap((outline) => outline.points);
  if (points.length === 0) return [-0.5, 0, 1, 1];
  const xs = points.map(([x]) => x), zs = points.map(([, z]) => z);
  const left = Math.min(...xs) - margin, bottom = Math.min(...zs) - margin;
  return [left, bottom, Math.max(...xs) + margin - left, Math.max(...zs) + margin - bottom];
}
