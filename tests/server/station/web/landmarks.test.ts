import type { Element, Model } from "../../../../server/station/web/src/session/site.svelte";
import { faceAt, floorAt, landmarkAt } from "../../../../server/station/web/src/view3d/landmarks";

const element = (name: string, label: string, x: number, y: number, z: number, size: [number, number, number], yaw = 0): Element =>
  ({ name, label, at: [x, y, z], turn: [0, 0, Math.sin(yaw / 2), Math.cos(yaw / 2)], size, confidence: 1, virtual: false, part_of: "" });
const turned = Math.PI / 2;
/** Walls meet in the origin, as an L; the room is x > 0, y > 0. A third meets the first in a T at x = 3. */
const model: Model = {
  version: 1, meshes: [], elements: [
    element("south", "wall", 3, 0, 1.25, [6, 0.2, 2.5]), element("west", "wall", 0, 3, 1.25, [6, 0.2, 2.5], turned),
    element("between", "wall", 3, 1, 1.25, [2, 0.1, 2.5], turned), element("counter", "wall", 5, 3, 0.4, [2, 0.6, 0.8]),
    element("door 1", "door", 3, 2.5, 1, [0.9, 0.05, 2], turned), element("floor 1", "floor", 3, 3, -0.05, [6, 6, 0.1]), element("floor 2", "floor", 3, 3, 2.95, [6, 6, 0.1]),
  ],
};
const at = (x: number, y: number, reach = 0.5) => landmarkAt(model, { x, y }, reach);

test("the inner corner of two walls is where their faces cross", () => {
  const found = at(0.3, 0.3);
  expect(found?.x).toBeCloseTo(0.1);
  expect(found?.y).toBeCloseTo(0.1);
  expect(found?.name).toBe("south, west");
});

test("the outer corner is where both walls would end, not the notch that the model leaves", () => {
  const found = at(-0.15, -0.05);
  expect(found?.x).toBeCloseTo(-0.1);
  expect(found?.y).toBeCloseTo(-0.1);
});

test("a wall that meets another in a T has a corner on each side", () => {
  expect(at(2.8, 0.2)?.x).toBeCloseTo(2.95);
  expect(at(3.2, 0.2)?.x).toBeCloseTo(3.05);
});

test("a free end beside a door is the door's frame", () => {
  const found = at(3.1, 2.1);
  expect(found?.x).toBeCloseTo(3.05);
  expect(found?.y).toBeCloseTo(2);
  expect(found?.name).toBe("door 1");
});

test("neither a face, nor the inside of a wall, nor a counter is a corner", () => {
  expect(at(4.5, 0.1, 0.4)).toBeNull();
  expect(at(4, 2.7, 0.5)).toBeNull();
  expect(at(0, 0, 0.05)).toBeNull();
});

test("turned walls have the same corners", () => {
  const a = 0.6, cos = Math.cos(a), sin = Math.sin(a);
  const elements = model.elements.map((each) => ({ ...each, at: [cos * each.at[0] - sin * each.at[1], sin * each.at[0] + cos * each.at[1], each.at[2]] as [number, number, number],
    turn: [0, 0, Math.sin(Math.atan2(each.turn[2], each.turn[3]) + a / 2), Math.cos(Math.atan2(each.turn[2], each.turn[3]) + a / 2)] as [number, number, number, number] }));
  const found = landmarkAt({ ...model, elements }, { x: cos * 0.2 - sin * 0.2, y: sin * 0.2 + cos * 0.2 }, 0.3);
  expect(found?.x).toBeCloseTo(cos * 0.1 - sin * 0.1);
  expect(found?.y).toBeCloseTo(sin * 0.1 + cos * 0.1);
});

test("a marker hangs on the face nearest to the press, and looks out of the wall", () => {
  const found = faceAt(model, { x: 4.5, y: 0.3 }, 0.5);
  expect(found).toMatchObject({ name: "south" });
  expect(found?.y).toBeCloseTo(0.1);
  expect(found?.yaw).toBeCloseTo(Math.PI / 2);
  expect(faceAt(model, { x: 4.5, y: 1.5 }, 0.5)).toBeNull();
});

test("the floor is that of the storey", () => {
  expect(floorAt(model, 1, 1, 0.1)).toBeCloseTo(0);
  expect(floorAt(model, 1, 1, 3.1)).toBeCloseTo(3);
  expect(floorAt(model, 20, 1, 1.5)).toBe(1.5);
});
