/** How the headset is to be aligned in this site, and with which known places; stored in this browser. */
import { session } from "../session/session.svelte";
import { site } from "../session/site.svelte";
import { stored, store } from "../parts/stored";
import type { Reference } from "./alignment";
import type { MarkerPlace } from "./marker";

export const methods = ["robot", "points", "marker"] as const;
export type Method = (typeof methods)[number];
/** `robot`: the origin of that robot, wherever it stands. */
export interface ChosenPoint extends Reference { name: string; robot?: string }
export interface ChosenMarker extends MarkerPlace { wall: string }
interface Chosen { method: Method; points: ChosenPoint[]; marker: ChosenMarker | null }

/** Of a site and its map: places of another map mean nothing. */
export const siteKey = (purpose: string) => `parhelion.headset.${purpose}.${session.hello?.session.scenario ?? ""}.${site.model?.map_id ?? ""}`;

class References {
  method = $state<Method>("robot");
  points = $state.raw<ChosenPoint[]>([]);
  marker = $state.raw<ChosenMarker | null>(null);

  load() {
    const { method, points, marker } = stored<Chosen>(siteKey("references"), isChosen) ?? { method: "robot", points: [], marker: null };
    [this.method, this.points, this.marker] = [method, points, marker];
  }

  change(change: Partial<Chosen>) {
    Object.assign(this, change);
    store(siteKey("references"), { method: this.method, points: this.points, marker: this.marker });
  }
}

export const references = new References();

function isChosen(value: unknown): value is Chosen {
  const { method, points, marker } = value as Partial<Chosen>;
  return methods.includes(method as Method) && Array.isArray(points) && points.every((each) => Number.isFinite(each.x + each.y)) &&
    (marker === null || (typeof marker === "object" && [marker.x, marker.y, marker.z, marker.yaw].every(Number.isFinite) && marker.width_m > 0));
}
