import { fitted, panned, roundLength, toMapPoint, toScreen, zoomed, type Camera } from "../../../../server/station/web/src/plan/camera";
import { beyond, MOST_HINTS } from "../../../../server/station/web/src/plan/beyond";
import { placeLabel, type Rect } from "../../../../server/station/web/src/plan/labels";
import { hull, product, shapeOutline, turned } from "../../../../server/station/web/src/plan/outline";
import { entityAt } from "../../../../server/station/web/src/plan/pick";
import type { WorldFrame } from "../../../../server/station/web/src/session/frames";
import type { Entity, Quaternion, Shape } from "../../../../server/station/web/src/session/protocol";
import { siteBounds, type Model } from "../../../../server/station/web/src/session/site.svelte";
import { Trails } from "../../../../server/station/web/src/session/trails";

const camera: Camera = { x: 3, y: -2, scale: 40, width: 800, height: 600 };
const about = (angle: number): Quaternion => [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];
const box = (size: [number, number, number]): Shape => ({ shape: "box", size, at: [0, 0, 0], turn: [0, 0, 0, 1], colour: [1, 1, 1] });

describe("the plan's camera", () => {
  test("screen and map are each other's inverse; y is up in map", () => {
    const p = toMapPoint(camera, 100, 200);
    expect(toScreen(camera, p.x, p.y)).toEqual([100, 200]);
    expect(toMapPoint(camera, 100, 100).y).toBeGreaterThan(p.y);
  });

  test("what is under the pointer stays there when it zooms, also at the limits", () => {
    for (const factor of [1.3, 0.2, 1e9, 1e-9]) {
      const before = toMapPoint(camera, 700, 50), after = toMapPoint(zoomed(camera, factor, 700, 50), 700, 50);
      expect(after.x).toBeCloseTo(before.x);
      expect(after.y).toBeCloseTo(before.y);
    }
  });

  test("a drag takes the map along", () => {
    const grabbed = toMapPoint(camera, 10, 10);
    expect(toScreen(panned(camera, 25, -7), grabbed.x, grabbed.y)).toEqual([35, 3]);
  });

  test("what is fitted high lies below the buttons and above the measure", () => {
    const c = fitted(camera, { x0: 0, y0: 0, x1: 4, y1: 20 });
    expect(toScreen(c, 0, 20)[1]).toBeGreaterThan(40);
    expect(toScreen(c, 0, 0)[1]).toBeLessThan(c.height - 30);
  });
  test("what is fitted lies within the canvas", () => {
    const c = fitted(camera, { x0: -5, y0: 0, x1: 20, y1: 4 });
    for (const [x, y] of [[-5, 0], [20, 4]] as const) {
      const [px, py] = toScreen(c, x, y);
      expect(px).toBeGreaterThanOrEqual(0);
      expect(px).toBeLessThanOrEqual(c.width);
      expect(py).toBeGreaterThanOrEqual(0);
      expect(py).toBeLessThanOrEqual(c.height);
    }
  });

  test("a scale is a round length of enough pixels", () => {
    for (const [scale, length] of [[40, 2], [59, 2], [61, 1], [7, 10]] as const) expect(roundLength(scale, 60)).toBeCloseTo(length);
  });
});

describe("outlines from above", () => {
  test("turning is by the quaternion, one after the other", () => {
    const [x, y] = turned(product(about(0.4), about(0.7)), [2, 0, 0]);
    expect(x).toBeCloseTo(2 * Math.cos(1.1));
    expect(y).toBeCloseTo(2 * Math.sin(1.1));
  });

  test("a turned wall is a turned rectangle", () => {
    const outline = shapeOutline(box([4, 1, 2]), { at: [10, 5, 0], turn: about(Math.PI / 2) });
    if (!("polygon" in outline)) throw new Error("not a polygon");
    const xs = outline.polygon.filter((_, i) => i % 2 === 0), ys = outline.polygon.filter((_, i) => i % 2);
    expect([Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)].map((each) => Math.round(each * 1e6) / 1e6)).toEqual([9.5, 10.5, 3, 7]);
  });

  test("a standing barrel is a circle, a lying one is as long as it is", () => {
    const barrel: Shape = { ...box([0.3, 0.3, 1]), shape: "cylinder" };
    expect(shapeOutline(barrel, { at: [1, 2, 0], turn: about(1) })).toEqual({ circle: [1, 2, 0.3] });
    const lying = shapeOutline(barrel, { at: [0, 0, 0], turn: [0, Math.SQRT1_2, 0, Math.SQRT1_2] });
    if (!("polygon" in lying)) throw new Error("not a polygon");
    expect(Math.max(...lying.polygon.filter((_, i) => i % 2 === 0))).toBeCloseTo(0.5);
  });

  test("a hull leaves out what lies inside", () => {
    expect(hull([0, 0, 2, 0, 2, 2, 0, 2, 1, 1]).length).toBe(8);
  });
});

