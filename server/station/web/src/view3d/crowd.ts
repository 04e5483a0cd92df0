/** All robots, persons and objects. Those out of sight are left out, distant ones are simplified. */
import { Color, Frustum, Group, Matrix4, Sphere, Vector3, type Camera } from "three";
import { drawsBySoftware } from "../parts/graphics";
import type { WorldFrame } from "../session/frames";
import { rowOf } from "../session/poses";
import type { Entity, Part, Shape } from "../session/protocol";
import { BakedSolids } from "./baked_solids";
import { formOf, type Form, type Piece, type SolidKind } from "./forms";
import { InstancedSolids } from "./instanced_solids";
import { RobotMeshes } from "./robot_meshes";
import { depthMaterial, drawnFirst } from "./solids";

/** Receives the unit solids of one frame, between begin and end. `m`: columns of a 3x4 matrix to map; colours
 * linear. */
export interface Solids {
  readonly group: Group;
  begin(eye: { x: number; y: number; z: number }): void;
  put(kind: SolidKind, m: Float64Array, red: number, green: number, blue: number): void;
  end(): void;
  /** Edges of all faces over the solids. */
  outline(on: boolean): void;
}

/** Above this many pixels a part is drawn in full, above the second value as a box for each shape, below as one box.
 * At most the given number of nearest parts. */
interface Detail { fullPx: number; boxesPx: number; full: number; boxes: number }
const bySoftware: Detail = { fullPx: 14, boxesPx: 8, full: 16, boxes: 120 };
const byCard: Detail = { fullPx: 12, boxesPx: 4, full: 1200, boxes: 4000 };

export interface CrowdInk { virtual: string; robot: string; door: string; person: string }
interface Drawn { solids: Solids; meshes: RobotMeshes }
interface Seen { form: Form; entity: Entity; row: number; px: number }

export class Crowd {
  readonly group = new Group();
  readonly #shown: Drawn = { solids: drawsBySoftware() ? new BakedSolids() : new InstancedSolids(), meshes: new RobotMeshes() };
  /** What is seen itself, through glass. */
  #occluders: Drawn | null = null;
  readonly #detail = drawsBySoftware() ? bySoftware : byCard;
  #forms: Form[] = [];
  #of: Shape[][] | null = null;
  #unknown: Form | null = null;
  #eye = new Vector3();
  #frustum = new Frustum();
  #toClip = new Matrix4();
  #ball = new Sphere();
  #placed = new Float64Array(12);
  #tints: Record<Entity["owner"], Color> = { agent: new Color(), robot: new Color(), building: new Color(), real_person: new Color() };

