// A base station in the room of two real scans, with a crawler whose camera is on a turning head.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { run, url } from "./base_station.mjs";

/** The shipped crawler with its camera on a joint. */
function writeRobot(sources, made) {
  const shipped = (name) => readFileSync(join(sources, "server/robots", name), "utf8");
  const head = `<link name="camera_head"><inertial><mass value="0.3"/><inertia ixx="0.001" ixy="0" ixz="0" iyy="0.001" iyz="0" izz="0.001"/></inertial>
    <visual><geometry><box size="0.1 0.1 0.06"/></geometry></visual></link>
  <joint name="camera_pan_joint" type="revolute"><origin xyz="-0.24 0.1 0.66"/><axis xyz="0 0 1"/><parent link="base_link"/><child link="camera_head"/>
    <limit lower="-1.5" upper="1.5" velocity="1" effort="5"/></joint>`;
  writeFileSync(made("gazer.urdf"), shipped("crawler.urdf").replaceAll("crawler", "gazer").replace("</robot>", `${head}</robot>`));
  writeFileSync(made("gazer.yaml"), shipped("crawler.yaml").replaceAll("crawler", "gazer").replace("  camera:\n", "  camera:\n    head: [{joint: camera_pan_joint, point: [-0.24 m, 0.1 m, 0.66 m], axis: [0, 0, 1]}]\n"));
}

/** Registers the scans, models the room and serves it, all in the folder `scratch`. */
export async function serveRoom(program, sources, scans, scratch) {
  const made = (name) => join(scratch, name);
  writeRobot(sources, made);
  const register = run(program, ["map", "register", join(scans, "room_scan1.pcd"), join(scans, "room_scan2.pcd"), "-o", made("room.ply")], made("register.txt"));
  assert.equal(await register.ended, 0);
  assert.equal(await run(program, ["map", "model", made("room.ply"), "-o", made("room.yaml"), "--floor-to-zero"], made("model.txt")).ended, 0);
  writeFileSync(made("lab.yaml"), "name: lab\nlevel: 1\nseed: 1\nmodel: room.yaml\ntrainee: {model: gazer.yaml, pose: {x: -0.3 m, y: -0.3 m, yaw: 0 deg}}\n");
  return run(program, ["serve", made("lab.yaml"), "-o", made("session.lcm"), "--url", url, "--no-restart", "--http", "127.0.0.1:0", "--state-folder", made("site"), "--cloud", made("room.ply")], made("serve.txt"));
}
