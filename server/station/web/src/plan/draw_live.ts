/** Moving content of the plan: robots and agents, their paths, scans, events, and the current draft. */
import { FLAG_REMEMBERED, FLAG_UNSENSED, type ScanFrame, type WorldFrame } from "../session/frames";
import { flatPose, rowOf } from "../session/poses";
import type { Entity, Part, Plan, SessionEvent, Shape } from "../session/protocol";
import type { Trails } from "../session/trails";
import { strings } from "../strings.en";
import { beyond } from "./beyond";
import { toScreen, type Camera } from "./camera";
import { label, labelAt, trace, widthOf } from "./draw_site";
import { shapeOutline } from "./outline";
import type { Draft } from "./tool.svelte";

export type LiveInk = Record<"canvas" | "real" | "virtual" | "robot" | "person" | "planned" | "predicted" | "door" | "accent" | "bad" | "ink" | "soft", string>;
export const liveInk = ["canvas", "real", "virtual", "robot", "person", "planned", "predicted", "door", "accent", "bad", "ink", "soft"] as const;

const words = strings.plan;
type Context = CanvasRenderingContext2D;
const TURN = Math.PI * 2;
/** Limits for name labels: number of names, and minimum pixels per metre. */
const NAMED = 40, NAMED_SCALE = 11;

/** Below this many pixels per metre a body is drawn as its widest shape; below the second value as a dart that
 * points ahead, or a dot. */
const DETAIL_SCALE = 24, DART_SCALE = 12;
/** Length of a dart; they are smaller in a crowd of this many. */
const DART_PX = 9, CROWD = 150, CROWDED_PX = 5;
const widestOf = new WeakMap<Shape[], Shape>();
function widest(shapes: Shape[]): Shape {
  const known = widestOf.get(shapes);
  if (known) return known;
  const area = ({ shape, size }: Shape) => (shape === "box" ? size[0] * size[1] : 4 * size[0] * size[0]);
  const found = shapes.reduce((a, b) => (area(b) > area(a) ? b : a));
  widestOf.set(shapes, found);
  return found;
}

const inkNames = { agent: "virtual", robot: "robot", building: "door", real_person: "person" } as const;
export const inkOf = (entity: Entity, ink: LiveInk) => ink[inkNames[entity.owner]];

const heads = (entity: Entity) => entity.kind === "robot" || entity.kind === "person";

/** `footprintOf`: corners in the frame of the robot, m; empty if unknown. */
export interface Crowd {
  entities: Entity[]; world: WorldFrame; shapesOf(part: Part): Shape[]; footprintOf(name: string): readonly [number, number][]; selected: string; follows: string;
  /** Of a thing that is only remembered, since when; else empty. */
  ageOf(name: string): string;
}

/** All entities of one owner are one path, so that a thousand of them need three fills. */
export function drawEntities(g: Context, c: Camera, crowd: Crowd, ink: LiveInk) {
  const { entities, world } = crowd;
  const bodies = { agent: new Path2D(), robot: new Path2D(), building: new Path2D(), real_person: new Path2D() }, remembered = new Path2D();
  const noses = new Path2D(), length = entities.length > CROWD ? CROWDED_PX : DART_PX, dot = 0.55 * length;
  const shown: { entity: Entity; x: number; y: number; px: number; py: number }[] = [], outside: { name: string; x: number; y: number; ink: string }[] = [];
  for (const entity of entities) {
    let first = true;
    const small = c.scale < DART_SCALE && entity.owner !== "building";
    for (const part of small ? entity.parts.slice(0, 1) : entity.parts) {
      const row = rowOf(world, part.id);
      if (row < 0) continue;
      const k = row * 7;
      const place = { at: world.poses.subarray(k, k + 3), turn: world.poses.subarray(k + 3, k + 7) };
      const shapes = crowd.shapesOf(part);
      const body = (world.flags[row] as number) & FLAG_REMEMBERED ? remembered : bodies[entity.owner];
      if (!small) for (const shape of c.scale < DETAIL_SCALE ? [widest(shapes)] : shapes) trace(body, c, shapeOutline(shape, place));
      if (!first) continue;
      first = false;
      const pose = flatPose(world, row);
      const [px, py] = toScreen(c, pose.x, pose.y);
      if (entity.owner !== "building" && (px < 0 || py < 0 || px > c.width || py > c.height)) outside.push({ name: entity.name, x: pose.x, y: pose.y, ink: inkOf(entity, ink) });
      if (px < -50 || py < -50 || px > c.width + 50 || py > c.height + 50) continue;
      // The shape of a real robot may consist of hull panels only, which are mere lines from above.
      if (!small && entity.owner === "robot") trace(bodies.robot, c, { polygon: placed(crowd.footprintOf(entity.name), pose) });
      shown.push({ entity, x: pose.x, y: pose.y, px, py });
      if (small && heads(entity)) dart(body, px, py, pose.yaw, length);
      else if (small) body.rect(px - dot / 2, py - dot / 2, dot, dot);
      else if (heads(entity)) nose(noses, px, py, pose.yaw, Math.max(7, (entity.kind === "robot" ? 0.5 : 0.34) * c.scale));
      if (pose.flags & FLAG_UNSENSED) ring(g, px, py, 14, ink.soft, [2, 3]);
    }
  }
  for (const owner of ["building", "agent", "robot", "real_person"] as const) {
    if (c.scale >= DART_SCALE) {
      g.strokeStyle = ink.canvas;
      g.lineWidth = 2;
      g.stroke(bodies[owner]);
    }
    g.fillStyle = ink[inkNames[owner]];
    g.fill(bodies[owner], "nonzero");
  }
  g.globalAlpha = 0.35;
  g.fillStyle = ink.virtual;
  g.fill(remembered, "nonzero");
  g.globalAlpha = 1;
  g.strokeStyle = ink.canvas;
  g.lineWidth = 4;
  g.stroke(noses);
  g.strokeStyle = ink.ink;
  g.lineWidth = 2;
  g.stroke(noses);
  for (const { entity, x, y, px, py } of shown) {
    const chosen = entity.name === crowd.selected;
    if (chosen) ring(g, px, py, Math.max(14, 0.55 * c.scale), ink.accent, []);
    if (entity.owner === "building" && !chosen) continue;
    if (px < 0 || py < 0 || px > c.width || py > c.height) continue;
    if (chosen || entity.name === crowd.follows || (shown.length <= NAMED && c.scale > NAMED_SCALE)) label(g, c, x, y, [entity.name, crowd.ageOf(entity.name)].filter(Boolean).join(" · "), chosen ? ink.accent : inkOf(entity, ink), ink.canvas, Math.max(16, 0.42 * c.scale + 9));
  }
  drawBeyond(g, c, outside, ink);
}

