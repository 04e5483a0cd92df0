/** Names on the plan: within its border, and none on another. */
export interface Rect { x0: number; y0: number; x1: number; y1: number }

const HALF_LINE = 7, STEP = 13, MARGIN = 3;
/** Shifts that are tried, in lines: below first. */
const SHIFTS = [0, 1, -1, 2, -2, 3];

const overlap = (a: Rect, b: Rect) => a.x0 < b.x1 && b.x0 < a.x1 && a.y0 < b.y1 && b.y0 < a.y1;

/** The middle of a text of this width in a canvas, as near as possible to (x, y), pixels; it is added to `taken`. */
export function placeLabel(x: number, y: number, textWidth: number, canvas: { width: number; height: number }, taken: Rect[]): [number, number] {
  const half = textWidth / 2;
  const px = Math.min(Math.max(x, half + MARGIN), Math.max(half + MARGIN, canvas.width - half - MARGIN));
  const clamp = (py: number) => Math.min(Math.max(py, HALF_LINE), canvas.height - HALF_LINE);
  const rectAt = (py: number): Rect => ({ x0: px - half, y0: py - HALF_LINE + 1, x1: px + half, y1: py + HALF_LINE - 1 });
  const free = SHIFTS.map((lines) => clamp(y + lines * STEP)).find((py) => !taken.some((each) => overlap(each, rectAt(py))));
  const py = free ?? clamp(y);
  taken.push(rectAt(py));
  return [px, py];
}
