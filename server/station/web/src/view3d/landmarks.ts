/** Places of the building that a hand finds: vertical edges of walls, pillars and door frames. Metres in map. */
import { shapeOutline } from "../plan/outline";
import type { Element, Model } from "../session/site.svelte";
import type { Footprint, Reference } from "./alignment";

export interface Landmark extends Reference { name: string }

/** Radius of the circle around a corner of which the walls cover a quarter (outer) or three (inner). */
const PROBE_M = 0.03;
const PROBES = 32;
/** Walls and frames of doors reach from the floor to a hand. */
const HAND_M = 1.2;
/** Walls that meet may end at each other's middle in the model, or not touch. */
const EXTENDED_M = 0.2;
/** A corner this near to a door is its frame's. */
const FRAME_M = 0.35;

type Solid = { element: Element; outline: number[] };

/** Counter-clockwise. */
export function footprint(element: Element): number[] {
  const outline = shapeOutline({ shape: "box", size: element.size, at: [0, 0, 0], turn: [0, 0, 0, 1], colour: [0, 0, 0] }, element);
  return "polygon" in outline ? outline.polygon : [];
}

const isTall = ({ at, size }: Element) => at[2] + size[2] / 2 > HAND_M && size[2] > HAND_M;
const standing = (model: Model, labels: string[]): Solid[] =>
  model.elements.filter((each) => labels.includes(each.label) && !each.virtual && isTall(each)).map((element) => ({ element, outline: footprint(element) }));

/** Footprints of what nobody reaches through. */
export const wallFootprints = (model: Model): Footprint[] => standing(model, ["wall", "pillar", "window"]).map(({ outline }) => outline);

/** Height of the highest floor below `z` (and half a metre above) at a place; else `z` itself. */
export function floorAt(model: Model | null, x: number, y: number, z: number): number {
  const tops = (model?.elements ?? []).filter((each) => each.label === "floor" && isInside(footprint(each), x, y)).map((each) => each.at[2] + each.size[2] / 2);
  const below = tops.filter((top) => top < z + 0.5);
  return below.length ? Math.max(...below) : z;
}

/** The nearest edge within `reach`; null: none. */
export function landmarkAt(model: Model, at: Reference, reach: number): Landmark | null {
  const solids = standing(model, ["wall", "pillar", "window"]).filter(({ outline }) => isNear(outline, at, reach + PROBE_M));
  const joints = solids.flatMap((a, i) => solids.slice(i + 1).map((b) => jointOf(a, b)));
  const covers = [...solids.map(({ outline }) => outline), ...joints.map(overlap)];
  let found: Landmark | null = null, best = reach;
  for (const { corners, of } of [...solids.map(edgesOf), ...joints])
    for (const { x, y } of corners) {
      // Of several walls at one corner, it is named by those on the side of the press.
      const distance = Math.hypot(x - at.x, y - at.y) + 1e-4 * of.reduce((sum, each) => sum + Math.hypot(each.at[0] - at.x, each.at[1] - at.y), 0);
      if (distance > best || !isCorner(covers, { x, y })) continue;
      best = distance;
      found = { x, y, name: nameOf({ x, y }, of, model) };
    }
  return found;
}

/** The nearest face of a wall within `reach`: a place on it and the direction out of the wall; null: none. */
export function faceAt(model: Model, at: Reference, reach: number): { x: number; y: number; yaw: number; name: string } | null {
  let found: ReturnType<typeof faceAt> = null, best = reach;
  for (const { element, outline } of standing(model, ["wall", "pillar"]))
    for (const [ax, ay, bx, by] of sides(outline)) {
      const length = Math.hypot(bx - ax, by - ay), dx = (bx - ax) / length, dy = (by - ay) / length;
      const along = (at.x - ax) * dx + (at.y - ay) * dy, out = (at.x - ax) * dy - (at.y - ay) * dx;
      if (along < 0 || along > length || out < -0.2 || Math.abs(out) > best) continue;
      best = Math.abs(out);
      found = { x: ax + along * dx, y: ay + along * dy, yaw: Math.atan2(-dx, dy), name: element.name };
    }
  return found;
}

