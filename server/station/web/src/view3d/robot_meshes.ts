/** Robots' meshes, one draw call each: fetched from the server when they are first needed. */
import { BufferAttribute, BufferGeometry, Group, type InstancedMesh, type ShaderMaterial } from "three";
import { json } from "../session/site.svelte";
import { instances, putInstance, showInstances } from "./instanced_solids";
import { solidMaterial } from "./solids";

interface MeshContent { vertices: number[]; triangles: number[] }
/** null: on its way, or there is none. */
interface Known { mesh: InstancedMesh | null; used: number }

const FIRST_ROOM = 8;

export class RobotMeshes {
  readonly group = new Group();
  #known = new Map<string, Known>();

  constructor(private readonly material: () => ShaderMaterial = solidMaterial) {}

  /** False: the mesh is not here yet; it is asked for. */
  has(id: string): boolean {
    const known = this.#known.get(id);
    if (known) return known.mesh !== null;
    this.#known.set(id, { mesh: null, used: 0 });
    void this.#fetch(id);
    return false;
  }

  begin() {
    for (const known of this.#known.values()) known.used = 0;
  }

  put(id: string, m: Float64Array, red: number, green: number, blue: number) {
    const known = this.#known.get(id);
    if (!known?.mesh) return;
    if (known.used >= known.mesh.instanceMatrix.count) this.#show(known, known.mesh.geometry, known.mesh.instanceMatrix.count * 2);
    putInstance(known.mesh, known.used++, m, red, green, blue);
  }

  end() {
    for (const { mesh, used } of this.#known.values()) if (mesh) showInstances(mesh, used);
  }

  async #fetch(id: string) {
    const geometry = await geometryOf(id), known = this.#known.get(id);
    if (geometry && known) this.#show(known, geometry, FIRST_ROOM);
  }

  #show(known: Known, geometry: BufferGeometry, room: number) {
    const after = instances(geometry, room, this.material()), before = known.mesh;
    if (before) {
      (after.instanceMatrix.array as Float32Array).set(before.instanceMatrix.array);
      (after.instanceColor!.array as Float32Array).set(before.instanceColor!.array);
      this.group.remove(before);
      before.dispose();
    }
    after.renderOrder = this.group.renderOrder;
    this.group.add(after);
    known.mesh = after;
  }
}

const geometries = new Map<string, Promise<BufferGeometry | null>>();

function geometryOf(id: string): Promise<BufferGeometry | null> {
  let found = geometries.get(id);
  if (!found) {
    found = json<MeshContent>(`api/v1/mesh?${id}`).then((content) => (content ? facets(content) : null));
    geometries.set(id, found);
  }
  return found;
}

/** Each triangle with corners of its own, so that it has its own normal. */
function facets({ vertices, triangles }: MeshContent): BufferGeometry {
  const corners = new Float32Array(triangles.length * 3);
  triangles.forEach((vertex, i) => {
    for (let axis = 0; axis < 3; ++axis) corners[i * 3 + axis] = vertices[vertex * 3 + axis] ?? 0;
  });
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(corners, 3));
  geometry.computeVertexNormals();
  return geometry;
}
