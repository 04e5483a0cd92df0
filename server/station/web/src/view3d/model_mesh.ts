/** The semantic model as a few meshes: one for low parts, one for walls (which can be cut), one for overhead parts; each
 * of real and of virtual parts. */
import { BufferAttribute, BufferGeometry, Color, DoubleSide, Group, LineBasicMaterial, LineSegments, Mesh, type ShaderMaterial } from "three";
import { turned } from "../plan/outline";
import type { Element, Model } from "../session/site.svelte";
import { depthMaterial, drawnFirst, solidMaterial, unitSolid } from "./solids";

export interface ModelInk { floor: string; wall: string; thing: string; door: string; stairs: string; zone: string; virtual: string; canvas: string }
type Layer = "low" | "walls" | "above";

/** Unlabelled parts higher than this (m) occlude like a wall. */
const TALL_M = 1.6;

function layerOf({ label, at, size }: Element): Layer | null {
  if (label === "free_space") return null;
  if (label === "ceiling" || label === "wall_above_door") return "above";
  return ["wall", "pillar", "window"].includes(label) || (label === "unknown" && at[2] + size[2] / 2 > TALL_M) ? "walls" : "low";
}

/** `real`: what stands in the building itself; `recorded`: of that, what recorded surfaces show too, which leave out
 * doors on hinges. */
export interface ModelMeshes { group: Group; real: Group; recorded: Group; walls: ShaderMaterial; above: Mesh[]; edges: LineSegments }

/** `without`: names of doors that are drawn at their measured angle. */
export function modelMeshes(model: Model, without: ReadonlySet<string>, ink: ModelInk): ModelMeshes {
  const colours: Record<string, Color> = {
    floor: new Color(ink.floor), wall: new Color(ink.wall), pillar: new Color(ink.wall), wall_above_door: new Color(ink.wall), door: new Color(ink.door),
    stairs: new Color(ink.stairs), ramp: new Color(ink.stairs), window: new Color(ink.zone), ceiling: new Color(ink.thing), unknown: new Color(ink.thing),
  };
  const virtual = new Color(ink.virtual);
  const shown = model.elements.filter((each) => layerOf(each) && !without.has(each.name));
  const colourOf = (element: Element) => (element.virtual ? virtual : (colours[element.label] ?? colours.unknown)) as Color;
  const walls = solidMaterial({ colours: true }), plain = solidMaterial({ colours: true });
  const group = new Group(), real = new Group(), recorded = new Group(), above: Mesh[] = [];
  const placeOf = (each: Element) => (each.virtual ? group : each.hinged ? real : recorded);
  for (const place of [recorded, real, group]) {
    const elements = shown.filter((each) => placeOf(each) === place);
    const add = (layer: Layer, material: ShaderMaterial) => {
      // A ceiling would hide everything; parts above a door belong to its wall.
      const boxes = elements.filter((each) => layerOf(each) === layer && each.label !== "ceiling");
      const mesh = new Mesh(mergedBoxes(boxes, colourOf), material);
      if (boxes.length) place.add(mesh);
      return mesh;
    };
    add("low", plain);
    add("walls", walls);
    above.push(add("above", plain));
  }
  for (const mesh of model.meshes) recorded.add(new Mesh(triangles(mesh.vertices, mesh.triangles, colours.unknown as Color), plain));
  const edges = new LineSegments(boxEdges(shown.filter((each) => each.label !== "floor" && each.label !== "ramp" && layerOf(each) !== "above")), new LineBasicMaterial({ color: ink.canvas }));
  edges.visible = false;
  real.name = "building";
  real.add(recorded);
  group.add(real, edges);
  return { group, real, recorded, walls, above, edges };
}

/** The real building, drawn for its depth alone; also its ceilings, which hide another storey. */
export function buildingOccluder(model: Model, without: ReadonlySet<string>): Group {
  const elements = model.elements.filter((each) => layerOf(each) && !each.virtual && !without.has(each.name));
  const black = new Color(0, 0, 0), group = new Group();
  group.add(new Mesh(mergedBoxes(elements, () => black), depthMaterial()));
  const open = depthMaterial(DoubleSide);
  for (const mesh of model.meshes) group.add(new Mesh(triangles(mesh.vertices, mesh.triangles, black), open));
  return drawnFirst(group);
}

const unit = unitSolid("box");

function mergedBoxes(elements: Element[], colourOf: (element: Element) => Color): BufferGeometry {
  const at = unit.getAttribute("position"), normal = unit.getAttribute("normal"), index = unit.getIndex() as BufferAttribute;
  const n = at.count, positions = new Float32Array(elements.length * n * 3), normals = new Float32Array(positions.length), colours = new Float32Array(positions.length);
  const indices = new Uint32Array(elements.length * index.count);
  elements.forEach((element, e) => {
    const colour = colourOf(element), q = element.turn;
    for (let i = 0; i < n; ++i) {
      const p = turned(q, [at.getX(i) * element.size[0], at.getY(i) * element.size[1], at.getZ(i) * element.size[2]]);
      const d = turned(q, [normal.getX(i), normal.getY(i), normal.getZ(i)]);
      const k = (e * n + i) * 3;
      for (let c = 0; c < 3; ++c) {
        positions[k + c] = (p[c] as number) + (element.at[c] as number);
        normals[k + c] = d[c] as number;
      }
      colour.toArray(colours, k);
    }
    for (let i = 0; i < index.count; ++i) indices[e * index.count + i] = index.getX(i) + e * n;
  });
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  geometry.setAttribute("normal", new BufferAttribute(normals, 3));
  geometry.setAttribute("color", new BufferAttribute(colours, 3));
  geometry.setIndex(new BufferAttribute(indices, 1));
  return geometry;
}

function triangles(vertices: number[], corners: number[], colour: Color): BufferGeometry {
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(new Float32Array(corners.flatMap((v) => vertices.slice(v * 3, v * 3 + 3))), 3));
  geometry.computeVertexNormals();
  const count = corners.length;
  const colours = new Float32Array(count * 3);
  for (let i = 0; i < count; ++i) colour.toArray(colours, i * 3);
  geometry.setAttribute("color", new BufferAttribute(colours, 3));
  return geometry;
}

const corner = (i: number): [number, number, number] => [i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5];
const edgePairs = [0, 1, 2, 3, 4, 5, 6, 7].flatMap((i) => [1, 2, 4].filter((bit) => !(i & bit)).map((bit) => [i, i | bit] as const));

/** The twelve edges of each box, as pairs of points. */
export function boxEdges(elements: Pick<Element, "at" | "turn" | "size">[]): BufferGeometry {
  const positions = new Float32Array(elements.length * 72);
  let k = 0;
  for (const { at, turn, size } of elements)
    for (const pair of edgePairs)
      for (const i of pair) {
        const [x, y, z] = corner(i);
        const p = turned(turn, [x * size[0], y * size[1], z * size[2]]);
        for (let c = 0; c < 3; ++c) positions[k++] = (p[c] as number) + (at[c] as number);
      }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(positions, 3));
  return geometry;
}