const entity = (id: number, name: string): Entity => ({ id, name, owner: "robot", kind: "robot", robot_model: "", parts: [{ id, name: "base", form: 0 }] });
const world = (t: number, places: [number, number, number][]): WorldFrame => ({
  kind: "world", table: 1, t, count: places.length, ids: Uint16Array.from(places, ([id]) => id), flags: new Uint16Array(places.length),
  poses: Float32Array.from(places.flatMap(([, x, y]) => [x, y, 0, 0, 0, 0, 1])),
});

describe("what is where", () => {
  test("the nearest within reach is picked, whatever the rows' order", () => {
    const entities = [entity(0, "a"), entity(7, "b")], frame = world(0, [[7, 1, 0], [0, 5, 5]]);
    expect(entityAt(entities, frame, { x: 1.2, y: 0 }, 0.5)?.name).toBe("b");
    expect(entityAt(entities, frame, { x: 3, y: 0 }, 0.5)).toBeNull();
    expect(entityAt(entities, null, { x: 1, y: 0 }, 0.5)).toBeNull();
  });

  test("a trail is where a robot went: no way lies between where it was and where it was put, none before a seek", () => {
    const trails = new Trails(), one = [entity(0, "a")];
    for (let i = 0; i < 5; ++i) trails.take(one, world(i, [[0, i * 0.2, 0]]));
    expect(trails.of.get("a")?.points.length).toBe(10);
    trails.take(one, world(5, [[0, 9, 9]]));
    expect(trails.of.get("a")?.points).toEqual([9, 9]);
    trails.take(one, world(1, [[0, 1, 1]]));
    expect(trails.of.get("a")?.points).toEqual([1, 1]);
    for (let i = 0; i < 3; ++i) trails.take(one, world(100 + i, [[0, 1 + 0.2 * i, 1]]));
    expect(trails.of.get("a")?.times).toEqual([101, 102].filter((t) => t > 60));
  });

  test("the site reaches as far as its walls do, turned ones too", () => {
    const model: Model = { version: 1, meshes: [], elements: [{ name: "w", label: "wall", at: [2, 3, 1], turn: about(Math.PI / 2), size: [4, 0.2, 2], confidence: 1, virtual: false, part_of: "" }] };
    const found = siteBounds(model, null);
    [found?.x0, found?.y0, found?.x1, found?.y1].forEach((each, i) => expect(each).toBeCloseTo([1.9, 1, 2.1, 5][i] as number));
    expect(siteBounds({ version: 1, elements: [], meshes: [] }, null)).toBeNull();
  });
});

describe("names on the plan", () => {
  const canvas = { width: 800, height: 600 };
  test("a name that would be cut at the border is moved within it", () => {
    expect(placeLabel(795, 300, 100, canvas, [])).toEqual([747, 300]);
    expect(placeLabel(2, 598, 100, canvas, [])).toEqual([53, 593]);
  });

  test("a name is not written over another", () => {
    const taken: Rect[] = [];
    const places = [0, 1, 2].map(() => placeLabel(400, 300, 80, canvas, taken));
    expect(new Set(places.map(([, y]) => y)).size).toBe(3);
    expect(placeLabel(600, 300, 80, canvas, taken)).toEqual([600, 300]);
  });
});

describe("hints at the plan's border", () => {
  test("what lies beyond the border has one, in its direction and with its distance", () => {
    const [hint, ...others] = beyond(camera, [{ name: "near", x: 3, y: -2 }, { name: "far", x: 63, y: -2 }]);
    expect(others).toEqual([]);
    expect(hint).toMatchObject({ name: "far", py: 300, heading: 0, more: 0 });
    expect(hint!.px).toBeLessThan(800);
    expect(hint!.away).toBeCloseTo(60 - (hint!.px - 400) / 40);
  });

  test("of many the nearest have one, and the last counts the others", () => {
    const many = Array.from({ length: 20 }, (_, i) => ({ name: `a${i}`, x: 30 + i, y: -2 }));
    const hints = beyond(camera, many.reverse());
    expect(hints.map((each) => each.name)).toEqual(["a0", "a1", "a2", "a3", "a4", "a5"]);
    expect(hints[MOST_HINTS - 1]!.more).toBe(14);
  });
});
