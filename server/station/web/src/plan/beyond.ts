/** Hints at the plan's border for what lies beyond it. */
import { toScreen, type Camera } from "./camera";

export interface Placed { name: string; x: number; y: number }
/** `px`, `py`: of the arrow's tip, pixels; `heading`: rad on the screen, 0 to the right, clockwise; `away`: m to the border's
 * inside; `more`: others that have no hint of their own. */
export interface Hint { name: string; px: number; py: number; heading: number; away: number; more: number }

/** Free of the buttons above and the scale bar below. */
const INSET = { side: 10, top: 50, bottom: 34 };
export const MOST_HINTS = 6;

/** For those outside of the canvas, the nearest first. */
export function beyond(c: Camera, things: Placed[]): Hint[] {
  const hints: Hint[] = [];
  const left = INSET.side, right = c.width - INSET.side, top = INSET.top, bottom = c.height - INSET.bottom;
  if (right <= left || bottom <= top) return hints;
  for (const { name, x, y } of things) {
    const [sx, sy] = toScreen(c, x, y);
    if (sx >= 0 && sy >= 0 && sx <= c.width && sy <= c.height) continue;
    const px = Math.min(right, Math.max(left, sx)), py = Math.min(bottom, Math.max(top, sy));
    hints.push({ name, px, py, heading: Math.atan2(sy - py, sx - px), away: Math.hypot(sx - px, sy - py) / c.scale, more: 0 });
  }
  hints.sort((a, b) => a.away - b.away || (a.name < b.name ? -1 : 1));
  const last = hints[MOST_HINTS - 1];
  if (last) last.more = hints.length - MOST_HINTS;
  return hints.slice(0, MOST_HINTS);
}