/** Corners of one solid, or where the faces of two walls cross. */
interface Edges { corners: Reference[]; of: Element[] }
const edgesOf = ({ element, outline }: Solid): Edges => ({ corners: sides(outline).map(([x, y]) => ({ x, y })), of: [element] });

function jointOf(a: Solid, b: Solid): Edges {
  const corners = faces(a.outline).flatMap((p) => faces(b.outline).flatMap((q) => crossing(p, q) ?? []));
  return { corners, of: [a.element, b.element] };
}

/** What both walls cover where they meet, counter-clockwise; empty: they only touch. */
function overlap({ corners }: Edges): number[] {
  if (corners.length !== 4) return [];
  const x = corners.reduce((sum, each) => sum + each.x / 4, 0), y = corners.reduce((sum, each) => sum + each.y / 4, 0);
  return corners.sort((a, b) => Math.atan2(a.y - y, a.x - x) - Math.atan2(b.y - y, b.x - x)).flatMap((each) => [each.x, each.y]);
}

type Side = [ax: number, ay: number, bx: number, by: number];
function sides(outline: number[]): Side[] {
  const list: Side[] = [];
  for (let i = 0; i < outline.length; i += 2) {
    const k = (i + 2) % outline.length;
    list.push([outline[i], outline[i + 1], outline[k], outline[k + 1]] as Side);
  }
  return list;
}

/** The two longer sides. */
const faces = (outline: number[]): Side[] => sides(outline).sort((p, q) => Math.hypot(q[2] - q[0], q[3] - q[1]) - Math.hypot(p[2] - p[0], p[3] - p[1])).slice(0, 2);

/** null: they do not cross, or are parallel. */
function crossing([ax, ay, bx, by]: Side, [cx, cy, dx, dy]: Side): Reference | null {
  const across = (bx - ax) * (dy - cy) - (by - ay) * (dx - cx);
  if (Math.abs(across) < 1e-6) return null;
  const s = ((cx - ax) * (dy - cy) - (cy - ay) * (dx - cx)) / across, t = ((cx - ax) * (by - ay) - (cy - ay) * (bx - ax)) / across;
  const past = (fraction: number, length: number) => Math.max(-fraction, fraction - 1) * length > EXTENDED_M;
  if (past(s, Math.hypot(bx - ax, by - ay)) || past(t, Math.hypot(dx - cx, dy - cy))) return null;
  return { x: ax + s * (bx - ax), y: ay + s * (by - ay) };
}

function isCorner(covers: Footprint[], { x, y }: Reference): boolean {
  const near = covers.filter((outline) => isNear(outline, { x, y }, PROBE_M));
  let covered = 0;
  for (let i = 0; i < PROBES; ++i) {
    const a = ((i + 0.5) * 2 * Math.PI) / PROBES, px = x + PROBE_M * Math.cos(a), py = y + PROBE_M * Math.sin(a);
    if (near.some((outline) => isInside(outline, px, py))) covered += 1 / PROBES;
  }
  return (covered > 0.12 && covered < 0.4) || (covered > 0.6 && covered < 0.88);
}

function isInside(outline: Footprint, x: number, y: number): boolean {
  for (const [ax, ay, bx, by] of sides([...outline])) if ((bx - ax) * (y - ay) - (by - ay) * (x - ax) < 0) return false;
  return outline.length > 0;
}

function isNear(outline: Footprint, { x, y }: Reference, reach: number): boolean {
  let x0 = Infinity, y0 = Infinity, x1 = -Infinity, y1 = -Infinity;
  for (let i = 0; i < outline.length; i += 2) {
    x0 = Math.min(x0, outline[i] as number);
    x1 = Math.max(x1, outline[i] as number);
    y0 = Math.min(y0, outline[i + 1] as number);
    y1 = Math.max(y1, outline[i + 1] as number);
  }
  return x > x0 - reach && x < x1 + reach && y > y0 - reach && y < y1 + reach;
}

function nameOf(corner: Reference, of: Element[], model: Model): string {
  const door = model.elements.find((each) => each.label === "door" && isNear(footprint(each), corner, FRAME_M));
  return [...new Set(door ? [door.name] : of.map(({ name }) => name))].join(", ");
}
