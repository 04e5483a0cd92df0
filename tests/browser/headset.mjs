// The 3D view in an emulated headset (iwer): node headset.mjs FOLDER. Checks that virtual objects are where
// the calibration puts them.
import assert from "node:assert/strict";
import { fileURLToPath } from "node:url";
import { join } from "node:path";
import { launch, openPage } from "./built_page.mjs";

const folder = process.argv[2] ?? ".";
const emulator = fileURLToPath(new URL("node_modules/iwer/build/iwer.min.js", import.meta.url));
const install = fileURLToPath(new URL("install_headset.js", import.meta.url));
/** A machine that builds something else meanwhile is slow. */
const PATIENCE_MS = 180_000;
const browser = await launch(), wrong = [];
const step = async (name, run) => { await run(); console.log(`ok  ${name}`); };

try {
  const page = await openPage(browser, { station: { agents: 6, still: true }, hash: "#instructor/scene", scripts: [emulator, install], wrong });
  page.setDefaultTimeout(PATIENCE_MS);
  const button = page.getByRole("button", { name: "Enter headset", exact: true });
  const state = () => page.evaluate(() => {
    const ground = [...document.querySelectorAll(".ground")].find((each) => each.stage), headset = ground.headset();
    const { map, renderer } = ground.stage, at = (x, y, z) => map.localToWorld(new map.position.constructor(x, y, z)).toArray();
    return { presenting: renderer.xr.isPresenting, calibrated: headset?.aligning.aligned, robot: at(...globalThis.fakePlace(0).slice(0, 2), 0), agent: at(...globalThis.fakePlace(1).slice(0, 2), 0), place: [globalThis.fakePlace(0), globalThis.fakePlace(1)], building: map.getObjectByName("building")?.visible, drawn: renderer.info.render.frame };
  });
  const until = async (what, found) => {
    for (let i = 0; i < 600; ++i) {
      const now = await state();
      if (found(now)) return now;
      await page.waitForTimeout(50);
    }
    assert.fail(`never: ${what}`);
  };

  const pictures = async (count) => {
    const { drawn } = await state();
    await until(`${count} more pictures`, (s) => s.drawn >= drawn + count);
  };

  await step("a press opens the headset, the robot two metres ahead", async () => {
    await button.click();
    const now = await until("presenting", (s) => s.presenting && s.calibrated === false);
    const { robot } = await until("placed", (s) => Math.abs(s.robot[2] + 2) < 1e-3);
    assert.ok(Math.abs(robot[0]) < 1e-3 && Math.abs(robot[1]) < 1e-3, `robot at ${robot}`);
    assert.equal(now.presenting, true);
  });

  await step("the trigger, held over the robot, says where everything stands", async () => {
    await page.evaluate(() => {
      const controller = globalThis.headset.controllers.right;
      controller.position.set(0.5, 0.9, -1.2);
      controller.quaternion.set(0, 0, 0, 1);  // points away from the wearer
    });
    // A headset reads its controllers once per picture.
    await pictures(3);
    await page.evaluate(() => globalThis.headset.controllers.right.updateButtonValue("trigger", 1));
    await pictures(3);
    await page.evaluate(() => globalThis.headset.controllers.right.updateButtonValue("trigger", 0));
    const now = await until("calibrated", (s) => s.calibrated && Math.abs(s.robot[2] + 1.2) < 0.02);
    const [[rx, ry, yaw], [ax, ay]] = now.place;
    // In the robot's own frame: ahead is -z of the headset, left is -x.
    const dx = Math.cos(yaw) * (ax - rx) + Math.sin(yaw) * (ay - ry), dy = -Math.sin(yaw) * (ax - rx) + Math.cos(yaw) * (ay - ry);
    assert.ok(Math.abs(now.robot[0] - 0.5) < 0.02, `robot at ${now.robot}`);
    assert.ok(Math.hypot(now.agent[0] - (0.5 - dy), now.agent[2] - (-1.2 - dx)) < 0.02, `agent at ${now.agent}, not at ${[0.5 - dy, -1.2 - dx]}`);
    assert.ok(Math.abs(now.agent[1]) < 1e-3);
    assert.equal(now.building, false, "through glass the building is seen itself");
    await pictures(3);
    await page.screenshot({ path: join(folder, "headset.png") });
  });

  await step("a closed hand is the emergency stop, and the wearer sees that it holds", async () => {
    const stops = () => page.evaluate(() => globalThis.fakeStationReceived.filter((text) => JSON.parse(text).type === "estop").length);
    const shown = (name = "stopped") => page.evaluate((board) => [...document.querySelectorAll(".ground")].find((each) => each.stage).stage.scene.getObjectByName(board).visible, name);
    assert.equal(await stops(), 0);
    assert.equal(await shown(), false);
    await page.evaluate(() => globalThis.headset.controllers.left.updateButtonValue("squeeze", 1));
    await pictures(3);
    await page.evaluate(() => globalThis.headset.controllers.left.updateButtonValue("squeeze", 0));
    await pictures(3);
    assert.ok((await stops()) > 0, "nobody was told to stop");
    await page.evaluate(() => { globalThis.fakeStopped = true; });
    for (let i = 0; i < 600 && !(await shown()); ++i) await pictures(1);
    assert.equal(await shown(), true);
    assert.equal(await shown("unheard"), false);
    await page.screenshot({ path: join(folder, "headset-stopped.png") });
    assert.ok((await state()).calibrated, "a stop moves nothing of what is seen");
    await page.evaluate(() => { globalThis.fakeStopped = false; });
  });

  await step("a long pull places the site again", async () => {
    await page.evaluate(() => {
      globalThis.headset.controllers.right.position.set(-0.4, 0.9, -1.5);
      globalThis.headset.controllers.right.updateButtonValue("trigger", 1);
    });
    await pictures(3);  // by now the headset has read the trigger
    const began = Date.now();
    await page.waitForFunction((at) => Date.now() - at > 1700, began);
    await page.evaluate(() => globalThis.headset.controllers.right.updateButtonValue("trigger", 0));
    await until("placed again", (s) => s.calibrated && Math.abs(s.robot[0] + 0.4) < 0.02 && Math.abs(s.robot[2] + 1.5) < 0.02);
  });

  await step("pictures go on while it is worn, and it can be taken off", async () => {
    await pictures(10);
    await page.getByRole("button", { name: "Leave headset" }).press("Enter");
    await until("left", (s) => !s.presenting && s.calibrated === undefined);
    await button.waitFor();
  });

  await step("a stop that reached nobody says so, and not that it holds", async () => {
    await button.click();
    await until("presenting", (s) => s.presenting);
    await page.evaluate(() => {
      for (const socket of globalThis.fakeSockets) socket.readyState = 3;
    });
    await pictures(3);
    await page.evaluate(() => globalThis.headset.controllers.left.updateButtonValue("squeeze", 1));
    await pictures(3);
    const boards = await page.evaluate(() => {
      const { scene } = [...document.querySelectorAll(".ground")].find((each) => each.stage).stage;
      return ["unheard", "stopped"].map((name) => scene.getObjectByName(name).visible);
    });
    assert.deepEqual(boards, [true, false]);
  });

  await step("one that shows nothing of the room draws the building, too", async () => {
    await page.close();
    const options = { station: { agents: 2, still: true, headset: { supportedSessionModes: ["inline", "immersive-vr"] } }, hash: "#instructor/scene", scripts: [emulator, install], wrong };
    const closed = await openPage(browser, options);
    closed.setDefaultTimeout(PATIENCE_MS);
    await closed.getByRole("button", { name: "Enter headset", exact: true }).click();
    const seen = () => closed.evaluate(() => {
      const { map, renderer } = [...document.querySelectorAll(".ground")].find((each) => each.stage).stage;
      return { mode: renderer.xr.getSession()?.environmentBlendMode, building: map.getObjectByName("building")?.visible, drawn: renderer.info.render.triangles };
    });
    let now = await seen();
    for (let i = 0; i < 600 && !(now.mode && now.building && now.drawn > 0); ++i) {
      await closed.waitForTimeout(50);
      now = await seen();
    }
    assert.deepEqual([now.mode, now.building], ["opaque", true]);
    await closed.screenshot({ path: join(folder, "headset-vr.png") });
  });

  assert.deepEqual(wrong, []);
} finally {
  await browser.close();
}
