/** Alignment of the map to a headset by known places: least squares for yaw and translation (Umeyama 1991, without
 * scale, in the horizontal plane; gravity is known to both). Metres and radians. */
import { inSite, type HeadsetPoint, type SiteInHeadset } from "./calibration";

/** A known place in map; without `z` it is a vertical edge, touched at any height. */
export interface Reference { x: number; y: number; z?: number }
/** The controller's tip at a reference, and the wearer's eyes at that moment. */
export interface Touch { reference: Reference; hand: HeadsetPoint; eye: HeadsetPoint }
/** Horizontal outline, x and y alternating. */
export type Footprint = readonly number[];

export type Refusal =
  | { why: "few" } | { why: "near"; apart_m: number } | { why: "distance"; map_m: number; headset_m: number }
  | { why: "residual"; rms_m: number; worst: number } | { why: "order" } | { why: "mirrored" } | { why: "hidden"; touch: number }
  | { why: "tilted"; rad: number } | { why: "size"; measured_m: number } | { why: "unsteady"; scatter_m: number };
/** `error_m`: RMS of the residuals; `error_rad`: standard deviation of the yaw. */
export interface Aligned { place: SiteInHeadset; error_m: number; error_rad: number }
export type Outcome = { aligned: Aligned; refusal?: undefined } | { aligned?: undefined; refusal: Refusal };

/** Larger RMS residuals are refused: of two points, distances that differ by twice this. */
export const MAX_RMS_M = 0.05;
/** Accuracy of a touch: two points that fit by luck are not exact. */
const TOUCH_M = 0.01;
/** Below this distance a touch turns the site by more than a degree. */
const MIN_APART_M = 1;
/** Length in a wall between eye and hand above which the touch was not possible. */
const MAX_INSIDE_M = 0.08;
/** Above this number the orders of touches are too many to be tried. */
const MAX_ORDERED = 6;

type Pair = [x: number, y: number, u: number, v: number];
interface Fit { turn: number; u: number; v: number; residuals: number[]; rms: number; spread: number }

/** At least two touches. `floor`: height in map of the floor that the wearer stands on, used unless references have a
 * height; `walls`: what cannot be between a wearer and the touched place. */
export function alignByPoints(touches: readonly Touch[], floor: number, walls: readonly Footprint[]): Outcome {
  if (touches.length < 2) return { refusal: { why: "few" } };
  const pairs = touches.map(({ reference, hand }): Pair => [reference.x, reference.y, hand.x, -hand.z]);
  const apart = longest(pairs);
  if (apart.map_m < MIN_APART_M) return { refusal: { why: "near", apart_m: apart.map_m } };
  const fit = fitted(pairs);
  if (fit.rms > MAX_RMS_M) return { refusal: explained(pairs, fit, apart) };
  const place = { turn: fit.turn, x: fit.u, y: height(touches, floor), z: -fit.v };
  // One may be a wall that is only in the model.
  const hidden = touches.flatMap((touch, i) => (isHidden(place, touch, walls) ? [i] : []));
  if (2 * hidden.length >= touches.length) return { refusal: { why: "hidden", touch: hidden[0] as number } };
  const sigma = Math.sqrt((fit.rms ** 2 * pairs.length) / (2 * pairs.length - 3));
  return { aligned: { place, error_m: fit.rms, error_rad: Math.max(sigma, TOUCH_M) / Math.sqrt(fit.spread) } };
}

/** Horizontal distance between a touch and its reference: what the alignment is off by there now. */
export function offBy(place: SiteInHeadset, { reference, hand }: Pick<Touch, "reference" | "hand">): number {
  const at = inSite(place, hand);
  return Math.hypot(at.x - reference.x, at.y - reference.y);
}

