/** Age of the displayed picture, and its text. */
import type { Frame } from "./frame";

export const warnMs = 150;
/** Limits on silence and age above which a picture is not shown as live. */
export const staleMs = 1000;
/** A stamp farther off than this is from another time: a recording's. */
const otherTimeMs = 60_000;

export type Freshness = "none" | "fresh" | "late" | "stale";

export interface FrameAge {
  ms: number;
  /** `camera`: since its stamp; `server`: since the server sent it, if the camera's stamp is from another time. */
  since: "camera" | "server";
}

/** `serverUs`: the server's clock now; undefined: unknown yet. */
export function frameAge(frame: Pick<Frame, "stampUs" | "serverUs">, serverUs: number | undefined): FrameAge | undefined {
  if (serverUs === undefined) return undefined;
  const camera = (serverUs - frame.stampUs) / 1000;
  if (Math.abs(camera) < otherTimeMs) return { ms: Math.max(0, camera), since: "camera" };
  return { ms: Math.max(0, (serverUs - frame.serverUs) / 1000), since: "server" };
}

/** `quietMs`: since the last frame was displayed. `age`: of that frame now. `rate`: of the session, times real time: one
 * that runs slower has its pictures as much farther apart, and each is shown as much longer. */
export function freshness(quietMs: number | undefined, age: FrameAge | undefined, rate = 1): Freshness {
  if (quietMs === undefined) return "none";
  const slowed = rate > 0 ? Math.min(1, rate) : 1;
  const ageMs = (age?.ms ?? 0) * slowed;
  if (quietMs * slowed > staleMs || ageMs > staleMs) return "stale";
  return ageMs > warnMs ? "late" : "fresh";
}

/** Position of a recording, and since when by the page's clock. */
export interface PausedPosition { position: number; at: number }
/** Maximum length in s of a step by single messages without a new picture. */
const stepS = 0.2;

export function pausedPosition(before: PausedPosition | null, control: { paused: boolean; position: number } | null, now: number): PausedPosition | null {
  if (!control?.paused) return null;
  const on = before ? control.position - before.position : NaN;
  return { position: control.position, at: before && on >= 0 && on < stepS ? before.at : now };
}

/** The server reports its position each second. */
const toldMs = 1200;
/** True if the picture belongs to the recording's position. `soughtAt`: time of this page's last seek. */
export const isOfPosition = (pausedAt: PausedPosition | null, shownAt: number | undefined, soughtAt: number): boolean =>
  pausedAt !== null && shownAt !== undefined && shownAt > Math.max(pausedAt.at - toldMs, soughtAt);

/** Median and 95th percentile of recent values, for the panel's title. */
export class AgeStatistics {
  private ages: number[] = [];
  add(ms: number): void {
    this.ages.push(ms);
    if (this.ages.length > 150) this.ages.shift();
  }
  quantile(fraction: number): number | undefined {
    const sorted = [...this.ages].sort((a, b) => a - b);
    return sorted[Math.min(sorted.length - 1, Math.floor(fraction * sorted.length))];
  }
}