  constructor() {
    this.#shown.solids.group.name = "solids";
    this.group.add(this.#shown.solids.group, this.#shown.meshes.group);
  }

  setInk(ink: CrowdInk) {
    this.#tints = { agent: new Color(ink.virtual), robot: new Color(ink.robot), building: new Color(ink.door), real_person: new Color(ink.person) };
  }

  showCollision(on: boolean) {
    this.#shown.solids.outline(on);
  }

  /** `pixels`: size of a metre at a distance of a metre. `occludes`: the entity only hides what is behind it. */
  update(entities: Entity[], world: WorldFrame, forms: Shape[][], shapesOf: (part: Part) => Shape[], camera: Camera, pixels: number, occludes: (entity: Entity) => boolean) {
    if (this.#of !== forms) {
      this.#of = forms;
      this.#forms = forms.map(formOf);
    }
    this.#unknown ??= formOf(shapesOf({ id: -1, name: "", form: -1 }));
    this.group.updateWorldMatrix(true, false);
    this.group.worldToLocal(camera.getWorldPosition(this.#eye));
    this.#toClip.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).multiply(this.group.matrixWorld);
    this.#frustum.setFromProjectionMatrix(this.#toClip);
    this.#shown.solids.begin(this.#eye);
    this.#shown.meshes.begin();
    this.#occluders?.solids.begin(this.#eye);
    this.#occluders?.meshes.begin();
    let { full, boxes } = this.#detail;
    for (const { form, entity, row, px } of this.#nearestFirst(entities, world, this.#unknown, pixels)) {
      const pieces = px > this.#detail.fullPx && full-- > 0 ? form.full : px > this.#detail.boxesPx && boxes-- > 0 ? form.boxes : [form.one];
      const drawn = occludes(entity) ? this.#startedOccluders() : this.#shown;
      for (const piece of pieces) this.#put(drawn, piece, world.poses, row * 7, this.#tints[entity.owner], entity.owner === "robot" || entity.owner === "building" ? 0.3 : 0.5);
    }
    this.#shown.solids.end();
    this.#shown.meshes.end();
    this.#occluders?.solids.end();
    this.#occluders?.meshes.end();
  }

  #startedOccluders(): Drawn {
    if (this.#occluders) return this.#occluders;
    const solids = drawsBySoftware() ? new BakedSolids(depthMaterial()) : new InstancedSolids(depthMaterial);
    this.#occluders = { solids, meshes: new RobotMeshes(depthMaterial) };
    for (const { group } of [solids, this.#occluders.meshes]) this.group.add(drawnFirst(group));
    solids.group.name = "occluders";
    solids.begin(this.#eye);
    return this.#occluders;
  }

  #nearestFirst(entities: Entity[], world: WorldFrame, unknown: Form, pixels: number): Seen[] {
    const list: Seen[] = [], { center } = this.#ball, poses = world.poses;
    for (const entity of entities)
      for (const part of entity.parts) {
        const row = rowOf(world, part.id);
        if (row < 0) continue;
        const k = row * 7, form = this.#forms[part.form] ?? unknown;
        center.set(poses[k] as number, poses[k + 1] as number, poses[k + 2] as number);
        this.#ball.radius = form.reach;
        if (this.#frustum.intersectsSphere(this.#ball)) list.push({ form, entity, row, px: (form.radius * pixels) / Math.max(0.05, center.distanceTo(this.#eye)) });
      }
    return list.sort((a, b) => b.px - a.px);
  }

  #put(drawn: Drawn, piece: Piece, poses: Float32Array, k: number, tint: Color, fraction: number) {
    const mesh = piece.mesh && drawn.meshes.has(piece.mesh.id) ? piece.mesh : null;
    const out = this.#placed, m = mesh?.matrix ?? piece.matrix;
    const x = poses[k + 3] as number, y = poses[k + 4] as number, z = poses[k + 5] as number, w = poses[k + 6] as number;
    const r00 = 1 - 2 * (y * y + z * z), r01 = 2 * (x * y - w * z), r02 = 2 * (x * z + w * y);
    const r10 = 2 * (x * y + w * z), r11 = 1 - 2 * (x * x + z * z), r12 = 2 * (y * z - w * x);
    const r20 = 2 * (x * z - w * y), r21 = 2 * (y * z + w * x), r22 = 1 - 2 * (x * x + y * y);
    for (let c = 0; c < 12; c += 3) {
      const a = m[c] as number, b = m[c + 1] as number, d = m[c + 2] as number;
      out[c] = r00 * a + r01 * b + r02 * d;
      out[c + 1] = r10 * a + r11 * b + r12 * d;
      out[c + 2] = r20 * a + r21 * b + r22 * d;
    }
    for (let axis = 0; axis < 3; ++axis) (out[9 + axis] as number) += poses[k + axis] as number;
    const [red, green, blue] = piece.colour;
    const shade = [red + (tint.r - red) * fraction, green + (tint.g - green) * fraction, blue + (tint.b - blue) * fraction] as const;
    if (mesh) drawn.meshes.put(mesh.id, out, ...shade);
    else drawn.solids.put(piece.kind, out, ...shade);
  }
}
