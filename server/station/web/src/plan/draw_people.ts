/** Real people: a ring for where they may be, and an arrow as long as they walk in a second. */
import type { FlatPose } from "../session/poses";
import type { RealPerson } from "../session/protocol";
import { toScreen, type Camera } from "./camera";

/** Standard deviations in the ring, beside the person's own radius. */
export const RING_SIGMAS = 2;
/** Slower people have no arrow, m/s. */
export const WALKS = 0.15;

/** Half axes of the ring, m. */
export const ringOf = ({ radius, ellipse }: RealPerson): [number, number] => [radius + RING_SIGMAS * ellipse[0], radius + RING_SIGMAS * ellipse[1]];

export function drawPeople(g: CanvasRenderingContext2D, c: Camera, people: RealPerson[], poseOf: (name: string) => FlatPose | null, ink: string) {
  g.strokeStyle = ink;
  g.lineWidth = 2;
  for (const person of people) {
    const pose = poseOf(person.name);
    if (!pose) continue;
    const [px, py] = toScreen(c, pose.x, pose.y), [major, minor] = ringOf(person), [vx, vy] = person.velocity;
    g.beginPath();
    g.ellipse(px, py, Math.max(8, major * c.scale), Math.max(8, minor * c.scale), -person.ellipse[2], 0, Math.PI * 2);
    g.stroke();
    if (Math.hypot(vx, vy) > WALKS) arrow(g, px, py, ...toScreen(c, pose.x + vx, pose.y + vy));
  }
}

function arrow(g: CanvasRenderingContext2D, ax: number, ay: number, bx: number, by: number) {
  const heading = Math.atan2(by - ay, bx - ax);
  g.beginPath();
  g.moveTo(ax, ay);
  g.lineTo(bx, by);
  for (const side of [2.6, -2.6]) {
    g.moveTo(bx, by);
    g.lineTo(bx + 8 * Math.cos(heading + side), by + 8 * Math.sin(heading + side));
  }
  g.stroke();
}
