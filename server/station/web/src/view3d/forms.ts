/** Appearance of a part as unit solids: in full, as a box for each shape, as one box. */
import { turned } from "../plan/outline";
import type { Shape } from "../session/protocol";

export type SolidKind = "box" | "cylinder" | "sphere";
/** A unit solid's pose in a part: columns of a 3x4 matrix, and its colour (linear). */
export interface Piece { kind: SolidKind; matrix: Float64Array; colour: [number, number, number]; mesh?: MeshPiece }
/** A mesh that is drawn in place of the solid, once it is known: its id, and its pose in the part. */
export interface MeshPiece { id: string; matrix: Float64Array }
/** Metres: `radius` of its bounding sphere, `reach` from the part's origin to its farthest corner. */
export interface Form { full: Piece[]; boxes: Piece[]; one: Piece; radius: number; reach: number }

export function formOf(shapes: Shape[]): Form {
  const full: Piece[] = [], boxes: Piece[] = [];
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  const mean: [number, number, number] = [0, 0, 0];
  for (const shape of shapes) {
    const lengths = fullLengths(shape);
    boxes.push(piece("box", shape, lengths));
    if (shape.mesh) full.push({ ...piece("box", shape, lengths), mesh: { id: shape.mesh, matrix: piece("box", shape, [1, 1, 1]).matrix } });
    else if (shape.shape === "box") full.push(piece("box", shape, lengths));
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
  return { full, boxes, one, radius: Math.hypot(...span) / 2, reach: Math.hypot(...centre) + Math.hypot(...span) / 2 };
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
