import { alignByPoints, MAX_RMS_M, offBy, type Reference, type Touch } from "../../../../server/station/web/src/view3d/alignment";
import { composed, inHeadset, inSite, relativeTo, type SiteInHeadset } from "../../../../server/station/web/src/view3d/calibration";

const truth: SiteInHeadset = { turn: 0.83, x: 1.4, y: 0, z: -2.2 };
const corners: Reference[] = [{ x: 0.06, y: 0.06 }, { x: 7.94, y: 0.06 }, { x: 7.94, y: 5.94 }, { x: 2, y: 5.94 }];
/** The wearer stands half a metre from the corner, towards the middle of the room. */
const touched = (reference: Reference, place = truth, [dx, dy] = [0, 0]): Touch => {
  const away = Math.hypot(4 - reference.x, 3 - reference.y), eye = { x: reference.x + (0.5 * (4 - reference.x)) / away, y: reference.y + (0.5 * (3 - reference.y)) / away };
  return { reference, hand: inHeadset(place, reference.x + (dx ?? 0), reference.y + (dy ?? 0), reference.z ?? 1.1), eye: inHeadset(place, eye.x, eye.y, 1.65) };
};
const aligned = (touches: Touch[], floor = 0) => {
  const found = alignByPoints(touches, floor, []);
  if (!found.aligned) throw new Error(JSON.stringify(found.refusal));
  return found.aligned;
};
const refusal = (touches: Touch[], walls: number[][] = []) => alignByPoints(touches, 0, walls).refusal;
/** Deterministic, normal by the sum of twelve (Irwin and Hall). */
function* noise(sigma: number, seed: number) {
  for (let state = seed; ;) {
    let sum = -6;
    for (let i = 0; i < 12; ++i) {
      state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
      sum += state / 2 ** 32;
    }
    yield sum * sigma;
  }
}
const turnError = (a: number, b: number) => Math.abs(Math.atan2(Math.sin(a - b), Math.cos(a - b)));

test("two exact points give yaw and translation in every direction", () => {
  for (const turn of [0, 0.83, -2.5, 3.14]) {
    const place = { ...truth, turn }, { place: found, error_m } = aligned(corners.slice(0, 2).map((each) => touched(each, place)));
    expect(turnError(found.turn, turn)).toBeLessThan(1e-9);
    expect(Math.hypot(found.x - place.x, found.z - place.z)).toBeLessThan(1e-9);
    expect(error_m).toBeLessThan(1e-9);
  }
});

test("two points that fit by luck are not called exact", () => {
  expect(aligned(corners.slice(0, 2).map((each) => touched(each))).error_rad).toBeGreaterThan(0.001);
});

test("of two points the error is half the difference of their distances", () => {
  const touches = [touched(corners[0] as Reference), touched(corners[1] as Reference, truth, [0.06, 0])];
  expect(aligned(touches).error_m).toBeCloseTo(0.03, 6);
});

test("distances that differ by more than the limit are refused with both", () => {
  const found = refusal([touched(corners[0] as Reference), touched(corners[1] as Reference, truth, [0.3, 0])]);
  expect(found).toMatchObject({ why: "distance" });
  if (found?.why === "distance") expect(found.headset_m - found.map_m).toBeCloseTo(0.3, 6);
});

test("further points make noisy touches better, and the stated error is the true one", () => {
  const drawn = noise(0.015, 7), next = () => drawn.next().value as number;
  const error = (n: number) => {
    let sum = 0, stated = 0;
    for (let run = 0; run < 300; ++run) {
      const { place, error_rad } = aligned(corners.slice(0, n).map((each) => touched(each, truth, [next(), next()])));
      sum += turnError(place.turn, truth.turn) ** 2;
      stated += error_rad ** 2;
    }
    return { turn: Math.sqrt(sum / 300), stated: Math.sqrt(stated / 300) };
  };
  const two = error(2), four = error(4);
  expect(four.turn).toBeLessThan(0.9 * two.turn);
  for (const each of [two, four]) {
    expect(each.stated).toBeGreaterThan(0.75 * each.turn);
    expect(each.stated).toBeLessThan(1.6 * each.turn);
  }
});

