/** All robots, people and things as three instanced meshes: boxes, cylinders, spheres. What is far away is drawn simpler. */
import { Color, DynamicDrawUsage, Group, InstancedBufferAttribute, InstancedMesh, type Camera, Vector3 } from "three";
import { turned } from "../plan/outline";
import type { WorldFrame } from "../session/frames";
import { rowOf } from "../session/poses";
import type { Entity, Part, Shape } from "../session/protocol";
import { solidMaterial, unitSolid, type SolidKind } from "./solids";

/** A unit solid's place in a part: columns of a 3x4 matrix, and its colour. */
interface Piece { kind: SolidKind; matrix: Float64Array; colour: [number, number, number] }
interface Form { full: Piece[]; boxes: Piece[]; one: Piece; radius: number; height: number }

/** Above this many pixels an entity is drawn in full, above the second as a box for each shape, below as one box. */
const FULL_PX = 34, BOXES_PX = 9;
/** And no more than the nearest so many in full, for the sake of machines that draw by software. */
const MOST_FULL = 48, MOST_BOXES = 320;

export interface CrowdInk { virtual: string; robot: string; door: string }

export class Crowd {
  readonly group = new Group();
  #meshes: Record<SolidKind, InstancedMesh>;
  #wire: Record<SolidKind, InstancedMesh> | null = null;
  #forms: Form[] = [];
  #of: Shape[][] | null = null;
  #counts: Record<SolidKind, number> = { box: 0, cylinder: 0, sphere: 0 };
  #eye = new Vector3();
  #tints: Record<Entity["owner"], Color> = { agent: new Color(), robot: new Color(), building: new Color() };

