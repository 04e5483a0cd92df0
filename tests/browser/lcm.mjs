// An LCM subscriber in Node: short messages of one channel (LCM's UDP format, magic LC02).
import { createSocket } from "node:dgram";

/** `onMessage(payload, ms)` for each message; ms since the epoch. `url`: udpm://GROUP:PORT?... Resolves to a function
 * that stops it. */
export async function listen(url, channel, onMessage) {
  const [, group, port] = /^udpm:\/\/([\d.]+):(\d+)/.exec(url);
  const socket = createSocket({ type: "udp4", reuseAddr: true });
  socket.on("message", (packet) => {
    const at = performance.timeOrigin + performance.now();
    if (packet.length < 9 || packet.readUInt32BE(0) !== 0x4c433032) return;
    const end = packet.indexOf(0, 8);
    if (end > 0 && packet.toString("latin1", 8, end) === channel) onMessage(packet.subarray(end + 1), at);
  });
  await new Promise((bound) => socket.bind(Number(port), group, bound));
  socket.addMembership(group);
  return () => socket.close();
}

/** twist2D_t: the fingerprint, utime, and three floats. */
export function readTwist(payload) {
  return { vx: payload.readFloatBE(16), vy: payload.readFloatBE(20), wz: payload.readFloatBE(24) };
}
