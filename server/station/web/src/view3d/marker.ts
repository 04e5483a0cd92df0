/** Alignment by a printed marker on a wall, seen by a headset that tracks images. Metres and radians. */
import type { Outcome } from "./alignment";
import type { HeadsetPoint } from "./calibration";

/** Centre of the marker in map, direction of its normal out of the wall, its width. */
export interface MarkerPlace { x: number; y: number; z: number; yaw: number; width_m: number }
/** One image of it: centre, direction to its right edge, normal towards the viewer (unit lengths), in the headset's
 * space; width as measured by the headset, null if it does not measure. */
export interface MarkerSight { at: HeadsetPoint; right: HeadsetPoint; normal: HeadsetPoint; width_m: number | null }

export const MIN_SIGHTS = 20;
const MAX_TILT_RAD = 0.2, MAX_SIZE_ERROR = 0.08;
const MAX_SCATTER_M = 0.03, MAX_SCATTER_RAD = 0.05;

/** The mean of all; the error is their scatter (1 sigma). */
export function alignByMarker(sights: readonly MarkerSight[], marker: MarkerPlace): Outcome {
  const n = sights.length;
  if (n < MIN_SIGHTS) return { refusal: { why: "few" } };
  const mean = (of: (sight: MarkerSight) => number) => sights.reduce((sum, sight) => sum + of(sight), 0) / n;
  const widths = sights.flatMap(({ width_m }) => (width_m ? [width_m] : [])), width = widths.reduce((sum, each) => sum + each, 0) / widths.length;
  if (widths.length && Math.abs(width / marker.width_m - 1) > MAX_SIZE_ERROR) return { refusal: { why: "size", measured_m: width } };
  const tilt = Math.max(Math.asin(Math.min(1, Math.abs(mean((s) => s.normal.y)))), Math.asin(Math.min(1, Math.abs(mean((s) => s.right.y)))));
  if (tilt > MAX_TILT_RAD) return { refusal: { why: "tilted", rad: tilt } };
  const at = { x: mean((s) => s.at.x), y: mean((s) => s.at.y), z: mean((s) => s.at.z) };
  const u = mean((s) => s.normal.x), v = mean((s) => -s.normal.z);
  const error_m = Math.sqrt(mean((s) => (s.at.x - at.x) ** 2 + (s.at.y - at.y) ** 2 + (s.at.z - at.z) ** 2));
  // Of directions: 1 - R is half their variance.
  const error_rad = Math.sqrt(2 * Math.max(0, 1 - mean((s) => (s.normal.x * u - s.normal.z * v) / (Math.hypot(s.normal.x, s.normal.z) * Math.hypot(u, v)))));
  if (error_m > MAX_SCATTER_M || error_rad > MAX_SCATTER_RAD) return { refusal: { why: "unsteady", scatter_m: error_m } };
  const turn = Math.atan2(v, u) - marker.yaw, cos = Math.cos(turn), sin = Math.sin(turn);
  return {
    aligned: {
      place: { turn, x: at.x - cos * marker.x + sin * marker.y, y: at.y - marker.z, z: at.z + sin * marker.x + cos * marker.y },
      error_m, error_rad,
    },
  };
}