test("a single touch, and points at one place, are refused", () => {
  expect(refusal([])).toEqual({ why: "few" });
  expect(refusal([touched(corners[0] as Reference)])).toEqual({ why: "few" });
  expect(refusal([touched(corners[0] as Reference), touched(corners[0] as Reference)])).toEqual({ why: "near", apart_m: 0 });
  expect(refusal([touched({ x: 1, y: 1 }), touched({ x: 1.5, y: 1 })])).toMatchObject({ why: "near" });
});

test("three points in another order are refused as that", () => {
  const [a, b, c] = corners.map((each) => touched(each)) as [Touch, Touch, Touch];
  expect(refusal([{ ...a, hand: b.hand }, { ...b, hand: c.hand }, { ...c, hand: a.hand }])).toEqual({ why: "order" });
});

test("a mirrored site is refused as that, and not turned to fit", () => {
  const mirrored = corners.slice(0, 3).map((each) => ({ ...touched({ x: each.x, y: -each.y }), reference: each }));
  expect(refusal(mirrored)).toEqual({ why: "mirrored" });
});

test("one wrong touch of four is named", () => {
  const touches = corners.map((each, i) => touched(each, truth, i === 2 ? [0.5, -0.3] : [0, 0]));
  expect(refusal(touches)).toMatchObject({ why: "residual", worst: 2 });
});

test("two points of one wall in the other order are refused: the wearer would have reached through the wall", () => {
  const wall = [-1, -0.06, 9, -0.06, 9, 0.06, -1, 0.06];
  const [a, b] = corners.map((each) => touched(each)) as [Touch, Touch];
  expect(refusal([a, b], [wall])).toBeUndefined();
  const swapped = [{ ...a, hand: b.hand, eye: b.eye }, { ...b, hand: a.hand, eye: a.eye }];
  expect(refusal(swapped, [wall])).toMatchObject({ why: "hidden" });
  expect(refusal(swapped, [])).toBeUndefined();
});

test("a wall of the model alone between the wearer and one of three points refuses nothing", () => {
  const across = [6.5, 0.5, 7.9, 0.5, 7.9, 0.7, 6.5, 0.7];
  const touches = corners.slice(0, 3).map((each) => touched(each));
  (touches[1] as Touch).eye = inHeadset(truth, 7, 2, 1.65);
  expect(refusal(touches, [across])).toBeUndefined();
});

test("the height is the floor's, or that of the points if they have one", () => {
  expect(aligned(corners.slice(0, 2).map((each) => touched(each)), 3.2).place.y).toBeCloseTo(-3.2);
  const high = { ...truth, y: 0.07 }, touches = corners.slice(0, 2).map((each) => touched({ ...each, z: 1 }, high));
  expect(aligned(touches).place.y).toBeCloseTo(0.07);
});

test("drift shows in a touch of a known place, and new touches of all end it", () => {
  const before = aligned(corners.map((each) => touched(each))).place;
  const drifted = { ...truth, turn: truth.turn + 0.02, x: truth.x + 0.05 };
  const after = corners.map((each) => touched(each, drifted));
  expect(Math.max(...after.map((each) => offBy(before, each)))).toBeGreaterThan(MAX_RMS_M);
  const again = aligned(after).place;
  for (const each of after) expect(offBy(again, each)).toBeLessThan(1e-6);
});

test("a place follows its anchor, also after the headset's space was reset", () => {
  const anchor = { turn: -0.4, x: 2, y: 0.1, z: -1 }, moved = { turn: 1.1, x: -3, y: 0.2, z: 0.6 };
  const same = composed(anchor, relativeTo(anchor, truth));
  for (const key of ["turn", "x", "y", "z"] as const) expect(same[key]).toBeCloseTo(truth[key], 9);
  const later = composed(moved, relativeTo(anchor, truth));
  // A point of the room is the same for anchor and map.
  const p = inHeadset(truth, 3, -2, 0.5), inAnchor = inSite(anchor, p), again = inHeadset(moved, inAnchor.x, inAnchor.y, inAnchor.z), want = inHeadset(later, 3, -2, 0.5);
  for (const key of ["x", "y", "z"] as const) expect(again[key]).toBeCloseTo(want[key], 9);
});
