/** Static content of the plan: grid, map, floors, walls, doors, stairs, zones, names. */
import type { LayerName } from "../layout/layers";
import type { Zone } from "../session/protocol";
import type { Element, MapPicture, Model } from "../session/site.svelte";
import { roundLength, toMapPoint, toScreen, type Camera } from "./camera";
import { placeLabel, type Rect } from "./labels";
import { shapeOutline, type Placed } from "./outline";

export type Layers = ReadonlySet<LayerName>;
export type Ink = Record<"canvas" | "grid" | "floor" | "wall" | "thing" | "door" | "stairs" | "zone" | "ink" | "soft" | "faint" | "virtual" | "strong", string>;
export const siteInk = ["canvas", "grid", "floor", "wall", "thing", "door", "stairs", "zone", "ink", "soft", "faint", "virtual", "strong"] as const;

type Context = CanvasRenderingContext2D;
const TURN = Math.PI * 2;

export function drawGround(g: Context, c: Camera, map: MapPicture | null, layers: Layers, ink: Ink) {
  taken = [];
  g.fillStyle = ink.canvas;
  g.fillRect(0, 0, c.width, c.height);
  const step = roundLength(c.scale, 36);
  const low = toMapPoint(c, 0, c.height), high = toMapPoint(c, c.width, 0);
  g.strokeStyle = ink.grid;
  g.lineWidth = 1;
  g.beginPath();
  for (let x = Math.ceil(low.x / step) * step; x <= high.x; x += step) {
    const px = Math.round(toScreen(c, x, 0)[0]) + 0.5;
    g.moveTo(px, 0);
    g.lineTo(px, c.height);
  }
  for (let y = Math.ceil(low.y / step) * step; y <= high.y; y += step) {
    const py = Math.round(toScreen(c, 0, y)[1]) + 0.5;
    g.moveTo(0, py);
    g.lineTo(c.width, py);
  }
  g.stroke();
  if (map && layers.has("map")) {
    const [x, y] = toScreen(c, map.x, map.y + map.image.height * map.resolution);
    const size = map.resolution * c.scale;
    g.globalAlpha = 0.35;
    g.imageSmoothingEnabled = size < 3;
    g.drawImage(map.image, x, y, map.image.width * size, map.image.height * size);
    g.globalAlpha = 1;
  }
}

/** Low parts first, so that walls and doors are not covered. */
const order = ["floor", "ramp", "stairs", "unknown", "window", "pillar", "wall", "door"];

export function drawModel(g: Context, c: Camera, model: Model, liveDoors: ReadonlySet<string>, ink: Ink) {
  const fill: Record<string, string> = { floor: ink.floor, ramp: ink.stairs, stairs: ink.stairs, unknown: ink.thing, window: ink.zone, pillar: ink.wall, wall: ink.wall, door: ink.door };
  for (const label of order) {
    const solid = new Path2D(), unreal = new Path2D();
    for (const each of model.elements)
      if (each.label === label && !liveDoors.has(each.name)) tracePlaced(each.virtual ? unreal : solid, c, each);
    g.fillStyle = fill[label] ?? ink.thing;
    g.fill(solid);
    g.fillStyle = ink.virtual;
    g.fill(unreal);
    if (label === "stairs" || label === "unknown") {
      g.strokeStyle = label === "stairs" ? ink.faint : ink.canvas;
      g.lineWidth = 1;
      g.stroke(solid);
    }
  }
  g.fillStyle = ink.thing;
  for (const mesh of model.meshes) drawMesh(g, c, mesh.vertices, mesh.triangles);
}

function tracePlaced(path: Path2D, c: Camera, element: Element) {
  const place: Placed = element;
  trace(path, c, shapeOutline({ shape: "box", size: element.size, at: [0, 0, 0], turn: [0, 0, 0, 1], colour: [0, 0, 0] }, place));
}

export function trace(path: Path2D, c: Camera, outline: ReturnType<typeof shapeOutline>) {
  if ("circle" in outline) {
    const [x, y] = toScreen(c, outline.circle[0], outline.circle[1]);
    const radius = outline.circle[2] * c.scale;
    path.moveTo(x + radius, y);
    path.arc(x, y, radius, 0, TURN);
    return;
  }
  const p = outline.polygon;
  // Returns to the first corner explicitly, because closePath() gets slower with the length of a path
  // (Chromium).
  for (let i = 0; i <= p.length; i += 2) {
    const k = i % p.length;
    const [x, y] = toScreen(c, p[k] as number, p[k + 1] as number);
    if (i) path.lineTo(x, y);
    else path.moveTo(x, y);
  }
}

