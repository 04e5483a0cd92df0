/** Pose of the site in the headset's floor space (x right, y up, z back; metres). Both spaces are level, so it is a
 * rotation about the vertical and a translation. */

export interface HeadsetPoint { x: number; y: number; z: number }
export interface Standing { x: number; y: number; yaw: number }
/** Headset = rotation by `turn` about y, then translation; the site's z up becomes y. */
export interface SiteInHeadset { turn: number; x: number; y: number; z: number }

/** By a controller that is held over the robot and points in its heading; `floor`: height of the floor in the site, m.
 * `pointing` need not be level; null if it points straight up or down, which leaves the heading undefined. */
export function calibrated(hand: HeadsetPoint, pointing: HeadsetPoint, robot: Standing, floor = 0): SiteInHeadset | null {
  if (Math.hypot(pointing.x, pointing.z) < 0.2 * Math.hypot(pointing.x, pointing.y, pointing.z)) return null;
  // Before the rotation, the site's x and y are along the headset's x and -z.
  const turn = Math.atan2(-pointing.z, pointing.x) - robot.yaw;
  const u = Math.cos(turn) * robot.x - Math.sin(turn) * robot.y, v = Math.sin(turn) * robot.x + Math.cos(turn) * robot.y;
  return { turn, x: hand.x - u, y: -floor, z: hand.z + v };
}

/** Before a calibration: the robot is assumed two metres ahead of the wearer, facing away. */
export const assumed = (robot: Standing, floor = 0): SiteInHeadset => calibrated({ x: 0, y: 0, z: -2 }, { x: 0, y: 0, z: -1 }, robot, floor) as SiteInHeadset;

/** A point of the site in the headset's space. */
export function inHeadset({ turn, x, y, z }: SiteInHeadset, px: number, py: number, pz: number): HeadsetPoint {
  return { x: x + Math.cos(turn) * px - Math.sin(turn) * py, y: y + pz, z: z - (Math.sin(turn) * px + Math.cos(turn) * py) };
}

/** A point of the headset's space in the site. */
export function inSite({ turn, x, y, z }: SiteInHeadset, p: HeadsetPoint): HeadsetPoint {
  const u = p.x - x, v = z - p.z;
  return { x: Math.cos(turn) * u + Math.sin(turn) * v, y: Math.cos(turn) * v - Math.sin(turn) * u, z: p.y - y };
}

/** A pose known in an anchor's frame, in the headset's space. */
export function composed(anchor: SiteInHeadset, inAnchor: SiteInHeadset): SiteInHeadset {
  const { x, y, z } = inHeadset(anchor, inAnchor.x, -inAnchor.z, inAnchor.y);
  return { turn: anchor.turn + inAnchor.turn, x, y, z };
}

/** The inverse: `place` in the anchor's frame. */
export function relativeTo(anchor: SiteInHeadset, place: SiteInHeadset): SiteInHeadset {
  const { x, y, z } = inSite(anchor, place);
  return { turn: place.turn - anchor.turn, x, y: z, z: -y };
}
