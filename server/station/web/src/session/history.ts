/** Session content since this page was opened, for playback while the session goes on. Bounded: the oldest content
 * is dropped. */
import type { ScanFrame, WorldFrame } from "./frames";
import type { Entity, Shape } from "./protocol";

/** The entities; rows of a world frame refer to one such table. */
export interface Roster { table: number; entities: Entity[]; forms: Shape[][] }
export interface Moment extends Roster { world: WorldFrame | null; scans: Record<string, ScanFrame> }

/** s between stored samples of one source, and the time that a sweep is shown. */
const APART_S = 0.1, SWEEP_S = 3;
const bytesOf = (frame: WorldFrame | ScanFrame) => (frame.kind === "world" ? frame.count * 32 : frame.ranges.byteLength + frame.agents.byteLength) + 200;

export class History {
  #worlds: WorldFrame[] = [];
  #scans = new Map<string, ScanFrame[]>();
  #rosters = new Map<number, Roster>();
  #bytes = 0;

  constructor(private readonly maxBytes = 48e6) {}

  /** Session time of the first stored sample; undefined: none. */
  get from(): number | undefined {
    return this.#worlds[0]?.t;
  }
  clear() {
    this.#worlds = [];
    this.#scans.clear();
    this.#rosters.clear();
    this.#bytes = 0;
  }
  roster(roster: Roster) {
    this.#rosters.set(roster.table, roster);
  }
  world(frame: WorldFrame) {
    this.#keep(this.#worlds, frame);
    if (this.#bytes > this.maxBytes) this.#forget();
  }
  scan(key: string, frame: ScanFrame) {
    let list = this.#scans.get(key);
    if (!list) this.#scans.set(key, (list = []));
    this.#keep(list, frame);
  }
  /** The newest sample at `t`; null: dropped, or never received. */
  at(t: number): Moment | null {
    const world = newest(this.#worlds, t), roster = world && this.#rosters.get(world.table);
    if (!roster) return null;
    const scans: Record<string, ScanFrame> = {};
    for (const [key, list] of this.#scans) {
      const scan = newest(list, t);
      if (scan && t - scan.t < SWEEP_S) scans[key] = scan;
    }
    return { ...roster, world, scans };
  }

  #keep<Frame extends WorldFrame | ScanFrame>(list: Frame[], frame: Frame) {
    const last = list.at(-1);
    if (last && frame.t - last.t < APART_S) return;
    list.push(frame);
    this.#bytes += bytesOf(frame);
  }
  /** Drops the oldest tenth of each source. */
  #forget() {
    const before = this.#worlds[Math.ceil(this.#worlds.length / 10)]?.t ?? Infinity;
    for (const list of [this.#worlds, ...this.#scans.values()]) {
      let gone = 0;
      while (gone < list.length && (list[gone] as WorldFrame | ScanFrame).t < before) this.#bytes -= bytesOf(list[gone++] as WorldFrame | ScanFrame);
      list.splice(0, gone);
    }
    const tables = new Set(this.#worlds.map((each) => each.table));
    const newestTable = Math.max(...this.#rosters.keys());
    for (const table of this.#rosters.keys()) if (!tables.has(table) && table !== newestTable) this.#rosters.delete(table);
  }
}

function newest<Frame extends { t: number }>(list: readonly Frame[], t: number): Frame | undefined {
  let low = 0, high = list.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if ((list[middle] as Frame).t <= t) low = middle + 1;
    else high = middle;
  }
  return list[low - 1];
}
