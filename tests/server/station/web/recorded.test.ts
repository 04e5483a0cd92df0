/** The packed texture of a site: corners, places in its picture, and what is damaged. */
import { parseSurface } from "../../../../server/station/web/src/session/recorded";

/** Three quads of a strip along x, pictures of 4 pixels, two in a row; the last quad was not seen. */
function packed(change: { corner?: number; cut?: number; magic?: number } = {}): ArrayBuffer {
  const bytes: number[] = [];
  const u32 = (v: number) => bytes.push(v & 255, (v >> 8) & 255, (v >> 16) & 255, (v >>> 24) & 255);
  const f32 = (v: number) => bytes.push(...new Uint8Array(new Float32Array([v]).buffer));
  const text = (words: string) => { u32(words.length); bytes.push(...new TextEncoder().encode(words)); };
  u32(change.magic ?? 0x31544850);
  text("map 1");
  text("a drive");
  u32(4);
  u32(2);
  for (let i = 0; i < 5; ++i) f32(0);
  u32(8);
  for (let x = 0; x < 4; ++x) for (let y = 0; y < 2; ++y) [x, y, 0.5].forEach(f32);
  u32(3);
  for (let q = 0; q < 3; ++q) [2 * q, 2 * q + 2, change.corner ?? 2 * q + 3, 2 * q + 1].forEach(u32);
  bytes.push(0, 0, 1);
  text("JPEG");
  return new Uint8Array(bytes.slice(0, bytes.length - (change.cut ?? 0))).buffer;
}

describe("the recorded surfaces of a site", () => {
  it("have four corners a quad, each at its place in the picture", () => {
    const surface = parseSurface(packed());
    expect([surface.width, surface.height]).toEqual([8, 8]);
    expect(Array.from(surface.positions.slice(12, 24))).toEqual([1, 0, 0.5, 2, 0, 0.5, 2, 1, 0.5, 1, 1, 0.5]);
    // The second quad's picture is right of the first's: its outer pixels' centres are its corners.
    expect(Array.from(surface.places.slice(8, 16), (v) => v * 8)).toEqual([4.5, 0.5, 7.5, 0.5, 7.5, 3.5, 4.5, 3.5]);
    expect(surface.places[17]! * 8).toBe(4.5);
    expect(Array.from(surface.seen)).toEqual([1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0]);
    expect(Array.from(surface.corners.slice(6, 12))).toEqual([4, 5, 6, 4, 6, 7]);
    expect(new TextDecoder().decode(surface.jpeg)).toBe("JPEG");
  });
  it("are refused when damaged", () => {
    expect(() => parseSurface(packed({ magic: 7 }))).toThrow("not a site's texture");
    expect(() => parseSurface(packed({ corner: 8 }))).toThrow("not there");
    expect(() => parseSurface(packed({ cut: 1 }))).toThrow("cut off");
    expect(() => parseSurface(new ArrayBuffer(3))).toThrow("cut off");
  });
});
