import { BakedSolids } from "../../../../server/station/web/src/view3d/baked_solids";
import type { SolidKind } from "../../../../server/station/web/src/view3d/forms";

type Point = [number, number, number];
interface Attribute { array: ArrayLike<number> }
interface Drawn { geometry: { getAttribute(name: string): Attribute; getIndex(): Attribute; drawRange: { count: number } } }

/** Full lengths 2, 1 and 0.5, rotated by 90 degrees about z, at (3, 4, 5). */
const place = Float64Array.of(0, 2, 0, -1, 0, 0, 0, 0, 0.5, 3, 4, 5);
const middle: Point = [3, 4, 5];
const minus = (a: Point, b: Point): Point => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const cross = (a: Point, b: Point): Point => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a: Point, b: Point) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

function baked(kind: SolidKind, [x, y, z]: Point, times = 1) {
  const solids = new BakedSolids();
  solids.begin({ x, y, z });
  for (let i = 0; i < times; ++i) solids.put(kind, place, 1, 0.5, 0.25);
  solids.end();
  const { geometry } = solids.group.children[0] as unknown as Drawn;
  const at = geometry.getAttribute("position").array, index = geometry.getIndex().array;
  const point = (i: number) => [0, 1, 2].map((axis) => at[(index[i] as number) * 3 + axis]) as Point;
  const triangles = Array.from({ length: geometry.drawRange.count / 3 }, (_, i) => [point(3 * i), point(3 * i + 1), point(3 * i + 2)] as const);
  return { triangles, colours: geometry.getAttribute("color").array };
}

describe("solids that are moved and lit by the page", () => {
  test("of a box, the three faces that are turned to the eye", () => {
    const { triangles } = baked("box", [13, 14, 15]);
    expect(triangles.length).toBe(6);
    for (const point of triangles.flat()) expect(minus(point, middle).map(Math.abs)).toEqual([0.5, 1, 0.25]);
  });

  test.each(["box", "cylinder", "sphere"] as const)("what is left of a %s is wound counter-clockwise as the eye sees it", (kind) => {
    for (const eye of [[13, 14, 15], [-2, 4, 5.1], [3, 4, -7]] as Point[]) {
      const { triangles } = baked(kind, eye);
      let seen = 0;
      for (const [a, b, c] of triangles) {
        const out = cross(minus(b, a), minus(c, a));
        if (Math.hypot(...out) < 1e-6) continue;  // degenerate: two of the four corners coincide
        expect(dot(out, minus(a, middle))).toBeGreaterThan(0);
        if (dot(out, minus(eye, a)) > 0) ++seen;
      }
      expect(seen).toBeGreaterThan(0.6 * triangles.length - 3);
    }
  });

  test("light from above: the upper face is the brightest", () => {
    const { triangles, colours } = baked("box", [13, 14, 15]);
    const top = triangles.findIndex((corners) => corners.every((corner) => corner[2] === 5.25)) >> 1;
    const red = (face: number) => colours[face * 16] as number;
    for (let face = 0; face < 3; ++face) if (face !== top) expect(red(face)).toBeLessThan(red(top));
  });

  test("a crowd has room", () => {
    expect(baked("sphere", [13, 14, 15], 1000).triangles.length).toBeGreaterThan(20000);
  });
});
