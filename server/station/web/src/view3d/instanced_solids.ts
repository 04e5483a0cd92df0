/** Many solids in three draw calls, one for each kind: for a graphics card. */
import { DynamicDrawUsage, Group, InstancedBufferAttribute, InstancedMesh, type BufferGeometry, type ShaderMaterial } from "three";
import type { SolidKind } from "./forms";
import { solidMaterial, unitSolid } from "./solids";
import type { Solids } from "./crowd";

const kinds = ["box", "cylinder", "sphere"] as const;
const FIRST_ROOM = { box: 4096, cylinder: 1024, sphere: 512 };

export class InstancedSolids implements Solids {
  readonly group = new Group();
  readonly #material: () => ShaderMaterial;
  #meshes: Record<SolidKind, InstancedMesh>;
  #wires: Record<SolidKind, InstancedMesh> | null = null;
  #counts: Record<SolidKind, number> = { box: 0, cylinder: 0, sphere: 0 };

  constructor(material: () => ShaderMaterial = solidMaterial) {
    this.#material = material;
    this.#meshes = { box: made("box", FIRST_ROOM.box, material()), cylinder: made("cylinder", FIRST_ROOM.cylinder, material()), sphere: made("sphere", FIRST_ROOM.sphere, material()) };
    this.group.add(...Object.values(this.#meshes));
  }

  outline(on: boolean) {
    if (!on) {
      for (const mesh of Object.values(this.#wires ?? {})) this.group.remove(mesh);
      this.#wires = null;
    } else if (!this.#wires) {
      this.#wires = { box: wire("box"), cylinder: wire("cylinder"), sphere: wire("sphere") };
      this.group.add(...Object.values(this.#wires));
    }
  }

  begin() {
    this.#counts = { box: 0, cylinder: 0, sphere: 0 };
  }

  put(kind: SolidKind, m: Float64Array, red: number, green: number, blue: number) {
    const i = this.#counts[kind]++, mesh = i < this.#meshes[kind].instanceMatrix.count ? this.#meshes[kind] : this.#longer(kind);
    putInstance(mesh, i, m, red, green, blue);
  }

  end() {
    for (const kind of kinds) {
      const mesh = this.#meshes[kind], wire = this.#wires?.[kind];
      showInstances(mesh, this.#counts[kind]);
      if (!wire) continue;
      wire.count = mesh.count;
      wire.instanceMatrix = mesh.instanceMatrix;
    }
  }

  #longer(kind: SolidKind): InstancedMesh {
    const before = this.#meshes[kind], after = made(kind, before.instanceMatrix.count * 2, this.#material());
    after.renderOrder = before.renderOrder;
    (after.instanceMatrix.array as Float32Array).set(before.instanceMatrix.array);
    ((after.instanceColor as InstancedBufferAttribute).array as Float32Array).set((before.instanceColor as InstancedBufferAttribute).array);
    this.group.remove(before);
    before.dispose();
    this.group.add(after);
    this.#meshes[kind] = after;
    if (this.#wires) {
      this.outline(false);
      this.outline(true);
    }
    return after;
  }
}

/** `m`: columns of a 3x4 matrix. */
export function putInstance(mesh: InstancedMesh, i: number, m: Float64Array, red: number, green: number, blue: number) {
  const out = mesh.instanceMatrix.array as Float32Array;
  for (let c = 0; c < 4; ++c) {
    for (let r = 0; r < 3; ++r) out[i * 16 + c * 4 + r] = m[c * 3 + r] as number;
    out[i * 16 + c * 4 + 3] = c === 3 ? 1 : 0;
  }
  const colours = (mesh.instanceColor as InstancedBufferAttribute).array as Float32Array;
  colours[i * 3] = red;
  colours[i * 3 + 1] = green;
  colours[i * 3 + 2] = blue;
}

/** Sends the first `count` instances to the card, which draws them. */
export function showInstances(mesh: InstancedMesh, count: number) {
  mesh.count = count;
  if (!count) return;
  changed(mesh.instanceMatrix, count * 16);
  changed(mesh.instanceColor as InstancedBufferAttribute, count * 3);
}

/** Room for `room` instances of a geometry. */
export function instances(geometry: BufferGeometry, room: number, material: ShaderMaterial): InstancedMesh {
  const mesh = empty(geometry, room, material);
  mesh.instanceColor = new InstancedBufferAttribute(new Float32Array(room * 3), 3);
  mesh.instanceColor.setUsage(DynamicDrawUsage);
  return mesh;
}

const made = (kind: SolidKind, room: number, material: ShaderMaterial) => instances(unitSolid(kind), room, material);
const wire = (kind: SolidKind) => empty(unitSolid(kind), 1, solidMaterial({ wireframe: true }));

function empty(geometry: BufferGeometry, room: number, material: ShaderMaterial): InstancedMesh {
  const mesh = new InstancedMesh(geometry, material, room);
  mesh.instanceMatrix.setUsage(DynamicDrawUsage);
  mesh.count = 0;
  mesh.frustumCulled = false;
  return mesh;
}

function changed(attribute: InstancedBufferAttribute, numbers: number) {
  attribute.clearUpdateRanges();
  attribute.addUpdateRange(0, numbers);
  attribute.needsUpdate = true;
}
