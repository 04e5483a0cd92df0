/** The plan's view: the map point in the middle of the canvas, and pixels per metre. y is up in map. */
import type { MapPoint } from "./tool.svelte";

export interface Camera { x: number; y: number; scale: number; width: number; height: number }
export const MIN_SCALE = 0.5, MAX_SCALE = 800;

export const toScreen = (c: Camera, x: number, y: number): [number, number] => [c.width / 2 + (x - c.x) * c.scale, c.height / 2 - (y - c.y) * c.scale];
export const toMapPoint = (c: Camera, px: number, py: number): MapPoint => ({ x: c.x + (px - c.width / 2) / c.scale, y: c.y - (py - c.height / 2) / c.scale });

/** Keeps the point under the pointer in place. */
export function zoomed(c: Camera, factor: number, px: number, py: number): Camera {
  const at = toMapPoint(c, px, py);
  const scale = Math.min(MAX_SCALE, Math.max(MIN_SCALE, c.scale * factor));
  return { ...c, scale, x: at.x - (px - c.width / 2) / scale, y: at.y + (py - c.height / 2) / scale };
}

export const panned = (c: Camera, dx: number, dy: number): Camera => ({ ...c, x: c.x - dx / c.scale, y: c.y + dy / c.scale });

/** Free margins in pixels: above for the buttons, below for the scale bar. */
const above = 46, below = 36, beside = 16;

export function fitted(c: Camera, box: { x0: number; y0: number; x1: number; y1: number }): Camera {
  const height = Math.max(c.height - above - below, c.height / 3);
  const fits = Math.min((c.width - 2 * beside) / (box.x1 - box.x0), height / (box.y1 - box.y0));
  const scale = Math.min(MAX_SCALE, Math.max(MIN_SCALE, fits));
  return { ...c, x: (box.x0 + box.x1) / 2, y: (box.y0 + box.y1) / 2 + (above - below) / 2 / scale, scale };
}

/** A round number of metres (1, 2, 5 times a power of ten) that takes at least `pixels`. */
export function roundLength(scale: number, pixels: number): number {
  const wanted = pixels / scale, power = 10 ** Math.floor(Math.log10(wanted));
  for (const step of [1, 2, 5, 10]) if (step * power >= wanted) return step * power;
  return 10 * power;
}
