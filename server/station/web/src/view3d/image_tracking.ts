/** Image tracking of WebXR (immersive-web/marker-tracking, a draft): few browsers have it. */
import { Quaternion, Vector3 } from "three";
import { markerImage } from "./marker_picture";
import type { MarkerSight } from "./marker";

interface TrackingResult { index: number; imageSpace: XRSpace; trackingState: "untracked" | "tracked" | "emulated"; measuredWidthInMeters?: number }
type TrackingFrame = XRFrame & { getImageTrackingResults?: () => TrackingResult[] };
type TrackingSession = XRSession & { getTrackedImageScores?: () => Promise<string[]> };

/** Added to the options of a session; a browser without image tracking ignores them. */
export const trackedMarker = async (width_m: number) => ({ trackedImages: [{ image: await markerImage(), widthInMeters: width_m }] });

/** Resolves with false if this session will never see the marker. */
export async function tracksImages(opened: TrackingSession): Promise<boolean> {
  const scores = await opened.getTrackedImageScores?.().catch(() => null);
  return scores?.[0] === "trackable";
}

/** The marker in this frame; null: not seen. Its image space has x to its right edge, y up, z to the viewer. */
export function markerSight(frame: TrackingFrame, space: XRSpace): MarkerSight | null {
  const found = frame.getImageTrackingResults?.().find((each) => each.index === 0 && each.trackingState === "tracked");
  const pose = found && frame.getPose(found.imageSpace, space);
  if (!pose) return null;
  const { position, orientation: { x, y, z, w } } = pose.transform, turn = new Quaternion(x, y, z, w);
  return {
    at: { x: position.x, y: position.y, z: position.z }, width_m: found.measuredWidthInMeters ?? null,
    right: new Vector3(1, 0, 0).applyQuaternion(turn), normal: new Vector3(0, 0, 1).applyQuaternion(turn),
  };
}
