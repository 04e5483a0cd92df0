/** The alignment of one headset session: touches and images of a marker come in, the site's pose comes out. */
import { session } from "../session/session.svelte";
import { site } from "../session/site.svelte";
import { alignByPoints, MAX_RMS_M, offBy, type Aligned, type Reference, type Refusal, type Touch } from "./alignment";
import { assumed, calibrated, inSite, type HeadsetPoint, type SiteInHeadset, type Standing } from "./calibration";
import { floorAt, wallFootprints } from "./landmarks";
import { alignByMarker, MIN_SIGHTS, type MarkerSight } from "./marker";
import { references, type ChosenPoint, type Method } from "./references.svelte";

/** Errors are null if nothing measures them; `since` in ms since 1970; `restored`: by an anchor of the headset. */
export interface AlignmentState { how: Method; points: number; error_m: number | null; error_rad: number | null; since: number; restored: boolean }

/** A press this near to a known place is a check of it. */
const CHECK_M = 0.5;

export class Aligning {
  place: SiteInHeadset;
  /** null: the site's pose is assumed. */
  state = $state.raw<AlignmentState | null>(null);
  refusal = $state.raw<Refusal | null>(null);
  /** The newest touch of a known place since the alignment: what it was off by, m. */
  off_m = $state.raw<number | null>(null);
  spaceReset = $state.raw(false);
  /** The headset restores the alignment in its next session. */
  kept = $state.raw(false);
  /** Touches of the chosen points, in their order. */
  touches = $state.raw<Touch[]>([]);
  #sights: MarkerSight[] = [];

  constructor(private readonly robot: string) {
    this.place = assumed(this.#pose() ?? { x: 0, y: 0, yaw: 0 }, this.#floor());
  }

  get aligned(): boolean {
    return this.state !== null;
  }
  get drifted(): boolean {
    return this.off_m !== null && this.off_m > 2 * MAX_RMS_M;
  }
  /** The next point to be touched; null: none, or too few are chosen. */
  get next(): ChosenPoint | null {
    const { method, points } = references, { state } = this;
    if (method !== "points" || points.length < 2 || (state && (state.how !== "points" || state.restored))) return null;
    return points[this.touches.length] ?? null;
  }

  restart() {
    this.state = this.refusal = this.off_m = null;
    this.touches = [];
    this.#sights = [];
  }

  /** The floor space moved, and no anchor says how. */
  reset() {
    this.restart();
    this.spaceReset = true;
  }

  restored(place: SiteInHeadset, state: AlignmentState) {
    this.place = place;
    this.state = state;
  }

  /** The trigger, at a place that the chosen method asks for. */
  touch(hand: HeadsetPoint, pointing: HeadsetPoint, eye: HeadsetPoint) {
    if (references.method === "robot") this.#overRobot(hand, pointing);
    else if (this.next) this.#atPoint(this.next, hand, eye);
    else if (this.aligned) this.#check(hand, eye);
  }

  sight(sight: MarkerSight) {
    const { marker } = references;
    if (!marker) return;
    this.#sights.push(sight);
    if (this.#sights.length < 2 * MIN_SIGHTS) return;
    // Seen again later, it corrects what has drifted since.
    this.#apply(alignByMarker(this.#sights, { ...marker, z: marker.z + this.#floor(marker) }), "marker", 0);
    this.#sights = [];
  }

  #overRobot(hand: HeadsetPoint, pointing: HeadsetPoint) {
    const pose = this.#pose();
    const place = pose && !this.aligned ? calibrated(hand, pointing, pose, this.#floor()) : null;
    if (place) this.#accept({ place, error_m: NaN, error_rad: NaN }, "robot", 0);
  }

  #atPoint(point: ChosenPoint, hand: HeadsetPoint, eye: HeadsetPoint) {
    const reference = this.#now(point);
    if (!reference) return;
    const touches = [...this.touches, { reference, hand, eye }];
    this.touches = touches;
    this.refusal = null;
    if (touches.length < 2 || this.#solve(touches)) return;
    // A further point that does not fit leaves the alignment as it is; without one, all are touched again.
    this.touches = this.aligned ? touches.slice(0, -1) : [];
  }

  /** What fits better than the limit improves the alignment; what does not is shown as drift. */
  #check(hand: HeadsetPoint, eye: HeadsetPoint) {
    const at = inSite(this.place, hand), points = references.points.map((each) => this.#now(each));
    const distances = points.map((each) => (each ? Math.hypot(each.x - at.x, each.y - at.y) : Infinity)), nearest = distances.indexOf(Math.min(...distances));
    const reference = points[nearest];
    if (!reference || (distances[nearest] as number) > CHECK_M) return;
    const touch = { reference, hand, eye };
    this.off_m = offBy(this.place, touch);
    if (this.off_m > MAX_RMS_M || this.touches.length !== points.length) return;
    const touches = this.touches.map((each, i) => (i === nearest ? touch : each));
    if (this.#solve(touches)) this.touches = touches;
  }

  #solve(touches: Touch[]): boolean {
    const { reference } = touches[0] as Touch;
    return this.#apply(alignByPoints(touches, this.#floor(reference), site.model ? wallFootprints(site.model) : []), "points", touches.length);
  }

  #apply({ aligned, refusal }: ReturnType<typeof alignByPoints>, how: Method, points: number): boolean {
    this.refusal = refusal ?? null;
    if (aligned) this.#accept(aligned, how, points);
    return aligned !== undefined;
  }

  #accept({ place, error_m, error_rad }: Aligned, how: Method, points: number) {
    const known = (value: number) => (Number.isFinite(value) ? value : null);
    this.place = place;
    this.spaceReset = false;
    this.state = { how, points, error_m: known(error_m), error_rad: known(error_rad), since: Date.now(), restored: false };
  }

  #now({ robot, x, y, z }: ChosenPoint): Reference | null {
    const pose = robot ? session.poseOf(robot) : null;
    return robot ? pose && { x: pose.x, y: pose.y } : { x, y, ...(z === undefined ? {} : { z }) };
  }

  #pose(): (Standing & { z: number }) | null {
    return session.poseOf(this.robot);
  }

  /** Of the wearer's storey, which is the robot's. */
  #floor(at?: { x: number; y: number }): number {
    const pose = this.#pose(), place = at ?? pose;
    return place ? floorAt(site.model, place.x, place.y, pose?.z ?? 0) : 0;
  }
}
