/** Many solids as one mesh of the faces turned to the eye, transformed and lit on the CPU: a software renderer
 * (SwiftShader) handles each instance as a draw call of its own, which takes ten times as long. */
import { BufferAttribute, BufferGeometry, Color, DynamicDrawUsage, Group, LineBasicMaterial, LineSegments, Mesh, type ShaderMaterial } from "three";
import type { SolidKind } from "./forms";
import { light, solidMaterial } from "./solids";
import type { Solids } from "./crowd";

/** Four corners (x, y, z alternating) and their normals; a flat face has one normal. */
interface Face { corners: number[]; directions: number[]; centre: [number, number, number]; middle: [number, number, number] }

/** Faces that turn away by no more than this (m) are kept, because of the two eyes in a headset. */
const EDGE_ON_M = 0.04;
/** A face without any thickness (m^2) still has a normal. */
const THIN = 1e-12;

export class BakedSolids implements Solids {
  readonly group = new Group();
  readonly #mesh: Mesh;
  #lines = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: 0xffffff }));
  #positions = new Float32Array(0);
  #colours = new Uint8Array(0);
  #faces = 0;
  #eye: [number, number, number] = [0, 0, 0];

  constructor(material: ShaderMaterial = solidMaterial({ lit: true })) {
    this.#mesh = new Mesh(new BufferGeometry(), material);
    this.#mesh.frustumCulled = this.#lines.frustumCulled = this.#lines.visible = false;
    this.group.add(this.#mesh, this.#lines);
    this.#room(8192);
  }

  outline(on: boolean) {
    this.#lines.visible = on;
  }

  begin(eye: { x: number; y: number; z: number }) {
    this.#faces = 0;
    this.#eye = [eye.x, eye.y, eye.z];
  }

  put(kind: SolidKind, m: Float64Array, red: number, green: number, blue: number) {
    const solid = faces[kind], eye = this.#eye;
    if ((this.#faces + solid.length) * 12 > this.#positions.length) this.#room((this.#faces + solid.length) * 2);
    const m0 = m[0] as number, m1 = m[1] as number, m2 = m[2] as number, m3 = m[3] as number, m4 = m[4] as number, m5 = m[5] as number;
    const m6 = m[6] as number, m7 = m[7] as number, m8 = m[8] as number, m9 = m[9] as number, m10 = m[10] as number, m11 = m[11] as number;
    // Directions transform with the columns divided by their squared lengths.
    const s0 = 1 / (m0 * m0 + m1 * m1 + m2 * m2 + THIN), s1 = 1 / (m3 * m3 + m4 * m4 + m5 * m5 + THIN), s2 = 1 / (m6 * m6 + m7 * m7 + m8 * m8 + THIN);
    const out = this.#positions, ink = this.#colours;
    for (const { corners, directions, centre, middle } of solid) {
      let nx = middle[0] * s0, ny = middle[1] * s1, nz = middle[2] * s2;
      let wx = m0 * nx + m3 * ny + m6 * nz, wy = m1 * nx + m4 * ny + m7 * nz, wz = m2 * nx + m5 * ny + m8 * nz;
      let over = 1 / Math.sqrt(wx * wx + wy * wy + wz * wz);
      const [cx, cy, cz] = centre;
      const away = wx * (eye[0] - m0 * cx - m3 * cy - m6 * cz - m9) + wy * (eye[1] - m1 * cx - m4 * cy - m7 * cz - m10) + wz * (eye[2] - m2 * cx - m5 * cy - m8 * cz - m11);
      if (away * over < -EDGE_ON_M) continue;
      let brightness = light(wx * over, wy * over, wz * over);
      let at = this.#faces++ * 12, tone = (at / 12) * 16;
      for (let k = 0; k < 12; k += 3) {
        const x = corners[k] as number, y = corners[k + 1] as number, z = corners[k + 2] as number;
        if (directions.length) {
          nx = (directions[k] as number) * s0;
          ny = (directions[k + 1] as number) * s1;
          nz = (directions[k + 2] as number) * s2;
          wx = m0 * nx + m3 * ny + m6 * nz;
          wy = m1 * nx + m4 * ny + m7 * nz;
          wz = m2 * nx + m5 * ny + m8 * nz;
          over = 1 / Math.sqrt(wx * wx + wy * wy + wz * wz);
          brightness = light(wx * over, wy * over, wz * over);
        }
        out[at++] = m0 * x + m3 * y + m6 * z + m9;
        out[at++] = m1 * x + m4 * y + m7 * z + m10;
        out[at++] = m2 * x + m5 * y + m8 * z + m11;
        ink[tone++] = screenByte(red * brightness);
        ink[tone++] = screenByte(green * brightness);
        ink[tone++] = screenByte(blue * brightness);
        tone++;
      }
    }
  }

  end() {
    for (const [mesh, each] of [[this.#mesh, 6], [this.#lines, 8]] as const) mesh.geometry.setDrawRange(0, this.#faces * each);
    for (const [name, each] of [["position", 12], ["color", 16]] as const) {
      const attribute = this.#mesh.geometry.getAttribute(name) as BufferAttribute;
      attribute.clearUpdateRanges();
      if (!this.#faces) continue;
      attribute.addUpdateRange(0, this.#faces * each);
      attribute.needsUpdate = true;
    }
  }

  /** Reserves space for this many faces and keeps the present ones. */
  #room(count: number) {
    const positions = new Float32Array(count * 12), colours = new Uint8Array(count * 16).fill(255);
    positions.set(this.#positions);
    colours.set(this.#colours);
    this.#positions = positions;
    this.#colours = colours;
    const position = new BufferAttribute(positions, 3).setUsage(DynamicDrawUsage);
    for (const [mesh, pattern] of [[this.#mesh, [0, 1, 2, 0, 2, 3]], [this.#lines, [0, 1, 1, 2, 2, 3, 3, 0]]] as const) {
      mesh.geometry.dispose();
      mesh.geometry = new BufferGeometry();
      mesh.geometry.setAttribute("position", position);
      mesh.geometry.setIndex(new BufferAttribute(Uint32Array.from({ length: count * pattern.length }, (_, i) => Math.floor(i / pattern.length) * 4 + (pattern[i % pattern.length] as number)), 1));
    }
    this.#mesh.geometry.setAttribute("color", new BufferAttribute(colours, 4, true).setUsage(DynamicDrawUsage));
  }
}

const screenBytes = Uint8Array.from({ length: 1024 }, (_, i) => Math.round(255 * new Color(0, 0, 0).setScalar(i / 1023).convertLinearToSRGB().r));
const screenByte = (linear: number): number => screenBytes[Math.min(1023, Math.round(linear * 1023))] as number;

const faces: Record<SolidKind, Face[]> = { box: boxFaces(), cylinder: cylinderFaces(10), sphere: sphereFaces(8, 5) };

/** `corners` counter-clockwise as seen from outside. */
function face(corners: number[], directions: number[] = []): Face {
  const c = [0, 1, 2].map((axis) => ((corners[axis] as number) + (corners[3 + axis] as number) + (corners[6 + axis] as number) + (corners[9 + axis] as number)) / 4) as Face["centre"];
  const [a, b] = [[6, 0], [9, 3]].map(([to, from]) => [0, 1, 2].map((axis) => (corners[(to as number) + axis] as number) - (corners[(from as number) + axis] as number))) as [number[], number[]];
  const cross = (i: number, j: number) => (a[i] as number) * (b[j] as number) - (a[j] as number) * (b[i] as number);
  return { corners, directions, centre: c, middle: [cross(1, 2), cross(2, 0), cross(0, 1)] };
}

function boxFaces(): Face[] {
  return [0, 1, 2].flatMap((axis) => [-0.5, 0.5].map((side) => {
    const ring = side > 0 ? [[-1, -1], [1, -1], [1, 1], [-1, 1]] : [[-1, -1], [-1, 1], [1, 1], [1, -1]];
    return face(ring.flatMap(([u, v]) => {
      const point = [0, 0, 0];
      point[axis] = side;
      point[(axis + 1) % 3] = (u as number) / 2;
      point[(axis + 2) % 3] = (v as number) / 2;
      return point;
    }));
  }));
}

function cylinderFaces(sides: number): Face[] {
  const round = (i: number, z: number) => [0.5 * Math.cos((2 * Math.PI * i) / sides), 0.5 * Math.sin((2 * Math.PI * i) / sides), z];
  const list: Face[] = [];
  for (let i = 0; i < sides; ++i) {
    const corners = [...round(i, -0.5), ...round(i + 1, -0.5), ...round(i + 1, 0.5), ...round(i, 0.5)];
    list.push(face(corners, corners.map((each, k) => (k % 3 === 2 ? 0 : 2 * each))));
  }
  for (let i = 1; i + 2 < sides; i += 2)
    list.push(face([...round(0, 0.5), ...round(i, 0.5), ...round(i + 1, 0.5), ...round(i + 2, 0.5)]), face([...round(0, -0.5), ...round(i + 2, -0.5), ...round(i + 1, -0.5), ...round(i, -0.5)]));
  return list;
}

function sphereFaces(around: number, rings: number): Face[] {
  const at = (i: number, j: number) => {
    const u = (2 * Math.PI * i) / around, v = Math.PI * (j / rings - 0.5);
    return [0.5 * Math.cos(v) * Math.cos(u), 0.5 * Math.cos(v) * Math.sin(u), 0.5 * Math.sin(v)];
  };
  const list: Face[] = [];
  for (let j = 0; j < rings; ++j)
    for (let i = 0; i < around; ++i) {
      const corners = [...at(i, j), ...at(i + 1, j), ...at(i + 1, j + 1), ...at(i, j + 1)];
      list.push(face(corners, corners.map((each) => 2 * each)));
    }
  return list;
}
