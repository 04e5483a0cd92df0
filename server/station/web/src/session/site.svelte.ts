/** Static content: the semantic model, the map's picture, the robots' descriptions. Fetched once; the model again
 * when the server reports a change. */
import { parseFrame, type PointsFrame } from "./frames";
import { parseRecorded, type Recorded } from "./recorded";
import type { Quaternion, Shape, Triple } from "./protocol";

export interface Element {
  name: string; label: string; at: Triple; turn: Quaternion; size: Triple; confidence: number | null; virtual: boolean; hinged?: boolean; part_of: string;
}
/** Triangles in map; three floats per vertex, three indices per triangle. */
export interface Mesh { name: string; vertices: number[]; triangles: number[] }
export interface Model { version: number | string; map_id?: string; elements: Element[]; meshes: Mesh[] }
/** Lower left corner of the picture in map, m; metres per pixel. */
export interface MapPicture { image: ImageBitmap; x: number; y: number; resolution: number }
export interface CameraInfo { at: Triple; turn: Quaternion; width: number; height: number; fx: number; fy: number; cx: number; cy: number }
export interface RobotInfo {
  name: string; model?: string; footprint: [number, number][]; height: number; laser?: { at: Triple; turn: Quaternion; range_max: number | null };
  camera?: CameraInfo; depth?: CameraInfo; links?: { name: string; visual: Shape[] }[];
}

class Site {
  model = $state.raw<Model | null>(null);
  map = $state.raw<MapPicture | null>(null);
  robots = $state.raw<RobotInfo[]>([]);
  /** The registered cloud; null: not requested, or there is none. */
  cloud = $state.raw<PointsFrame | null>(null);
  /** What it looks like; null: not requested, or it was not recorded. */
  recorded = $state.raw<Recorded | null>(null);
  #askedForCloud = false;
  #askedForRecorded = false;

  async fetchModel(): Promise<void> {
    const model = await json<Model>("api/v1/model");
    if (model && Array.isArray(model.elements)) this.model = { ...model, meshes: Array.isArray(model.meshes) ? model.meshes : [] };
  }

  async fetchMap(): Promise<void> {
    const answer = await fetch("api/v1/map").catch(() => null);
    if (!answer?.ok) return;
    const resolution = Number(answer.headers.get("X-Resolution"));
    const [x = NaN, y = NaN] = (answer.headers.get("X-Origin") ?? "").split(",").map(Number);
    if (!(resolution > 0) || !Number.isFinite(x + y)) return console.error("the map does not say where it lies");
    this.map = { image: await createImageBitmap(await answer.blob()), x, y, resolution };
  }

  /** Large: loaded once, on demand. False: the server has none. */
  async fetchCloud(): Promise<boolean> {
    if (this.#askedForCloud) return true;
    this.#askedForCloud = true;
    const answer = await fetch("api/v1/cloud").catch(() => null);
    if (!answer?.ok) {
      this.#askedForCloud = false;
      return false;
    }
    const frame = parseFrame(await answer.arrayBuffer());
    if (frame.kind === "points") this.cloud = frame;
    return true;
  }

  /** Large: loaded once, on demand. */
  async fetchRecorded(): Promise<void> {
    if (this.#askedForRecorded) return;
    this.#askedForRecorded = true;
    const answer = await fetch("api/v1/texture").catch(() => null);
    this.#askedForRecorded = answer?.ok ?? false;
    if (answer?.ok) this.recorded = await parseRecorded(await answer.arrayBuffer());
  }

  async fetchRobots(): Promise<void> {
    const found = await json<{ robots: RobotInfo[] }>("api/v1/robots");
    if (found && Array.isArray(found.robots)) this.robots = found.robots;
  }
}

export async function json<T>(path: string): Promise<T | null> {
  const answer = await fetch(path).catch(() => null);
  return answer?.ok ? ((await answer.json()) as T) : null;
}

export const site = new Site();

export interface Bounds { x0: number; y0: number; x1: number; y1: number }

/** Smallest rectangle around the model or the map, m; null if neither is known. */
export function siteBounds(model: Model | null, map: MapPicture | null): Bounds | null {
  let x0 = Infinity, y0 = Infinity, x1 = -Infinity, y1 = -Infinity;
  const take = (x: number, y: number) => { x0 = Math.min(x0, x); y0 = Math.min(y0, y); x1 = Math.max(x1, x); y1 = Math.max(y1, y); };
  for (const { at, size, turn } of model?.elements ?? []) {
    const yaw = 2 * Math.atan2(turn[2], turn[3]), cos = Math.abs(Math.cos(yaw)), sin = Math.abs(Math.sin(yaw));
    const dx = (cos * size[0] + sin * size[1]) / 2, dy = (sin * size[0] + cos * size[1]) / 2;
    take(at[0] - dx, at[1] - dy);
    take(at[0] + dx, at[1] + dy);
  }
  for (const mesh of model?.meshes ?? [])
    for (let i = 0; i + 2 < mesh.vertices.length; i += 3) take(mesh.vertices[i] ?? 0, mesh.vertices[i + 1] ?? 0);
  if (map && !(x1 > x0)) {
    take(map.x, map.y);
    take(map.x + map.image.width * map.resolution, map.y + map.image.height * map.resolution);
  }
  return x1 > x0 && y1 > y0 ? { x0, y0, x1, y1 } : null;
}

/** Levels of knowledge about the region of interest, in ascending order; each one resets the initial view. */
export const known = ["nothing", "site", "others", "robot"] as const;
export type Known = (typeof known)[number];

const MARGIN_M = 7, DWARFED = 1.6;
/** The initial view: the site, or the part with robots and agents if the site is much larger. */
export function firstBounds(site: Bounds | null, places: readonly { x: number; y: number }[]): Bounds | null {
  if (!site || !places.length) return site;
  const xs = places.map((each) => each.x), ys = places.map((each) => each.y);
  const near = { x0: Math.min(...xs) - MARGIN_M, y0: Math.min(...ys) - MARGIN_M, x1: Math.max(...xs) + MARGIN_M, y1: Math.max(...ys) + MARGIN_M };
  const reach = ({ x0, y0, x1, y1 }: Bounds) => Math.max(x1 - x0, y1 - y0);
  return reach(site) > DWARFED * reach(near) ? near : site;
}