/** An arrow at the border to each that lies beyond it, with its name and how far it is. */
function drawBeyond(g: Context, c: Camera, outside: { name: string; x: number; y: number; ink: string }[], ink: LiveInk) {
  const inks = new Map(outside.map((each) => [each.name, each.ink]));
  for (const hint of beyond(c, outside)) {
    const colour = inks.get(hint.name) ?? ink.soft;
    const arrow = new Path2D();
    dart(arrow, hint.px, hint.py, -hint.heading, 12);
    g.fillStyle = colour;
    g.fill(arrow);
    const text = words.beyond(hint.name, hint.away, hint.more);
    const inwards = (12 + widthOf(g, text) / 2) * Math.cos(hint.heading);
    labelAt(g, c, hint.px - inwards, hint.py - 14 * Math.sin(hint.heading), text, colour, ink.canvas);
  }
}

function placed(corners: readonly [number, number][], { x, y, yaw }: { x: number; y: number; yaw: number }): number[] {
  const cos = Math.cos(yaw), sin = Math.sin(yaw);
  return corners.flatMap(([ahead, left]) => [x + cos * ahead - sin * left, y + sin * ahead + cos * left]);
}

function dart(path: Path2D, x: number, y: number, yaw: number, length: number) {
  const cos = (length / 2) * Math.cos(yaw), sin = (-length / 2) * Math.sin(yaw);
  path.moveTo(x + 1.2 * cos, y + 1.2 * sin);
  path.lineTo(x - cos - 0.75 * sin, y - sin + 0.75 * cos);
  path.lineTo(x - cos + 0.75 * sin, y - sin - 0.75 * cos);
}

function nose(path: Path2D, x: number, y: number, yaw: number, length: number) {
  const cos = Math.cos(yaw), sin = -Math.sin(yaw);
  const tip: [number, number] = [x + length * cos, y + length * sin];
  path.moveTo(x, y);
  path.lineTo(...tip);
  for (const side of [2.6, -2.6]) {
    path.moveTo(...tip);
    path.lineTo(tip[0] + length * 0.35 * Math.cos(yaw + side), tip[1] - length * 0.35 * Math.sin(yaw + side));
  }
}

function ring(g: Context, x: number, y: number, radius: number, ink: string, dash: number[]) {
  g.strokeStyle = ink;
  g.lineWidth = 2;
  g.setLineDash(dash);
  g.beginPath();
  g.arc(x, y, radius, 0, TURN);
  g.stroke();
  g.setLineDash([]);
}

/** An old sweep is pale; after three seconds it is hidden. */
export function scanStrength(scan: ScanFrame, now: number): number {
  return Math.min(1, Math.max(0, (3 - (now - scan.t)) / 2.5));
}

/** Returns of real objects, of agents, or all. */
export function drawScan(g: Context, c: Camera, scan: ScanFrame, which: "real" | "virtual", ink: string, strength: number) {
  if (!scan.pose || strength <= 0) return;
  const { x, y, yaw } = scan.pose;
  const size = Math.min(5, Math.max(2.5, c.scale * 0.045));
  g.fillStyle = ink;
  g.globalAlpha = strength;
  for (let i = 0; i < scan.ranges.length; ++i) {
    const range = scan.ranges[i] as number;
    if (!(range > 0) || range === Infinity || (which === "virtual") !== ((scan.agents[i] as number) >= 0)) continue;
    const angle = yaw + scan.rad0 + i * scan.radstep;
    const [px, py] = toScreen(c, x + range * Math.cos(angle), y + range * Math.sin(angle));
    g.fillRect(px - size / 2, py - size / 2, size, size);
  }
  g.globalAlpha = 1;
}

