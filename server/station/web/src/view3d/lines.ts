/** Paths, zones, marks on the floor: all lines of the scene in one draw call. */
import { BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, LineBasicMaterial, LineSegments } from "three";

export class Lines {
  readonly object: LineSegments;
  #positions = new Float32Array(6144);
  #colours = new Float32Array(6144);
  #count = 0;

  constructor() {
    this.object = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ vertexColors: true }));
    this.object.frustumCulled = false;
    this.#attach();
  }

  begin() {
    this.#count = 0;
  }

  /** Points x, y alternating, at one height. */
  path(points: ArrayLike<number>, z: number, ink: Color, closed = false) {
    const n = points.length / 2;
    for (let i = 0; i + 1 < n + (closed ? 1 : 0); ++i) {
      const a = i * 2, b = ((i + 1) % n) * 2;
      this.segment(points[a] as number, points[a + 1] as number, z, points[b] as number, points[b + 1] as number, z, ink);
    }
  }

  ring(x: number, y: number, z: number, radius: number, ink: Color) {
    this.ellipse(x, y, z, radius, radius, 0, ink);
  }

  /** Half axes; the major one points along `yaw`. */
  ellipse(x: number, y: number, z: number, major: number, minor: number, yaw: number, ink: Color) {
    const points: number[] = [], cos = Math.cos(yaw), sin = Math.sin(yaw);
    for (let i = 0; i < 24; ++i) {
      const a = major * Math.cos((i * Math.PI) / 12), b = minor * Math.sin((i * Math.PI) / 12);
      points.push(x + cos * a - sin * b, y + sin * a + cos * b);
    }
    this.path(points, z, ink, true);
  }

  segment(ax: number, ay: number, az: number, bx: number, by: number, bz: number, ink: Color) {
    const k = this.#count * 3;
    if (k + 6 > this.#positions.length) this.#grow();
    this.#positions.set([ax, ay, az, bx, by, bz], k);
    ink.toArray(this.#colours, k);
    ink.toArray(this.#colours, k + 3);
    this.#count += 2;
  }

  end() {
    const { geometry } = this.object;
    geometry.setDrawRange(0, this.#count);
    this.object.visible = this.#count > 0;
    for (const name of ["position", "color"]) {
      const attribute = geometry.getAttribute(name) as BufferAttribute;
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, this.#count * 3);
      attribute.needsUpdate = true;
    }
  }

  #grow() {
    const positions = new Float32Array(this.#positions.length * 2), colours = new Float32Array(positions.length);
    positions.set(this.#positions);
    colours.set(this.#colours);
    this.#positions = positions;
    this.#colours = colours;
    this.object.geometry.dispose();
    this.object.geometry = new BufferGeometry();
    this.#attach();
  }

  #attach() {
    this.object.geometry.setAttribute("position", new BufferAttribute(this.#positions, 3).setUsage(DynamicDrawUsage));
    this.object.geometry.setAttribute("color", new BufferAttribute(this.#colours, 3).setUsage(DynamicDrawUsage));
  }
}