/** headset = rotation by `turn` of map, then (u, v), which are x and -z of the headset. `hand` -1: of a mirrored map. */
function fitted(pairs: readonly Pair[], hand: 1 | -1 = 1): Fit {
  const n = pairs.length, mean = [0, 1, 2, 3].map((k) => pairs.reduce((sum, pair) => sum + (pair[k] as number), 0) / n) as Pair;
  let across = 0, along = 0, spread = 0;
  for (const pair of pairs) {
    const x = pair[0] - mean[0], y = hand * (pair[1] - mean[1]), u = pair[2] - mean[2], v = pair[3] - mean[3];
    across += x * v - y * u;
    along += x * u + y * v;
    spread += x * x + y * y;
  }
  const turn = Math.atan2(across, along), cos = Math.cos(turn), sin = Math.sin(turn);
  const u = mean[2] - cos * mean[0] + sin * hand * mean[1], v = mean[3] - sin * mean[0] - cos * hand * mean[1];
  const residuals = pairs.map(([x, y, pu, pv]) => Math.hypot(cos * x - sin * hand * y + u - pu, sin * x + cos * hand * y + v - pv));
  return { turn, u, v, residuals, spread, rms: Math.sqrt(residuals.reduce((sum, each) => sum + each * each, 0) / n) };
}

/** The most probable mistake behind a fit that is bad. */
function explained(pairs: readonly Pair[], fit: Fit, apart: { map_m: number; headset_m: number }): Refusal {
  if (pairs.length === 2) return { why: "distance", ...apart };
  if (pairs.length <= MAX_ORDERED && orders(pairs.length).some((order) => fitted(reordered(pairs, order)).rms < MAX_RMS_M)) return { why: "order" };
  if (fitted(pairs, -1).rms < MAX_RMS_M) return { why: "mirrored" };
  return { why: "residual", rms_m: fit.rms, worst: fit.residuals.indexOf(Math.max(...fit.residuals)) };
}

const reordered = (pairs: readonly Pair[], order: number[]): Pair[] =>
  pairs.map(([x, y], i) => [x, y, ...(pairs[order[i] as number] as Pair).slice(2)] as Pair);

function orders(n: number): number[][] {
  if (n === 0) return [[]];
  return orders(n - 1).flatMap((order) => Array.from({ length: n }, (_, i) => [...order.slice(0, i), n - 1, ...order.slice(i)]));
}

/** Of the two references that are farthest apart. */
function longest(pairs: readonly Pair[]): { map_m: number; headset_m: number } {
  let found = { map_m: 0, headset_m: 0 };
  for (const [i, a] of pairs.entries())
    for (const b of pairs.slice(i + 1)) {
      const map_m = Math.hypot(a[0] - b[0], a[1] - b[1]);
      if (map_m > found.map_m) found = { map_m, headset_m: Math.hypot(a[2] - b[2], a[3] - b[3]) };
    }
  return found;
}

function height(touches: readonly Touch[], floor: number): number {
  const known = touches.flatMap(({ reference, hand }) => (reference.z === undefined ? [] : [hand.y - reference.z]));
  return known.length ? known.reduce((sum, each) => sum + each, 0) / known.length : -floor;
}

/** A wall stood between the wearer and what was touched: then the alignment is wrong, for example half a turn off. */
function isHidden(place: SiteInHeadset, { reference, eye }: Touch, walls: readonly Footprint[]): boolean {
  const from = inSite(place, eye);
  return walls.some((wall) => lengthInside(wall, from.x, from.y, reference.x, reference.y) > MAX_INSIDE_M);
}

/** Length of a segment in a convex, counter-clockwise outline (Cyrus and Beck 1978). */
function lengthInside(outline: Footprint, ax: number, ay: number, bx: number, by: number): number {
  let from = 0, to = 1;
  for (let i = 0; i < outline.length; i += 2) {
    const k = (i + 2) % outline.length, x = outline[i] as number, y = outline[i + 1] as number;
    const nx = (outline[k + 1] as number) - y, ny = x - (outline[k] as number);  // outwards
    const start = nx * (ax - x) + ny * (ay - y), change = nx * (bx - ax) + ny * (by - ay);
    if (change < 0) from = Math.max(from, -start / change);
    else if (change > 0) to = Math.min(to, -start / change);
    else if (start > 0) return 0;
  }
  return Math.max(0, to - from) * Math.hypot(bx - ax, by - ay);
}
