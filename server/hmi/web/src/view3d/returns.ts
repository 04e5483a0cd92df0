/** Scans and clouds as points; one draw call each, their buffers kept and grown. */
import { BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, Points, ShaderMaterial } from "three";
import type { PointsFrame, ScanFrame } from "../session/frames";
import { screenColour } from "./solids";

const vertexShader = /* glsl */ `
  attribute vec3 tint;
  uniform float size;
  varying vec3 shade;
  ${screenColour}
  void main() {
    shade = screenColour(tint);
    vec4 p = modelViewMatrix * vec4(position, 1.0);
    gl_Position = projectionMatrix * p;
    gl_PointSize = clamp(size / -p.z, 2.0, 9.0);
  }`;
const fragmentShader = /* glsl */ `
  varying vec3 shade;
  void main() {
    gl_FragColor = vec4(shade, 1.0);
  }`;

export class Returns {
  readonly points: Points;
  #positions = new Float32Array(0);
  #tints = new Float32Array(0);

  /** `size`: pixels of a point a metre away. */
  constructor(size: number) {
    this.points = new Points(new BufferGeometry(), new ShaderMaterial({ vertexShader, fragmentShader, uniforms: { size: { value: size } } }));
    this.points.frustumCulled = false;
    this.points.visible = false;
  }

  /** Of a sweep, at the laser's height: the real returns of `real`, the virtual ones of `mixed`; null hides either. */
  setScan(real: ScanFrame | null, mixed: ScanFrame | null, height: number, inks: { real: Color; virtual: Color }) {
    this.#reserve((real?.ranges.length ?? 0) + (mixed?.ranges.length ?? 0));
    let n = 0;
    for (const [scan, virtual, ink] of [[real, false, inks.real], [mixed, true, inks.virtual]] as const) {
      if (!scan?.pose) continue;
      const { x, y, yaw } = scan.pose;
      for (let i = 0; i < scan.ranges.length; ++i) {
        const range = scan.ranges[i] as number;
        if (!(range > 0) || range === Infinity || virtual !== ((scan.agents[i] as number) >= 0)) continue;
        const angle = yaw + scan.rad0 + i * scan.radstep;
        this.#positions.set([x + range * Math.cos(angle), y + range * Math.sin(angle), height], n * 3);
        ink.toArray(this.#tints, n * 3);
        ++n;
      }
    }
    this.#show(n);
  }

  setPoints(frame: PointsFrame | null) {
    const n = frame?.count ?? 0;
    this.#reserve(n);
    if (frame) {
      this.#positions.set(frame.positions);
      const colour = new Color();
      for (let i = 0; i < n * 3; i += 3)
        colour.setRGB((frame.colours[i] as number) / 255, (frame.colours[i + 1] as number) / 255, (frame.colours[i + 2] as number) / 255, "srgb").toArray(this.#tints, i);
    }
    this.#show(n);
  }

  #reserve(count: number) {
    if (count * 3 <= this.#positions.length) return;
    const room = Math.max(1024, 2 ** Math.ceil(Math.log2(count))) * 3;
    this.#positions = new Float32Array(room);
    this.#tints = new Float32Array(room);
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new BufferAttribute(this.#positions, 3).setUsage(DynamicDrawUsage));
    geometry.setAttribute("tint", new BufferAttribute(this.#tints, 3).setUsage(DynamicDrawUsage));
    this.points.geometry.dispose();
    this.points.geometry = geometry;
  }

  #show(count: number) {
    this.points.visible = count > 0;
    if (!count) return;
    const { geometry } = this.points;
    geometry.setDrawRange(0, count);
    for (const name of ["position", "tint"]) {
      const attribute = geometry.getAttribute(name) as BufferAttribute;
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, count * 3);
      attribute.needsUpdate = true;
    }
  }
}
