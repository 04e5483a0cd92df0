/** The printed marker: squares that repeat nowhere, so that a headset recognizes them and their orientation. */
const CELLS = 24, PIXELS = 768;
export const FRAME_CELLS = 1;

export function drawMarker(canvas: HTMLCanvasElement) {
  canvas.width = canvas.height = PIXELS;
  const g = canvas.getContext("2d");
  if (!g) return;
  const cell = PIXELS / CELLS;
  g.fillStyle = "#000";
  g.fillRect(0, 0, PIXELS, PIXELS);
  for (let row = FRAME_CELLS; row < CELLS - FRAME_CELLS; ++row)
    for (let column = FRAME_CELLS; column < CELLS - FRAME_CELLS; ++column) {
      const shade = hash(row * CELLS + column);
      g.fillStyle = shade < 0.45 ? "#000" : shade < 0.9 ? "#fff" : "#888";
      g.fillRect(column * cell, row * cell, cell, cell);
    }
}

export async function markerImage(): Promise<ImageBitmap> {
  const canvas = document.createElement("canvas");
  drawMarker(canvas);
  return createImageBitmap(canvas);
}

/** The same for all sites: 0..1 (finalizer of MurmurHash3). */
function hash(n: number): number {
  let h = n + 0x9e3779b9;
  h = Math.imul(h ^ (h >>> 16), 0x85ebca6b);
  h = Math.imul(h ^ (h >>> 13), 0xc2b2ae35);
  return ((h ^ (h >>> 16)) >>> 0) / 2 ** 32;
}
