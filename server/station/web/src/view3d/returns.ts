/** Scans and clouds as points; one draw call each, with buffers that are reused and grow. */
import { BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, Points, ShaderMaterial } from "three";
import type { PointsFrame, ScanFrame } from "../session/frames";
import { fragmentShader, screenColour } from "./solids";

const vertexShader = /* glsl */ `
  attribute vec3 tint;
  uniform float size, cut;
  varying vec3 shade;
  ${screenColour}
  void main() {
    shade = screenColour(tint);
    vec4 p = modelViewMatrix * vec4(position, 1.0);
    gl_Position = projectionMatrix * p;
    gl_PointSize = clamp(size / -p.z, 1.0, 9.0);
    if (position.z > cut) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);  // outside of every picture
  }`;

/** Colours of points without a colour: at the floor, and from `HIGH_M` above it. */
export interface Shades { low: Color; high: Color }
const HIGH_M = 1.6;

export class Returns {
  readonly points: Points;
  #positions = new Float32Array(0);
  #tints = new Float32Array(0);
  #frame: PointsFrame | null = null;
  #shades: Shades | null = null;

  /** `size`: page pixels of a point at a distance of a metre. `maxPoints`: larger clouds are thinned to this number. */
  constructor(size: number, private readonly maxPoints = Infinity) {
    const material = new ShaderMaterial({ vertexShader, fragmentShader, uniforms: { size: { value: size }, cut: { value: 1e6 } } });
    this.points = new Points(new BufferGeometry(), material);
    this.points.onBeforeRender = (renderer) => {
      material.uniforms.size!.value = size * renderer.getPixelRatio();
      material.uniformsNeedUpdate = true;
    };
    this.points.frustumCulled = false;
    this.points.visible = false;
  }

  /** Points of a sweep at the laser's height: the real returns of `real`, the virtual ones of `mixed`; null hides
   * either. */
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

  /** No effect if frame and shades are unchanged. `cut`: m, higher points are left out. */
  setPoints(frame: PointsFrame | null, shades: Shades, cut: number) {
    (this.points.material as ShaderMaterial).uniforms.cut!.value = cut;
    if (frame === this.#frame && shades === this.#shades) return;
    this.#frame = frame;
    this.#shades = shades;
    this.#show(frame ? this.#paint(frame, shades) : 0);
  }
  /** Number of points in the buffers. */
  #paint({ count, positions, colours }: PointsFrame, { low, high }: Shades): number {
    const step = Math.ceil(count / this.maxPoints) || 1, n = Math.floor(count / step), colour = new Color();
    this.#reserve(n);
    for (let k = 0; k < n; ++k) {
      const i = 3 * k * step;
      this.#positions.set(positions.subarray(i, i + 3), 3 * k);
      if (colours) colour.setRGB((colours[i] as number) / 255, (colours[i + 1] as number) / 255, (colours[i + 2] as number) / 255, "srgb");
      else colour.lerpColors(low, high, Math.min(1, Math.max(0, (positions[i + 2] as number) / HIGH_M)));
      colour.toArray(this.#tints, 3 * k);
    }
    return n;
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
