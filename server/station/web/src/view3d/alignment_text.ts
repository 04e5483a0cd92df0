/** The alignment in words, for the page and for the boards in the headset. */
import { strings } from "../strings.en";
import type { Aligning, AlignmentState } from "./aligning.svelte";
import type { Refusal } from "./alignment";
import { references } from "./references.svelte";

const words = strings.headset;
const cm = (metres: number) => (metres * 100).toFixed(1);
const degrees = (rad: number) => ((rad * 180) / Math.PI).toFixed(1);

export function refusalText(refusal: Refusal): string {
  const texts = words.refusals;
  switch (refusal.why) {
    case "near": return texts.near(refusal.apart_m.toFixed(2));
    case "distance": return texts.distance(refusal.map_m.toFixed(2), refusal.headset_m.toFixed(2));
    case "residual": return texts.residual(cm(refusal.rms_m), refusal.worst + 1);
    case "hidden": return texts.hidden(refusal.touch + 1);
    case "tilted": return texts.tilted(degrees(refusal.rad));
    case "size": return texts.size(cm(refusal.measured_m));
    case "unsteady": return texts.unsteady(cm(refusal.scatter_m));
    default: return texts[refusal.why];
  }
}

/** How, error, since when; or that nothing is known. */
export function stateText(state: AlignmentState | null): string {
  if (!state) return words.notAligned;
  const how = state.how === "points" ? words.how.points(state.points) : words.how[state.how];
  const error = state.error_m === null ? words.noError : words.error(cm(state.error_m), degrees(state.error_rad ?? 0));
  return words.aligned(state.restored ? `${how}, ${words.restored}` : how, error, new Date(state.since).toLocaleTimeString());
}

/** Warnings and refusals; empty: none. */
export function warningText({ refusal, off_m, drifted, spaceReset }: Aligning): string {
  if (refusal) return refusalText(refusal);
  if (spaceReset) return words.spaceReset;
  if (off_m === null) return "";
  return drifted ? words.drifted(cm(off_m)) : words.checked(cm(off_m));
}

/** What the wearer is to do next; null: nothing. `tracks`: images can be tracked. */
export function promptLines(aligning: Aligning, tracks: boolean): string[] | null {
  const { next } = aligning, { method, points, marker } = references;
  if (next) return words.byPoint(aligning.touches.length + 1, points.length, next.name);
  if (aligning.aligned) return null;
  if (method === "robot") return words.byRobot;
  if (method === "points") return words.noPoints;
  if (!tracks) return words.noTracking;
  return marker ? words.byMarker : words.noMarker;
}
