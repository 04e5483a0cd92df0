/** Lines on the floor, a metre apart, around the viewer: they make motion visible where a model has no floor. */
import { BufferAttribute, BufferGeometry, LineBasicMaterial, LineSegments } from "three";

const REACH_M = 15;

export class FloorGrid {
  readonly object: LineSegments<BufferGeometry, LineBasicMaterial>;

  constructor() {
    const ends: number[] = [];
    // Short segments: some software GL does not draw a line that begins behind the eye.
    for (let k = -REACH_M; k <= REACH_M; ++k)
      for (let from = -REACH_M; from < REACH_M; ++from) ends.push(k, from, 0, k, from + 1, 0, from, k, 0, from + 1, k, 0);
    const lines = new BufferGeometry();
    lines.setAttribute("position", new BufferAttribute(new Float32Array(ends), 3));
    this.object = new LineSegments(lines, new LineBasicMaterial({ transparent: true, opacity: 0.35 }));
    this.object.frustumCulled = false;
  }

  setInk(css: string) {
    this.object.material.color.set(css);
  }

  /** The lines keep their positions on the floor. */
  moveTo(x: number, y: number, z: number) {
    this.object.position.set(Math.round(x), Math.round(y), z + 0.005);
  }
}
