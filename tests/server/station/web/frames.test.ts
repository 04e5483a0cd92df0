import { parseFrame } from "../../../../server/station/web/src/session/frames";

function world(rows: number, claimed = rows): ArrayBuffer {
  const view = new DataView(new ArrayBuffer(16 + 32 * rows));
  view.setUint8(0, 1);
  view.setUint16(2, 7, true);
  view.setUint32(4, claimed, true);
  view.setFloat64(8, 12.5, true);
  for (let i = 0; i < rows; ++i) {
    view.setUint16(16 + 32 * i, i + 3, true);
    view.setUint16(18 + 32 * i, 2, true);
    [1 + i, -2, 0.5, 0, 0, 0, 1].forEach((value, k) => view.setFloat32(20 + 32 * i + 4 * k, value, true));
  }
  return view.buffer;
}

function scan(n: number, x = 1): ArrayBuffer {
  const view = new DataView(new ArrayBuffer(40 + 6 * n));
  view.setUint8(0, 2);
  view.setUint8(1, 1);
  view.setUint32(4, n, true);
  view.setFloat64(8, 3, true);
  [x, 2, 0.1, -1, 0.5].forEach((value, k) => view.setFloat32(16 + 4 * k, value, true));
  for (let i = 0; i < n; ++i) {
    view.setFloat32(40 + 4 * i, 4 + i, true);
    view.setInt16(40 + 4 * n + 2 * i, i % 2 ? i : -1, true);
  }
  return view.buffer;
}

describe("frames", () => {
  test("a world has its rows", () => {
    const frame = parseFrame(world(2));
    if (frame.kind !== "world") throw new Error("not a world");
    expect([frame.table, frame.t, frame.count]).toEqual([7, 12.5, 2]);
    expect([...frame.ids]).toEqual([3, 4]);
    expect([...frame.flags]).toEqual([2, 2]);
    expect([...frame.poses.subarray(7)]).toEqual([2, -2, 0.5, 0, 0, 0, 1]);
  });

  test("a scan has its beams, also where their number is odd", () => {
    const frame = parseFrame(scan(3));
    if (frame.kind !== "scan") throw new Error("not a scan");
    expect(frame.pose).toEqual({ x: 1, y: 2, yaw: Math.fround(0.1) });
    expect([...frame.ranges]).toEqual([4, 5, 6]);
    expect([...frame.agents]).toEqual([-1, 1, -1]);
  });

  test("a scan from nobody knows where has no pose", () => {
    expect(parseFrame(scan(1, NaN))).toMatchObject({ pose: null });
  });

  test("points have place and colour", () => {
    const view = new DataView(new ArrayBuffer(32));
    view.setUint8(0, 3);
    view.setUint8(1, 1);
    view.setUint16(2, 1, true);
    view.setUint32(4, 1, true);
    [1, 2, 3].forEach((value, k) => view.setFloat32(16 + 4 * k, value, true));
    [10, 20, 30].forEach((value, k) => view.setUint8(28 + k, value));
    const frame = parseFrame(view.buffer);
    if (frame.kind !== "points") throw new Error("not points");
    expect(frame.cloud).toBe(true);
    expect([...frame.positions, ...frame.colours ?? []]).toEqual([1, 2, 3, 10, 20, 30]);
    view.setUint16(2, 0, true);
    expect(parseFrame(view.buffer)).toMatchObject({ count: 1, colours: null });
  });

  test("a frame that is shorter or longer than it says is refused", () => {
    expect(() => parseFrame(world(2, 3))).toThrow("3 rows");
    expect(() => parseFrame(world(2, 1))).toThrow("1 rows");
    expect(() => parseFrame(world(1, 0xffffffff))).toThrow();
    for (const whole of [world(2), scan(3)])
      for (let n = 0; n < whole.byteLength; ++n) expect(() => parseFrame(whole.slice(0, n))).toThrow();
  });

  test("an unknown kind is refused", () => {
    const bytes = world(1);
    new DataView(bytes).setUint8(0, 9);
    expect(() => parseFrame(bytes)).toThrow("kind 9");
  });
});
