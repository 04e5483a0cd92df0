import { History } from "../../../../server/station/web/src/session/history";
import type { ScanFrame, WorldFrame } from "../../../../server/station/web/src/session/frames";

const world = (t: number, table = 1, count = 2): WorldFrame =>
  ({ kind: "world", table, t, count, ids: new Uint16Array(count), flags: new Uint16Array(count), poses: new Float32Array(count * 7) });
const scan = (t: number): ScanFrame => ({ kind: "scan", source: 0, entity: 0, t, pose: null, rad0: 0, radstep: 1, ranges: new Float32Array(4), agents: new Int16Array(4) });
const roster = (table: number) => ({ table, entities: [], forms: [] });

describe("history", () => {
  test("of each moment what was the newest then, among those who were there", () => {
    const history = new History();
    history.roster(roster(1));
    for (let t = 0; t < 5; t += 0.5) history.world(world(t));
    history.roster(roster(2));
    for (let t = 5; t < 9; t += 0.5) history.world(world(t, 2));
    history.scan("0", scan(1));
    expect(history.from).toBe(0);
    expect(history.at(2.7)?.world?.t).toBe(2.5);
    expect(history.at(2.7)?.scans["0"]?.t).toBe(1);
    expect(history.at(6.1)).toMatchObject({ table: 2, world: { t: 6 }, scans: {} });
    expect(history.at(-1)).toBeNull();
  });
  test("frames in quick succession are thinned", () => {
    const history = new History();
    history.roster(roster(1));
    for (let i = 0; i < 100; ++i) history.world(world(i / 30));
    expect(history.at(0.05)?.world?.t).toBe(0);
    expect(history.at(3)?.world?.t).toBeGreaterThan(2.8);
  });
  test("the oldest goes first, and memory stays within its bound", () => {
    const history = new History(100 * (20 * 32 + 200));
    history.roster(roster(1));
    for (let t = 0; t < 1000; ++t) {
      history.world(world(t, 1, 20));
      history.scan("0", scan(t));
    }
    expect(history.from).toBeGreaterThan(880);
    expect(history.at(999)?.world?.t).toBe(999);
    expect(history.at(500)).toBeNull();
  });
});
