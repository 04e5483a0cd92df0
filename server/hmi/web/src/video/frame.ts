/** One frame of /ws/video as it comes: a header of 28 bytes, little-endian, and the picture. */

export type FrameState = "live" | "original" | "simulated";

export interface Frame {
  codec: "h264" | "jpeg";
  key: boolean;
  state: FrameState;
  sequence: number;
  stampUs: number;   // of the camera, us since the epoch
  serverUs: number;  // when the server sent it, its clock
  width: number;
  height: number;
  bytes: Uint8Array;
}

const headerBytes = 28;
const states: FrameState[] = ["live", "original", "simulated"];

/** null: not a frame that this page knows. */
export function readFrame(buffer: ArrayBuffer): Frame | null {
  if (buffer.byteLength <= headerBytes) return null;
  const view = new DataView(buffer);
  const codec = view.getUint8(1), state = states[view.getUint8(3)];
  if (view.getUint8(0) !== 4 || codec > 1 || !state) return null;
  const frame: Frame = {
    codec: codec === 0 ? "h264" : "jpeg",
    key: view.getUint8(2) !== 0,
    state,
    sequence: view.getUint32(4, true),
    // Microseconds since the epoch stay exact in a double until the year 2255.
    stampUs: Number(view.getBigInt64(8, true)),
    serverUs: Number(view.getBigInt64(16, true)),
    width: view.getUint16(24, true),
    height: view.getUint16(26, true),
    bytes: new Uint8Array(buffer, headerBytes),
  };
  return frame.width && frame.height ? frame : null;
}
