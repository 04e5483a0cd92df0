/** Initial poses of a form. */
import { poseOf } from "../session/poses";
import type { WorldFrame } from "../session/frames";
import type { Entity } from "../session/protocol";
import type { MapPoint } from "./palette";

/** `metres` in front of an entity; null: its pose is unknown. */
export function ahead(entity: Entity | undefined, world: WorldFrame | null, metres: number): (MapPoint & { yaw: number }) | null {
  const pose = poseOf(entity, world);
  if (!pose) return null;
  const { yaw } = pose;
  return { x: pose.x + metres * Math.cos(yaw), y: pose.y + metres * Math.sin(yaw), yaw };
}
