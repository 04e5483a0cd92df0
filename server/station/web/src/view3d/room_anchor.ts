/** Anchors of WebXR: a headset that has them corrects drift, survives a reset of its floor space, and finds the room
 * again in another session. */
import { store, stored } from "../parts/stored";
import type { Aligning, AlignmentState } from "./aligning.svelte";
import { composed, relativeTo, type SiteInHeadset } from "./calibration";
import { siteKey } from "./references.svelte";

interface Kept { handle: string; inAnchor: SiteInHeadset; state: AlignmentState }
const isKept = (value: unknown): value is Kept => {
  const { handle, inAnchor, state } = value as Partial<Kept>;
  return typeof handle === "string" && typeof state?.how === "string" && Number.isFinite(state.since) && [inAnchor?.turn, inAnchor?.x, inAnchor?.y, inAnchor?.z].every(Number.isFinite);
};
const key = () => siteKey("alignment");

/** Of a level pose: its heading about the vertical, and its position. */
function levelPose({ position, orientation: q }: XRRigidTransform): SiteInHeadset {
  return { turn: Math.atan2(-2 * (q.x * q.z - q.w * q.y), 1 - 2 * (q.y * q.y + q.z * q.z)), x: position.x, y: position.y, z: position.z };
}

export class RoomAnchor {
  #anchor: XRAnchor | null = null;
  #inAnchor: SiteInHeadset | null = null;
  /** The alignment that the anchor holds, or that one is being made for. */
  #of: AlignmentState | null = null;
  #handle = "";
  /** Restored, but not seen yet. */
  #expected = false;

  constructor(private readonly opened: XRSession, private readonly aligning: Aligning) {}

  /** Looks for the room of an earlier session. */
  async restore() {
    const before = stored<Kept>(key(), isKept);
    if (!before) return;
    const anchor = await this.opened.restorePersistentAnchor?.(before.handle).catch(() => null);
    if (!anchor) return forgetKept();
    if (this.aligning.aligned) return;
    [this.#anchor, this.#inAnchor, this.#handle, this.#of] = [anchor, before.inAnchor, before.handle, { ...before.state, restored: true }];
    this.#expected = this.aligning.kept = true;
  }

  /** In each frame. */
  follow(frame: XRFrame, space: XRSpace, near: { x: number; y: number; z: number }) {
    const { state } = this.aligning;
    if (state && state !== this.#of) void this.#hold(frame, space, near, state);
    const pose = this.#anchor && frame.getPose(this.#anchor.anchorSpace, space);
    if (!pose || !this.#inAnchor || !this.#of) return;
    const place = composed(levelPose(pose.transform), this.#inAnchor);
    if (state === this.#of) this.aligning.place = place;
    else if (this.#expected) this.aligning.restored(place, this.#of);
    this.#expected = false;
  }

  /** True if the alignment outlives a reset of the floor space. */
  get holds(): boolean {
    return this.#anchor !== null && this.#inAnchor !== null && this.#of === this.aligning.state;
  }

  release() {
    this.#anchor?.delete();
    if (this.#handle) void this.opened.deletePersistentAnchor?.(this.#handle).catch(() => null);
    this.#anchor = this.#inAnchor = this.#of = null;
    this.#handle = "";
    this.#expected = false;
    forgetKept();
    this.aligning.kept = false;
  }

  async #hold(frame: XRFrame, space: XRSpace, at: { x: number; y: number; z: number }, state: AlignmentState) {
    this.release();
    this.#of = state;
    const { place } = this.aligning, level = { turn: 0, x: at.x, y: at.y, z: at.z };
    const anchor = await frame.createAnchor?.(new XRRigidTransform(at), space).catch(() => null);
    if (!anchor || this.#of !== state) return;
    [this.#anchor, this.#inAnchor] = [anchor, relativeTo(level, place)];
    const handle = await anchor.requestPersistentHandle?.().catch(() => null);
    if (!handle || this.#of !== state) return;
    this.#handle = handle;
    store(key(), { handle, inAnchor: this.#inAnchor, state });
    this.aligning.kept = true;
  }
}

/** The alignment that waits for the next session; null: none. */
export const keptAlignment = (): AlignmentState | null => stored<Kept>(key(), isKept)?.state ?? null;
export const forgetKept = () => store(key(), null);