/** Free space seen by the laser, faintly. */
export function drawSweep(g: Context, c: Camera, scan: ScanFrame, ink: string, strength: number) {
  if (!scan.pose || strength <= 0) return;
  const { x, y, yaw } = scan.pose;
  g.beginPath();
  g.moveTo(...toScreen(c, x, y));
  for (let i = 0; i < scan.ranges.length; ++i) {
    const range = scan.ranges[i] as number;
    if (!(range > 0) || range === Infinity) continue;
    const angle = yaw + scan.rad0 + i * scan.radstep;
    g.lineTo(...toScreen(c, x + range * Math.cos(angle), y + range * Math.sin(angle)));
  }
  g.closePath();
  g.globalAlpha = 0.07 * strength;
  g.fillStyle = ink;
  g.fill();
  g.globalAlpha = 1;
}

export function drawPaths(g: Context, c: Camera, plans: Plan[], paths: boolean, motion: boolean, ink: LiveInk) {
  for (const each of plans) {
    const planned = each.kind !== "predicted";
    if (each.points.length < 2 || !(each.kind === "path" ? paths : motion)) continue;
    g.strokeStyle = planned ? ink.planned : ink.predicted;
    g.lineWidth = planned ? 1.5 : 2.5;
    g.setLineDash(planned ? [5, 4] : []);
    line(g, c, each.points.flat());
    g.setLineDash([]);
  }
}

export function drawTrails(g: Context, c: Camera, trails: Trails, owners: Map<string, Entity>, ink: LiveInk) {
  g.lineWidth = 1.5;
  g.globalAlpha = 0.6;
  for (const [name, trail] of trails.of) {
    const entity = owners.get(name);
    if (!entity) continue;
    g.strokeStyle = inkOf(entity, ink);
    line(g, c, trail.points);
  }
  g.globalAlpha = 1;
}

function line(g: Context, c: Camera, points: number[]) {
  g.beginPath();
  for (let i = 0; i + 1 < points.length; i += 2) {
    const at = toScreen(c, points[i] as number, points[i + 1] as number);
    if (i) g.lineTo(...at);
    else g.moveTo(...at);
  }
  g.stroke();
}

const RECENT_S = 60;
/** Events that matter in a debriefing: the placing of an agent is visible without a mark. */
const grave = /person_touched|contact_started|collision_predicted|fell|tipp|hazard|_limit$|dropped|unhinged|points_deducted/;
/** Events of the last minute with a place. */
export function drawEvents(g: Context, c: Camera, events: SessionEvent[], now: number, ink: LiveInk) {
  for (let i = events.length - 1; i >= 0 && now - (events[i] as SessionEvent).t < RECENT_S; --i) {
    const event = events[i] as SessionEvent;
    if (event.t > now || !grave.test(event.kind) || !event.position?.some((each) => each !== 0)) continue;
    const [px, py] = toScreen(c, event.position[0] ?? 0, event.position[1] ?? 0);
    g.globalAlpha = 1 - 0.8 * ((now - event.t) / RECENT_S);
    g.strokeStyle = ink.bad;
    g.lineWidth = 2;
    g.beginPath();
    for (const [dx, dy] of [[-4, -4], [-4, 4]] as const) {
      g.moveTo(px + dx, py + dy);
      g.lineTo(px - dx, py - dy);
    }
    g.stroke();
  }
  g.globalAlpha = 1;
}

export function drawDrafts(g: Context, c: Camera, drafts: Draft[], ink: LiveInk) {
  for (const draft of drafts) {
    const colour = draft.refused ? ink.bad : ink.accent;
    g.strokeStyle = colour;
    g.lineWidth = 2;
    const flat = draft.points.flat();
    if (draft.closed) {
      const path = new Path2D();
      trace(path, c, { polygon: flat });
      g.fillStyle = colour;
      g.globalAlpha = 0.3;
      g.fill(path);
      g.globalAlpha = 1;
      g.stroke(path);
    } else {
      line(g, c, flat);
      g.fillStyle = colour;
      for (const [x, y] of draft.points) {
        const [px, py] = toScreen(c, x, y);
        g.beginPath();
        g.arc(px, py, 4, 0, TURN);
        g.fill();
      }
    }
    const n = draft.points.length;
    if (!n) continue;
    const x = draft.points.reduce((sum, p) => sum + p[0], 0) / n, y = draft.points.reduce((sum, p) => sum + p[1], 0) / n;
    if (draft.heading !== undefined) {
      const path = new Path2D();
      const [px, py] = toScreen(c, x, y);
      nose(path, px, py, draft.heading, Math.max(22, 0.6 * c.scale));
      g.stroke(path);
    }
    if (draft.label) label(g, c, x, y, draft.label, colour, ink.canvas, Math.max(18, 0.5 * c.scale));
  }
}
