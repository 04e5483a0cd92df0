/** One frame of /ws/video: a little-endian header and the picture. */

export type FrameState = "live" | "original" | "simulated";

export interface Frame {
  codec: "h264" | "jpeg";
  key: boolean;
  state: FrameState;
  sequence: number;
  stampUs: number;   // of the camera, us since the epoch
  serverUs: number;  // time of sending, the server's clock
  drawnUs?: number;  // time before encoding, the server's clock; missing from servers before kind 5
  width: number;
  height: number;
  bytes: Uint8Array;
}

/** By its kind, the first byte. */
const headerBytes: Record<number, number> = { 4: 28, 5: 36 };
const states: FrameState[] = ["live", "original", "simulated"];

/** null: unknown kind of frame. */
export function readFrame(buffer: ArrayBuffer): Frame | null {
  const view = new DataView(buffer);
  const kind = buffer.byteLength ? view.getUint8(0) : 0, header = headerBytes[kind];
  if (!header || buffer.byteLength <= header) return null;
  const codec = view.getUint8(1), state = states[view.getUint8(3)];
  if (codec > 1 || !state) return null;
  const frame: Frame = {
    codec: codec === 0 ? "h264" : "jpeg",
    key: view.getUint8(2) !== 0,
    state,
    sequence: view.getUint32(4, true),
    // Microseconds since the epoch stay exact in a double until the year 2255.
    stampUs: Number(view.getBigInt64(8, true)),
    serverUs: Number(view.getBigInt64(16, true)),
    ...(kind === 5 ? { drawnUs: Number(view.getBigInt64(24, true)) } : {}),
    width: view.getUint16(header - 4, true),
    height: view.getUint16(header - 2, true),
    bytes: new Uint8Array(buffer, header),
  };
  return frame.width && frame.height ? frame : null;
}
