/** What the site looks like: the packed SiteTexture of the server (protocols/site_texture.hpp) for a graphics card. */

/** Four corners a quad: `positions` three floats each (m, map), `places` two each (0..1, from the top left of the picture),
 * `seen` 0 where no camera image shows the quad. */
export interface Surface { positions: Float32Array; places: Float32Array; seen: Uint8Array; corners: Uint32Array; width: number; height: number; jpeg: Uint8Array }
export interface Recorded extends Surface { picture: ImageBitmap }

const MAGIC = 0x31544850;
/** Of a quad, counter-clockwise; its picture's rows go down. */
const ACROSS = [0, 1, 1, 0] as const, DOWN = [0, 0, 1, 1] as const;

/** Takes values one after the other; throws where there are too few. */
class Unpacker {
  #at = 0;
  constructor(private readonly view: DataView) {}
  u32(): number { return this.view.getUint32(this.#take(4), true); }
  f32(): number { return this.view.getFloat32(this.#take(4), true); }
  /** With their number before them. */
  bytes(): Uint8Array {
    const size = this.u32();
    return new Uint8Array(this.view.buffer, this.view.byteOffset + this.#take(size), size);
  }
  /** A number of values of `size` bytes that do follow. */
  count(size: number): number {
    const count = this.u32();
    if (count * size > this.view.byteLength - this.#at) throw new Error("the site's texture is cut off");
    return count;
  }
  take(size: number): Uint8Array { return new Uint8Array(this.view.buffer, this.view.byteOffset + this.#take(size), size); }
  get finished(): boolean { return this.#at === this.view.byteLength; }
  #take(size: number): number {
    if (size > this.view.byteLength - this.#at) throw new Error("the site's texture is cut off");
    const at = this.#at;
    this.#at += size;
    return at;
  }
}

export function parseSurface(buffer: ArrayBuffer): Surface {
  const from = new Unpacker(new DataView(buffer));
  if (from.u32() !== MAGIC) throw new Error("not a site's texture");
  from.bytes();  // of which map
  from.bytes();  // from what
  const patch = from.u32(), perRow = from.u32();
  for (let i = 0; i < 5; ++i) from.f32();  // the camera's exposure
  const vertices = new Float32Array(from.count(12) * 3);
  for (let i = 0; i < vertices.length; ++i) vertices[i] = from.f32();
  const quads = from.count(17);
  if (!(patch > 1 && perRow > 0)) throw new Error("the site's texture has no picture");
  const width = perRow * patch, height = Math.ceil(quads / perRow) * patch;
  const positions = new Float32Array(quads * 12), places = new Float32Array(quads * 8), corners = new Uint32Array(quads * 6);
  for (let q = 0; q < quads; ++q) {
    const column = (q % perRow) * patch + 0.5, row = Math.floor(q / perRow) * patch + 0.5;
    for (let i = 0; i < 4; ++i) {
      const vertex = from.u32(), k = q * 4 + i;
      if (vertex * 3 >= vertices.length) throw new Error("the site's texture has a corner that is not there");
      positions.set(vertices.subarray(vertex * 3, vertex * 3 + 3), k * 3);
      places[k * 2] = (column + (ACROSS[i] as number) * (patch - 1)) / width;
      places[k * 2 + 1] = (row + (DOWN[i] as number) * (patch - 1)) / height;
    }
    [0, 1, 2, 0, 2, 3].forEach((corner, i) => { corners[q * 6 + i] = q * 4 + corner; });
  }
  const looks = from.take(quads), seen = new Uint8Array(quads * 4);
  for (let k = 0; k < seen.length; ++k) seen[k] = looks[k >> 2] === 0 ? 1 : 0;
  const jpeg = from.bytes();
  if (!from.finished) throw new Error("the site's texture has another length than it says");
  return { positions, places, seen, corners, width, height, jpeg };
}

export async function parseRecorded(buffer: ArrayBuffer): Promise<Recorded> {
  const surface = parseSurface(buffer);
  return { ...surface, picture: await createImageBitmap(new Blob([surface.jpeg as BlobPart], { type: "image/jpeg" })) };
}
