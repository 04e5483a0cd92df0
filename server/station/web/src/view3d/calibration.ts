/** Pose of the site in the headset's floor space (x right, y up, z back; metres), found by holding a controller over
 * the robot, pointed in the robot's heading. Both spaces are level, so it is a rotation about the vertical and a
 * translation. */

export interface HeadsetPoint { x: number; y: number; z: number }
export interface Standing { x: number; y: number; yaw: number }
/** Headset = rotation by `turn` about y, then translation; the site's z up becomes y. */
export interface SiteInHeadset { turn: number; x: number; z: number }

/** `pointing` need not be level; null if it points straight up or down, which leaves the heading undefined. */
export function calibrated(hand: HeadsetPoint, pointing: HeadsetPoint, robot: Standing): SiteInHeadset | null {
  if (Math.hypot(pointing.x, pointing.z) < 0.2 * Math.hypot(pointing.x, pointing.y, pointing.z)) return null;
  // Before the rotation, the site's x and y are along the headset's x and -z.
  const turn = Math.atan2(-pointing.z, pointing.x) - robot.yaw;
  const u = Math.cos(turn) * robot.x - Math.sin(turn) * robot.y, v = Math.sin(turn) * robot.x + Math.cos(turn) * robot.y;
  return { turn, x: hand.x - u, z: hand.z + v };
}

/** Before a calibration: the robot is assumed two metres ahead of the wearer, facing away. */
export const assumed = (robot: Standing): SiteInHeadset => calibrated({ x: 0, y: 0, z: -2 }, { x: 0, y: 0, z: -1 }, robot) as SiteInHeadset;

/** A point of the site in the headset's space. */
export function inHeadset({ turn, x, z }: SiteInHeadset, px: number, py: number, pz: number): HeadsetPoint {
  return { x: x + Math.cos(turn) * px - Math.sin(turn) * py, y: pz, z: z - (Math.sin(turn) * px + Math.cos(turn) * py) };
}
