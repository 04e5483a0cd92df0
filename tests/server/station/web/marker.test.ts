import { alignByMarker, MIN_SIGHTS, type MarkerPlace, type MarkerSight } from "../../../../server/station/web/src/view3d/marker";
import { inHeadset, type SiteInHeadset } from "../../../../server/station/web/src/view3d/calibration";

const truth: SiteInHeadset = { turn: -1.9, x: 0.7, y: 0.04, z: 1.3 };
const marker: MarkerPlace = { x: 7.94, y: 2.5, z: 1.4, yaw: Math.PI, width_m: 0.2 };

function sight(place = truth, yawOff = 0, right = 0): MarkerSight {
  const yaw = marker.yaw + place.turn + yawOff;
  return {
    at: inHeadset(place, marker.x, marker.y + right, marker.z), width_m: 0.2,
    normal: { x: Math.cos(yaw), y: 0, z: -Math.sin(yaw) }, right: { x: -Math.sin(yaw), y: 0, z: -Math.cos(yaw) },
  };
}
const many = (of: (i: number) => MarkerSight, n = MIN_SIGHTS) => Array.from({ length: n }, (_, i) => of(i));

test("the marker says where the site is, its height too", () => {
  const { aligned } = alignByMarker(many(() => sight()), marker);
  if (!aligned) throw new Error("refused");
  for (const key of ["x", "y", "z"] as const) expect(aligned.place[key]).toBeCloseTo(truth[key], 9);
  expect(Math.cos(aligned.place.turn - truth.turn)).toBeCloseTo(1, 12);
  expect(aligned.error_m).toBeLessThan(1e-9);
});

test("its error is the scatter of what the headset saw", () => {
  const { aligned } = alignByMarker(many((i) => sight(truth, i % 2 ? 0.01 : -0.01, i % 2 ? 0.004 : -0.004), 100), marker);
  if (!aligned) throw new Error("refused");
  expect(aligned.error_m).toBeCloseTo(0.004, 4);
  expect(aligned.error_rad).toBeCloseTo(0.01, 4);
});

test("few, unsteady, tilted or wrongly printed ones are refused", () => {
  const refusal = (sights: MarkerSight[]) => alignByMarker(sights, marker).refusal;
  expect(refusal(many(() => sight(), MIN_SIGHTS - 1))).toEqual({ why: "few" });
  expect(refusal(many((i) => sight(truth, 0, i % 2 ? 0.1 : -0.1)))).toMatchObject({ why: "unsteady" });
  expect(refusal(many((i) => sight(truth, i % 2 ? 0.2 : -0.2)))).toMatchObject({ why: "unsteady" });
  expect(refusal(many(() => ({ ...sight(), normal: { x: 0, y: 1, z: 0 } })))).toMatchObject({ why: "tilted" });
  expect(refusal(many(() => ({ ...sight(), width_m: 0.18 })))).toMatchObject({ why: "size", measured_m: expect.closeTo(0.18) });
  expect(refusal(many(() => ({ ...sight(), width_m: null })))).toBeUndefined();
});
