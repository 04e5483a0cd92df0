import { headingOf, hull, sideView, viewBox } from "../../../../server/station/web/src/drive/side_view";

const part = (name: string, shape: "box" | "sphere" | "cylinder" | "capsule", size: number[]) => ({ name, shape, size, colour: [1, 1, 1] });
const level = { qx: 0, qy: 0, qz: 0, qw: 1 };
const bounds = (points: [number, number][]) => [Math.min(...points.map((p) => p[0])), Math.max(...points.map((p) => p[0])), Math.min(...points.map((p) => p[1])), Math.max(...points.map((p) => p[1]))];

test("a hull is what encloses", () => {
  expect(hull([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]]).length).toBe(4);
});

test("a box is as long and as high as it is, wherever the robot stands and looks", () => {
  for (const heading of [0, 1, -2.5]) {
    const pose = { x: 7, y: -3, z: 0.2, qx: 0, qy: 0, qz: Math.sin(heading / 2), qw: Math.cos(heading / 2) };
    expect(headingOf(pose)).toBeCloseTo(heading);
    const [outline] = sideView([{ ...part("body", "box", [0.8, 0.5, 0.3]), pose }], pose);
    bounds(outline!.points).forEach((each, i) => expect(each).toBeCloseTo([-0.4, 0.4, -0.15, 0.15][i]!));
  }
});

test("a robot that pitches is drawn so: its nose comes down", () => {
  const pitch = 0.3, pose = { x: 0, y: 0, z: 0, qx: 0, qy: Math.sin(pitch / 2), qz: 0, qw: Math.cos(pitch / 2) };
  const [outline] = sideView([{ ...part("body", "box", [1, 0.5, 0.01]), pose }], pose);
  const nose = outline!.points.reduce((a, b) => (b[0] > a[0] ? b : a));
  expect(nose[1]).toBeLessThan(-0.1);
});

test("a wheel is round, an arm before the body is drawn over it", () => {
  const lying = { qx: Math.SQRT1_2, qy: 0, qz: 0, qw: Math.SQRT1_2 };  // its axis along y
  const list = sideView([
    { ...part("wheel", "cylinder", [0.1, 0.1, 0.05]), pose: { x: 0, y: -0.3, z: 0.1, ...lying } },
    { ...part("body", "box", [0.5, 0.4, 0.2]), pose: { x: 0, y: 0, z: 0.2, ...level } },
  ], { x: 0, y: 0, z: 0, ...level });
  expect(list.map((each) => each.name)).toEqual(["body", "wheel"]);
  bounds(list[1]!.points).forEach((each, i) => expect(each).toBeCloseTo([-0.1, 0.1, 0, 0.2][i]!));
});

test("what is drawn fits, and nothing has a box, too", () => {
  expect(viewBox([])).toEqual([-0.5, 0, 1, 1]);
  expect(viewBox([{ name: "", points: [[0, 0], [2, 1]], colour: [], lateral: 0 }], 0.5)).toEqual([-0.5, -0.5, 3, 2]);
});