  constructor() {
    this.#meshes = { box: made("box", 4096), cylinder: made("cylinder", 512), sphere: made("sphere", 512) };
    this.group.add(...Object.values(this.#meshes));
  }

  setInk(ink: CrowdInk) {
    this.#tints = { agent: new Color(ink.virtual), robot: new Color(ink.robot), building: new Color(ink.door) };
  }

  /** Outlines of all triangles over the solids. */
  showCollision(on: boolean) {
    if (!on) {
      for (const mesh of Object.values(this.#wire ?? {})) this.group.remove(mesh);
      this.#wire = null;
    } else this.#wire ??= this.#wires();
  }

  update(entities: Entity[], world: WorldFrame, forms: Shape[][], shapesOf: (part: Part) => Shape[], camera: Camera, pixels: number) {
    if (this.#of !== forms) {
      this.#of = forms;
      this.#forms = forms.map(prepared);
    }
    const unknown = prepared(shapesOf({ id: -1, name: "", form: -1 }));
    camera.getWorldPosition(this.#eye);
    const counts = (this.#counts = { box: 0, cylinder: 0, sphere: 0 });
    let full = MOST_FULL, boxes = MOST_BOXES;
    for (const { part, entity, row, px } of this.#nearestFirst(entities, world, unknown, pixels)) {
      const form = this.#forms[part.form] ?? unknown;
      const pieces = px > FULL_PX && full-- > 0 ? form.full : px > BOXES_PX && boxes-- > 0 ? form.boxes : [form.one];
      for (const piece of pieces) this.#put(piece, world.poses, row * 7, this.#tints[entity.owner], entity.owner === "agent" ? 0.5 : 0.3);
    }
    for (const kind of ["box", "cylinder", "sphere"] as const) {
      const mesh = this.#meshes[kind];
      mesh.count = counts[kind];
      if (mesh.count) {
        mesh.instanceMatrix.clearUpdateRanges();
        mesh.instanceMatrix.addUpdateRange(0, mesh.count * 16);
        mesh.instanceMatrix.needsUpdate = true;
        const colours = mesh.instanceColor as InstancedBufferAttribute;
        colours.clearUpdateRanges();
        colours.addUpdateRange(0, mesh.count * 3);
        colours.needsUpdate = true;
      }
      const wire = this.#wire?.[kind];
      if (wire) {
        wire.count = mesh.count;
        wire.instanceMatrix = mesh.instanceMatrix;
      }
    }
  }

  #nearestFirst(entities: Entity[], world: WorldFrame, unknown: Form, pixels: number) {
    const list: { part: Part; entity: Entity; row: number; px: number }[] = [];
    for (const entity of entities)
      for (const part of entity.parts) {
        const row = rowOf(world, part.id);
        if (row < 0) continue;
        const k = row * 7, form = this.#forms[part.form] ?? unknown;
        const dx = (world.poses[k] as number) - this.#eye.x, dy = (world.poses[k + 1] as number) - this.#eye.y, dz = (world.poses[k + 2] as number) + form.height / 2 - this.#eye.z;
        list.push({ part, entity, row, px: (form.radius * pixels) / Math.max(0.05, Math.sqrt(dx * dx + dy * dy + dz * dz)) });
      }
    return list.sort((a, b) => b.px - a.px);
  }

  #put(piece: Piece, poses: Float32Array, k: number, tint: Color, share: number) {
    const i = this.#counts[piece.kind]++;
    const mesh = i < this.#meshes[piece.kind].instanceMatrix.count ? this.#meshes[piece.kind] : this.#longer(piece.kind);
    const out = mesh.instanceMatrix.array as Float32Array, m = piece.matrix, o = i * 16;
    const x = poses[k + 3] as number, y = poses[k + 4] as number, z = poses[k + 5] as number, w = poses[k + 6] as number;
    const r00 = 1 - 2 * (y * y + z * z), r01 = 2 * (x * y - w * z), r02 = 2 * (x * z + w * y);
    const r10 = 2 * (x * y + w * z), r11 = 1 - 2 * (x * x + z * z), r12 = 2 * (y * z - w * x);
    const r20 = 2 * (x * z - w * y), r21 = 2 * (y * z + w * x), r22 = 1 - 2 * (x * x + y * y);
    for (let c = 0; c < 4; ++c) {
      const a = m[c * 3] as number, b = m[c * 3 + 1] as number, d = m[c * 3 + 2] as number;
      const moved = c === 3 ? 1 : 0;
      out[o + c * 4] = r00 * a + r01 * b + r02 * d + moved * (poses[k] as number);
      out[o + c * 4 + 1] = r10 * a + r11 * b + r12 * d + moved * (poses[k + 1] as number);
      out[o + c * 4 + 2] = r20 * a + r21 * b + r22 * d + moved * (poses[k + 2] as number);
      out[o + c * 4 + 3] = moved;
    }
    const colours = (mesh.instanceColor as InstancedBufferAttribute).array as Float32Array;
    const [red, green, blue] = piece.colour;
    colours[i * 3] = red + (tint.r - red) * share;
    colours[i * 3 + 1] = green + (tint.g - green) * share;
    colours[i * 3 + 2] = blue + (tint.b - blue) * share;
  }

  #longer(kind: SolidKind): InstancedMesh {
    const before = this.#meshes[kind], after = made(kind, before.instanceMatrix.count * 2);
    (after.instanceMatrix.array as Float32Array).set(before.instanceMatrix.array);
    ((after.instanceColor as InstancedBufferAttribute).array as Float32Array).set((before.instanceColor as InstancedBufferAttribute).array);
    this.group.remove(before);
    before.dispose();
    this.group.add(after);
    this.#meshes[kind] = after;
    if (this.#wire) {
      this.showCollision(false);
      this.showCollision(true);
    }
    return after;
  }

  #wires(): Record<SolidKind, InstancedMesh> {
    const wires = { box: made("box", 1, true), cylinder: made("cylinder", 1, true), sphere: made("sphere", 1, true) };
    this.group.add(...Object.values(wires));
    return wires;
  }
}

function made(kind: SolidKind, capacity: number, wireframe = false): InstancedMesh {
  const mesh = new InstancedMesh(unitSolid(kind), solidMaterial({ wireframe }), capacity);
  mesh.instanceMatrix.setUsage(DynamicDrawUsage);
  if (!wireframe) {
    mesh.instanceColor = new InstancedBufferAttribute(new Float32Array(capacity * 3), 3);
    mesh.instanceColor.setUsage(DynamicDrawUsage);
  }
  mesh.count = 0;
  mesh.frustumCulled = false;
  return mesh;
}

function prepared(shapes: Shape[]): Form {
  const full: Piece[] = [], boxes: Piece[] = [];
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const mean: [number, number, number] = [0, 0, 0];
  for (const shape of shapes) {
    const lengths = fullLengths(shape);
    boxes.push(piece("box", shape, lengths));
    if (shape.shape === "box") full.push(piece("box", shape, lengths));
    else if (shape.shape === "sphere") full.push(piece("sphere", shape, lengths));
    else {
      const [radius, , height] = shape.size;
      full.push(piece("cylinder", shape, [2 * radius, 2 * radius, height]));
      if (shape.shape === "capsule")
        for (const end of [-0.5, 0.5]) {
          const tip = turned(shape.turn, [0, 0, end * height]);
          full.push(piece("sphere", { ...shape, at: [shape.at[0] + tip[0], shape.at[1] + tip[1], shape.at[2] + tip[2]] }, [2 * radius, 2 * radius, 2 * radius]));
        }
    }
    for (let i = 0; i < 8; ++i) {
      const corner = turned(shape.turn, lengths.map((length, axis) => ((i >> axis) & 1 ? 0.5 : -0.5) * length));
      for (let axis = 0; axis < 3; ++axis) {
        const at = (corner[axis] as number) + (shape.at[axis] as number);
        low[axis] = Math.min(low[axis] as number, at);
        high[axis] = Math.max(high[axis] as number, at);
      }
    }
    for (let c = 0; c < 3; ++c) (mean[c] as number) += (shape.colour[c] as number) / shapes.length;
  }
  const span = high.map((each, axis) => each - (low[axis] as number)) as [number, number, number];
  const centre = high.map((each, axis) => (each + (low[axis] as number)) / 2) as [number, number, number];
  const one = piece("box", { shape: "box", size: span, at: centre, turn: [0, 0, 0, 1], colour: mean }, span);
  return { full, boxes, one, radius: Math.hypot(...span) / 2, height: span[2] };
}

function fullLengths({ shape, size }: Shape): [number, number, number] {
  if (shape === "box") return [size[0], size[1], size[2]];
  const width = 2 * size[0];
  return [width, width, shape === "sphere" ? width : size[2] + (shape === "capsule" ? width : 0)];
}

function piece(kind: SolidKind, shape: Shape, lengths: [number, number, number]): Piece {
  const matrix = new Float64Array(12);
  for (let c = 0; c < 3; ++c) matrix.set(turned(shape.turn, [0, 1, 2].map((axis) => (axis === c ? (lengths[c] as number) : 0))), c * 3);
  matrix.set(shape.at, 9);
  return { kind, matrix, colour: [shape.colour[0], shape.colour[1], shape.colour[2]] };
}
