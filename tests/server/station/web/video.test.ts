import { AgeStatistics, frameAge, freshness, isOfPosition, staleMs, pausedPosition, warnMs } from "../../../../server/station/web/src/video/age";
import { ServerClock } from "../../../../server/station/web/src/video/clock";
import { readFrame } from "../../../../server/station/web/src/video/frame";

function frame(change: (view: DataView) => void = () => {}): ArrayBuffer {
  const buffer = new ArrayBuffer(31), view = new DataView(buffer);
  view.setUint8(0, 4);
  view.setUint8(2, 1);
  view.setUint32(4, 7, true);
  view.setBigInt64(8, 1_700_000_000_000_000n, true);
  view.setBigInt64(16, 1_700_000_000_020_000n, true);
  view.setUint16(24, 640, true);
  view.setUint16(26, 480, true);
  change(view);
  return buffer;
}

describe("a recording that stands", () => {
  const at = (position: number, paused = true) => ({ paused, position });
  test("shows the last picture of what played until then, however long it stands", () => {
    const pausedAt = pausedPosition(null, at(4), 10_000);
    expect(pausedPosition(pausedAt, at(4), 60_000)).toEqual(pausedAt);
    expect(pausedPosition(pausedAt, at(4.05), 60_000)).toEqual({ position: 4.05, at: 10_000 });
    expect(isOfPosition(pausedAt, 9_900, -Infinity)).toBe(true);
    expect(isOfPosition(pausedAt, 8_000, -Infinity)).toBe(false);
    expect(pausedPosition(pausedAt, at(4, false), 60_000)).toBeNull();
  });
  test("that was sought elsewhere wants a new picture", () => {
    const pausedAt = pausedPosition(pausedPosition(null, at(4), 10_000), at(0), 12_000);
    expect(isOfPosition(pausedAt, 10_000, -Infinity)).toBe(false);
    expect(isOfPosition(pausedAt, 11_300, 11_350)).toBe(false);
    expect(isOfPosition(pausedAt, 11_400, 11_350)).toBe(true);
    expect(isOfPosition(null, 12_050, -Infinity)).toBe(false);
  });
});

describe("frame", () => {
  test("is read as the server writes it", () => {
    expect(readFrame(frame())).toMatchObject({
      codec: "h264", key: true, state: "live", sequence: 7, stampUs: 1_700_000_000_000_000, serverUs: 1_700_000_000_020_000, width: 640, height: 480,
    });
    expect(readFrame(frame())!.bytes.length).toBe(3);
    expect(readFrame(frame((view) => view.setUint8(1, 1)))!.codec).toBe("jpeg");
  });
  test("of a newer kind also says when the picture had been drawn", () => {
    const buffer = new ArrayBuffer(39), view = new DataView(buffer);
    new Uint8Array(buffer).set(new Uint8Array(frame(), 0, 24));
    view.setUint8(0, 5);
    view.setBigInt64(24, 1_700_000_000_015_000n, true);
    view.setUint16(32, 320, true);
    view.setUint16(34, 240, true);
    expect(readFrame(buffer)).toMatchObject({ serverUs: 1_700_000_000_020_000, drawnUs: 1_700_000_000_015_000, width: 320, height: 240 });
    expect(readFrame(buffer)!.bytes.length).toBe(3);
    expect(readFrame(buffer.slice(0, 36))).toBeNull();
  });
  test("what is none is refused", () => {
    expect(readFrame(new ArrayBuffer(0))).toBeNull();
    expect(readFrame(new ArrayBuffer(28))).toBeNull();
    expect(readFrame(frame((view) => view.setUint8(0, 1)))).toBeNull();
    expect(readFrame(frame((view) => view.setUint8(1, 9)))).toBeNull();
    expect(readFrame(frame((view) => view.setUint8(3, 9)))).toBeNull();
    expect(readFrame(frame((view) => view.setUint16(24, 0, true)))).toBeNull();
  });
});

describe("the server's clock", () => {
  test("is unknown until an exchange, and then that of the quickest one", () => {
    const clock = new ServerClock();
    expect(clock.serverUs(0)).toBeUndefined();
    clock.answer(1000, 5_000_000, 1100);  // 100 ms round trip: somewhere within it
    clock.answer(2000, 6_012_000, 2004);  // 4 ms
    clock.answer(3000, 9_000_000, 3500);
    expect(clock.offset()!.roundTripMs).toBe(4);
    expect(clock.serverUs(2002)).toBe(6_012_000);
  });
  test("nonsense is passed over", () => {
    const clock = new ServerClock();
    clock.answer(1000, NaN, 1001);
    clock.answer(1000, 1, 999);
    expect(clock.offset()).toBeUndefined();
  });
});

describe("age of a picture", () => {
  const stamped = { stampUs: 1e15, serverUs: 1e15 + 20_000 };
  test("counts from the camera's stamp", () => {
    expect(frameAge(stamped, 1e15 + 80_000)).toEqual({ ms: 80, since: "camera" });
  });
  test("is not made up where the clock is unknown", () => {
    expect(frameAge(stamped, undefined)).toBeUndefined();
  });
  test("of a camera whose clock is of another time counts from the server, and says so", () => {
    expect(frameAge({ stampUs: 1, serverUs: 1e15 }, 1e15 + 30_000)).toEqual({ ms: 30, since: "server" });
  });
  test("warns, and then calls it stale: also a stream that has stopped", () => {
    expect(freshness(undefined, undefined)).toBe("none");
    expect(freshness(20, { ms: warnMs, since: "camera" })).toBe("fresh");
    expect(freshness(20, { ms: warnMs + 1, since: "camera" })).toBe("late");
    expect(freshness(20, { ms: staleMs + 1, since: "camera" })).toBe("stale");
    expect(freshness(staleMs + 1, undefined)).toBe("stale");
  });
  test("expects the pictures of a slow session farther apart, and of a fast one no nearer", () => {
    for (const [rate, factor] of [[0.1, 10], [0.5, 2], [1, 1], [10, 1]] as const) {
      expect(freshness(factor * staleMs - 1, undefined, rate)).toBe("fresh");
      expect(freshness(factor * staleMs + 1, undefined, rate)).toBe("stale");
      for (const since of ["camera", "server"] as const) {
        expect(freshness(20, { ms: factor * warnMs - 1, since }, rate)).toBe("fresh");
        expect(freshness(20, { ms: factor * warnMs + 1, since }, rate)).toBe("late");
        expect(freshness(20, { ms: factor * staleMs + 1, since }, rate)).toBe("stale");
      }
    }
  });
  test("its quantiles are of what was seen", () => {
    const ages = new AgeStatistics();
    expect(ages.quantile(0.5)).toBeUndefined();
    for (let i = 1; i <= 100; ++i) ages.add(i);
    expect(ages.quantile(0.5)).toBe(51);
    expect(ages.quantile(0.95)).toBe(96);
  });
});