function drawMesh(g: Context, c: Camera, vertices: number[], triangles: number[]) {
  g.globalAlpha = 0.35;
  g.beginPath();
  for (let i = 0; i < triangles.length; i += 3) {
    for (let k = 0; k < 3; ++k) {
      const v = (triangles[i + k] as number) * 3;
      const [x, y] = toScreen(c, vertices[v] as number, vertices[v + 1] as number);
      if (k) g.lineTo(x, y);
      else g.moveTo(x, y);
    }
  }
  g.fill();
  g.globalAlpha = 1;
}

export function drawZones(g: Context, c: Camera, zones: Zone[], ink: Ink) {
  for (const zone of zones) {
    const path = new Path2D();
    trace(path, c, { polygon: zone.points.flat() });
    g.fillStyle = ink.zone;
    g.globalAlpha = 0.13;
    g.fill(path);
    g.globalAlpha = 1;
    g.strokeStyle = ink.zone;
    g.lineWidth = 1.5;
    g.setLineDash([6, 4]);
    g.stroke(path);
    g.setLineDash([]);
    const [x, y] = middle(zone.points);
    label(g, c, x, y, zone.name, ink.zone, ink.canvas);
  }
}

function middle(points: [number, number][]): [number, number] {
  let x = 0, y = 0;
  for (const p of points) {
    x += p[0] / points.length;
    y += p[1] / points.length;
  }
  return [x, y];
}

/** One name for a flight of stairs; none for floors and ceilings. */
export function drawNames(g: Context, c: Camera, model: Model, ink: Ink) {
  const labelled = new Set<string>();
  for (const each of model.elements) {
    const name = each.part_of || each.name;
    if (labelled.has(name) || ["floor", "ramp", "ceiling", "wall_above_door", "free_space"].includes(each.label)) continue;
    if (Math.max(each.size[0], each.size[1]) * c.scale < 26) continue;
    labelled.add(name);
    label(g, c, each.at[0], each.at[1], name, each.label === "door" ? ink.door : ink.soft, ink.canvas);
  }
}

/** Of the names in this frame. */
let taken: Rect[] = [];
const widths = new Map<string, number>();

const FONT = "11px system-ui, sans-serif";

/** Of a name, pixels: measured once. */
export function widthOf(g: Context, text: string): number {
  const known = widths.get(text);
  if (known !== undefined) return known;
  if (widths.size > 2000) widths.clear();
  g.font = FONT;
  const width = g.measureText(text).width;
  widths.set(text, width);
  return width;
}

export function label(g: Context, c: Camera, x: number, y: number, text: string, ink: string, halo: string, below = 0) {
  const [ax, ay] = toScreen(c, x, y);
  if (ax < 0 || ay < 0 || ax > c.width || ay > c.height) return;
  labelAt(g, c, ax, ay + below, text, ink, halo);
}

/** Near (ax, ay), pixels: where it is within the canvas and on no other name. */
export function labelAt(g: Context, c: Camera, ax: number, ay: number, text: string, ink: string, halo: string) {
  const [px, py] = placeLabel(ax, ay, widthOf(g, text), c, taken);
  g.font = FONT;
  g.textAlign = "center";
  g.textBaseline = "middle";
  g.lineJoin = "round";
  g.strokeStyle = halo;
  g.lineWidth = 3;
  g.strokeText(text, px, py);
  g.fillStyle = ink;
  g.fillText(text, px, py);
}

export function drawScale(g: Context, c: Camera, ink: Ink) {
  const length = roundLength(c.scale, 60), px = length * c.scale;
  const x = c.width - px - 14, y = c.height - 14;
  g.strokeStyle = ink.soft;
  g.lineWidth = 1.5;
  g.beginPath();
  g.moveTo(x, y - 4);
  g.lineTo(x, y);
  g.lineTo(x + px, y);
  g.lineTo(x + px, y - 4);
  g.stroke();
  g.font = "11px system-ui, sans-serif";
  g.textAlign = "center";
  g.textBaseline = "bottom";
  g.fillStyle = ink.soft;
  g.fillText(length >= 1 ? `${length} m` : `${Math.round(length * 100)} cm`, x + px / 2, y - 3);
}
