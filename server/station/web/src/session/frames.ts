/** The binary frames of /ws/state: little-endian, first byte the kind. Views into the received buffer, not copies. */

export const SCAN_REAL = 0, SCAN_MIXED = 1, SCAN_AGENT = 2;
export const FLAG_NO_ATTITUDE = 1, FLAG_UNSENSED = 2, FLAG_REMEMBERED = 4, FLAG_COLOURED = 1;

/** Pose of every part at session time `t`: seven floats each, x, y, z, qx, qy, qz, qw in map. */
export interface WorldFrame { kind: "world"; table: number; t: number; count: number; ids: Uint16Array; flags: Uint16Array; poses: Float32Array }
/** A sweep; x, y, yaw are the laser's pose in map at the stamp, null if unknown. agent[i]: entity id or -1 for a
 * real return. */
export interface ScanFrame {
  kind: "scan"; source: number; entity: number; t: number; pose: { x: number; y: number; yaw: number } | null;
  rad0: number; radstep: number; ranges: Float32Array; agents: Int16Array;
}
/** Points in map: positions three floats each, colours three bytes each; null: without colours. */
export interface PointsFrame { kind: "points"; cloud: boolean; t: number; count: number; positions: Float32Array; colours: Uint8Array | null }
export type Frame = WorldFrame | ScanFrame | PointsFrame;

const WORLD_ROW = 32, POINT_ROW = 16, MAX_ROWS = 4_000_000;

/** Throws if the buffer does not match its header. */
export function parseFrame(buffer: ArrayBuffer): Frame {
  const view = new DataView(buffer);
  if (view.byteLength < 16) throw new Error(`a frame of ${view.byteLength} bytes has no header`);
  switch (view.getUint8(0)) {
    case 1: return world(view);
    case 2: return scan(view);
    case 3: return points(view);
    default: throw new Error(`a frame of unknown kind ${view.getUint8(0)}`);
  }
}

function fits(view: DataView, what: string, header: number, count: number, row: number) {
  if (count > MAX_ROWS || view.byteLength !== header + count * row)
    throw new Error(`${what}: ${view.byteLength} bytes cannot hold ${count} rows of ${row}`);
}

function world(view: DataView): WorldFrame {
  const count = view.getUint32(4, true);
  fits(view, "world", 16, count, WORLD_ROW);
  const ids = new Uint16Array(count), flags = new Uint16Array(count), poses = new Float32Array(count * 7);
  for (let i = 0, at = 16; i < count; ++i, at += WORLD_ROW) {
    ids[i] = view.getUint16(at, true);
    flags[i] = view.getUint16(at + 2, true);
    for (let k = 0; k < 7; ++k) poses[i * 7 + k] = view.getFloat32(at + 4 + 4 * k, true);
  }
  return { kind: "world", table: view.getUint16(2, true), t: view.getFloat64(8, true), count, ids, flags, poses };
}

function scan(view: DataView): ScanFrame {
  const count = view.getUint32(4, true), header = 40;
  fits(view, "scan", header, count, 6);
  const ranges = new Float32Array(count), agents = new Int16Array(count);
  for (let i = 0; i < count; ++i) ranges[i] = view.getFloat32(header + 4 * i, true);
  for (let i = 0; i < count; ++i) agents[i] = view.getInt16(header + 4 * count + 2 * i, true);
  const x = view.getFloat32(16, true), y = view.getFloat32(20, true), yaw = view.getFloat32(24, true);
  const known = Number.isFinite(x) && Number.isFinite(y) && Number.isFinite(yaw);
  return {
    kind: "scan", source: view.getUint8(1), entity: view.getUint16(2, true), t: view.getFloat64(8, true),
    pose: known ? { x, y, yaw } : null, rad0: view.getFloat32(28, true), radstep: view.getFloat32(32, true), ranges, agents,
  };
}

function points(view: DataView): PointsFrame {
  const count = view.getUint32(4, true);
  fits(view, "points", 16, count, POINT_ROW);
  const positions = new Float32Array(count * 3), colours = view.getUint16(2, true) & FLAG_COLOURED ? new Uint8Array(count * 3) : null;
  for (let i = 0, at = 16; i < count; ++i, at += POINT_ROW)
    for (let k = 0; k < 3; ++k) {
      positions[i * 3 + k] = view.getFloat32(at + 4 * k, true);
      if (colours) colours[i * 3 + k] = view.getUint8(at + 12 + k);
    }
  return { kind: "points", cloud: view.getUint8(1) === 1, t: view.getFloat64(8, true), count, positions, colours };
}
