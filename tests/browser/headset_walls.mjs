// Alignment and hidden surfaces in an emulated see-through headset (iwer): node headset_walls.mjs FOLDER. The pixels of
// virtual objects are counted: those that change when the objects are taken out of the frame.
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

// The wearer stands at (5, 4) in a room of 8 m and looks along x at a wall with a door, at x = 8. A person stands
// behind it at (10, 4), the real robot to the side.
const truth = { turn: Math.PI / 2, x: 4, y: 0, z: 5 };
const corners = [{ name: "first", x: 7.94, y: 7.94 }, { name: "second", x: 0.06, y: 7.94 }, { name: "third", x: 0.06, y: 0.06 }];
const toHeadset = ({ turn, x, y, z }, p, height) => [x + Math.cos(turn) * p.x - Math.sin(turn) * p.y, y + height, z - Math.sin(turn) * p.x - Math.cos(turn) * p.y];

/** A page with known points chosen; the functions of the test on `globalThis`. */
async function opened({ points = corners.slice(0, 2), method = "points", marker = null, headset = {}, scripts = [], ...station } = {}) {
  const options = { rooms: 2, agents: 1, still: true, doors: true, places: { 0: [3, 1.5, 0], 1: [10, 4, 0] }, stored: { "parhelion.headset.references.workshop.fake": { method, points, marker } }, headset, ...station };
  const page = await openPage(browser, { station: options, hash: "#instructor/scene", scripts: [emulator, ...scripts, install], width: 1000, height: 600, wrong });
  page.setDefaultTimeout(PATIENCE_MS);
  await page.evaluate(() => {
    const stage = () => [...document.querySelectorAll(".ground")].find((each) => each.stage)?.stage;
    globalThis.worn = () => [...document.querySelectorAll(".ground")].find((each) => each.stage)?.headset();
    /** Pixels of the next frame that change while `hidden(map)` is not drawn. */
    globalThis.pixelsOf = (name) => new Promise((resolve) => {
      const { renderer, map } = stage(), { render } = renderer, gl = renderer.getContext();
      const read = () => {
        const pixels = new Uint8Array(gl.drawingBufferWidth * gl.drawingBufferHeight * 4);
        gl.readPixels(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
        return new Uint32Array(pixels.buffer);
      };
      renderer.render = function (...all) {
        renderer.render = render;
        render.apply(renderer, all);
        const before = read(), object = map.getObjectByName(name), { visible } = object;
        object.visible = false;
        render.apply(renderer, all);
        object.visible = visible;
        const after = read();
        resolve(before.reduce((count, pixel, i) => count + (pixel === after[i] ? 0 : 1), 0));
      };
    });
    globalThis.frames = () => stage().renderer.info.render.frame;
    /** Resolves after this many frames and not before this many ms. */
    globalThis.nextFrames = (count, ms = 0) => new Promise((resolve) => {
      const at = globalThis.frames() + count, end = performance.now() + ms;
      const look = () => (globalThis.frames() >= at && performance.now() >= end ? resolve() : setTimeout(look, 5));
      look();
    });
  });
  return page;
}

const until = async (page, what, found, given) => {
  for (const end = Date.now() + PATIENCE_MS; Date.now() < end; await page.waitForTimeout(50)) if (await page.evaluate(found, given)) return;
  assert.fail(`never: ${what}: ${JSON.stringify(await page.evaluate(() => globalThis.worn?.() && { ...globalThis.worn().aligning.place, state: globalThis.worn().aligning.state, refusal: globalThis.worn().aligning.refusal }))}`);
};
const frames = (page, count = 3) => page.evaluate((n) => globalThis.nextFrames(n), count);
async function enter(page) {
  await page.getByRole("button", { name: "Enter headset", exact: true }).press("Enter");
  await until(page, "worn", () => globalThis.worn?.() != null);
  await frames(page);
}
/** The trigger of the right controller at a place of the headset's space, held for `ms`. A headset reads its controllers
 * once per frame; the page itself counts frames, because a pull that takes long means something else. */
const pull = (page, place, held = 0) => page.evaluate(async ([[x, y, z], ms]) => {
  const { right } = globalThis.headset.controllers;
  right.position.set(x, y, z);
  await globalThis.nextFrames(3);
  right.updateButtonValue("trigger", 1);
  await globalThis.nextFrames(2, ms);
  right.updateButtonValue("trigger", 0);
  await globalThis.nextFrames(3);
}, [place, held]);
const touch = (page, point, place = truth, off = 0) => pull(page, toHeadset(place, { x: point.x - off, y: point.y }, 1.1));
const aligning = (page) => page.evaluate(() => {
  const { place, state, refusal, off_m, drifted, spaceReset, kept, aligned } = globalThis.worn().aligning;
  return { place, state, refusal, off_m, drifted, spaceReset, kept, aligned };
});
const phantom = (page) => page.evaluate(() => globalThis.pixelsOf("solids"));
/** The same if nothing hid anything. */
async function unhidden(page) {
  const scale = (factor) => page.evaluate((by) => {
    const { map } = [...document.querySelectorAll(".ground")].find((each) => each.stage).stage;
    for (const name of ["occluder", "occluders"]) map.getObjectByName(name).scale.setScalar(by);
  }, factor);
  await scale(0);
  const count = await phantom(page);
  await scale(1);
  return count;
}
const door = (page, angle) => page.evaluate((a) => { globalThis.fakeDoors = { "door 6": a }; }, angle);
const align = async (page, points = corners.slice(0, 2)) => { for (const each of points) await touch(page, each); };
const leave = async (page) => {
  await page.getByRole("button", { name: "Leave headset" }).press("Enter");
  await until(page, "left", () => globalThis.worn() === null);
};

try {
  await step("known points and the marker's place are chosen in the view of the site, and the marker is printed in its size", async () => {
    const flat = await opened({ method: "robot", points: [] });
    const press = async (x, y) => {
      const [px, py] = await flat.evaluate((at) => {
        const ground = [...document.querySelectorAll(".ground")].find((each) => each.stage), { stage } = ground, box = ground.getBoundingClientRect();
        const p = new stage.map.position.constructor(...at, 0).project(stage.camera);
        return [box.left + ((p.x + 1) / 2) * box.width, box.top + ((1 - p.y) / 2) * box.height];
      }, [x, y]);
      await flat.mouse.click(px, py);
    };
    // The view is fitted again when the robot's pose arrives.
    await until(flat, "a view that stands still", () => new Promise((resolve) => {
      const { stage } = [...document.querySelectorAll(".ground")].find((each) => each.stage) ?? {}, before = stage?.camera.position.clone();
      setTimeout(() => resolve(before?.equals(stage.camera.position) && stage.map.getObjectByName("solids").children[0].geometry.drawRange.count < Infinity), 1000);
    }));
    const chosen = () => flat.evaluate(() => JSON.parse(localStorage.getItem("parhelion.headset.references.workshop.fake")));
    const menu = flat.getByRole("button", { name: "Alignment", exact: true });
    await menu.press("Enter");
    await flat.getByText("Not aligned: the robot is assumed 2 m ahead.").waitFor();
    await flat.getByLabel("Known points").check();
    await flat.getByRole("button", { name: "Choose points" }).press("Enter");
    for (const [x, y] of [[7.8, 7.7], [0.2, 7.8], [3, 1.6], [8.2, 4.6], [0.2, 7.8]]) await press(x, y);
    const { method, points } = await chosen();
    assert.equal(method, "points");
    assert.deepEqual(points.map((each) => [each.name, Number(each.x.toFixed(2)), Number(each.y.toFixed(2))]), [["wall 6, wall 8", 7.94, 7.94], ["rover", 3, 1.5], ["door 6", 8.06, 4.5]]);
    await flat.keyboard.press("Escape");
    await menu.press("Enter");
    await flat.getByLabel("Printed marker").check();
    await flat.getByRole("button", { name: "Choose place" }).press("Enter");
    await press(7.7, 2);
    const { marker } = await chosen();
    assert.deepEqual([marker.wall, marker.x.toFixed(2), marker.y.toFixed(1), Math.cos(marker.yaw).toFixed(3)], ["wall 5", "7.94", "2.0", "-1.000"]);
    await menu.press("Enter");
    await flat.screenshot({ path: join(folder, "headset-menu.png") });
    await flat.getByRole("button", { name: "Print marker" }).press("Enter");
    await flat.emulateMedia({ media: "print" });
    const width = await flat.locator(".marker-sheet canvas").evaluate((canvas) => canvas.getBoundingClientRect().width);
    assert.ok(Math.abs(width - (180 / 25.4) * 96) < 1, `${width} px of CSS`);
    await flat.screenshot({ path: join(folder, "headset-marker.png"), fullPage: true });
    await flat.close();
  });

  const page = await opened();

  await step("before an alignment nothing hides a virtual person", async () => {
    await enter(page);
    await page.evaluate((place) => { globalThis.worn().aligning.place = place; }, truth);
    await frames(page);
    const seen = await phantom(page);
    assert.ok(seen > 500, `${seen} pixels`);
    const board = await page.evaluate(() => [...document.querySelectorAll(".ground")].find((each) => each.stage).stage.scene.getObjectByName("prompt").visible);
    assert.equal(board, true);
    await page.screenshot({ path: join(folder, "headset-not-aligned.png") });
  });

  await step("two touched points align the map, and the page shows how well", async () => {
    await touch(page, corners[0]);
    assert.equal((await aligning(page)).aligned, false);
    await touch(page, corners[1], truth, 0.02);
    const { place, state } = await aligning(page);
    assert.ok(Math.hypot(place.x - truth.x, place.z - truth.z) < 0.03 && Math.abs(place.turn - truth.turn) < 0.005, JSON.stringify(place));
    assert.ok(Math.abs(state.error_m - 0.01) < 1e-3, `error ${state.error_m}`);
    await page.getByRole("button", { name: "Alignment", exact: true }).press("Enter");
    await page.getByText(/Aligned: 2 points; error 1\.0 cm, 0\.\d°; since/).waitFor();
    await page.screenshot({ path: join(folder, "headset-alignment.png") });
    await page.getByRole("button", { name: "Alignment", exact: true }).press("Escape");
  });

  await step("no pixel of a person behind wall and closed door is seen, and none of the wall is drawn", async () => {
    await door(page, 0);
    await frames(page, 6);
    await page.screenshot({ path: join(folder, "headset-wall.png") });
    assert.equal(await phantom(page), 0);
    assert.ok((await unhidden(page)) > 500);
    assert.equal(await page.evaluate(() => globalThis.pixelsOf("building")), 0);
    await page.screenshot({ path: join(folder, "headset-wall.png") });
  });

  await step("through the open door all of the person is seen", async () => {
    await door(page, 1.57);
    await until(page, "seen", async () => (await globalThis.pixelsOf("solids")) > 0);
    const seen = await phantom(page);
    await page.screenshot({ path: join(folder, "headset-door.png") });
    assert.equal(seen, await unhidden(page));
    assert.ok(seen > 500, `${seen} pixels`);
  });

  await step("the same measurement sees the person when the map is a quarter turn off", async () => {
    await door(page, 0);
    await until(page, "hidden", async () => (await globalThis.pixelsOf("solids")) === 0);
    // Turned by 90 degrees about (9, 5), the wearer is at (10, 1) in the map, in the person's room.
    const off = { turn: truth.turn - Math.PI / 2, y: 0 }, at = { x: 10, y: 1 };
    Object.assign(off, { x: -(Math.cos(off.turn) * at.x - Math.sin(off.turn) * at.y), z: Math.sin(off.turn) * at.x + Math.cos(off.turn) * at.y });
    await page.evaluate((place) => {
      // An anchor would put it right again.
      const { aligning } = globalThis.worn();
      Object.defineProperty(aligning, "place", { get: () => place, set: () => {}, configurable: true });
    }, off);
    await frames(page);
    const seen = await phantom(page);
    assert.ok(seen > 500, `${seen} pixels`);
    await page.evaluate((place) => Object.defineProperty(globalThis.worn().aligning, "place", { value: place, writable: true, configurable: true }), truth);
  });

  await step("the real robot hides what is behind it, and is itself not drawn", async () => {
    await door(page, 1.57);
    await page.evaluate(() => globalThis.headset.position.set(0, 0.35, 0));
    await until(page, "seen", async () => (await globalThis.pixelsOf("solids")) > 0);
    assert.equal(await phantom(page), await unhidden(page), "nothing is before the person yet");
    await page.evaluate(() => { globalThis.fakeStation.places[0] = [6.2, 4, 1.57]; });
    await frames(page, 10);
    const behind = await phantom(page), without = await unhidden(page);
    const drawn = await page.evaluate(() => [...document.querySelectorAll(".ground")].find((each) => each.stage).stage.map.getObjectByName("occluders").children.filter((each) => each.visible && each.material.colorWrite).length);
    assert.equal(drawn, 0);
    assert.ok(behind < without - 100 && behind > 0, `${behind} of ${without}`);
    await page.evaluate(() => {
      globalThis.fakeStation.places[0] = [3, 1.5, 0];
      globalThis.headset.position.set(0, 1.6, 0);
    });
  });

  await step("without the layer of the model nothing is hidden", async () => {
    await door(page, 0);
    await until(page, "hidden", async () => (await globalThis.pixelsOf("solids")) === 0);
    await page.getByLabel("3D view").getByRole("button", { name: "Layers" }).press("Enter");
    await page.getByLabel("Model", { exact: true }).evaluate((box) => box.click());
    await until(page, "seen", async () => (await globalThis.pixelsOf("solids")) > 0);
    await page.getByLabel("Model", { exact: true }).evaluate((box) => box.click());
    await page.getByLabel("3D view").getByRole("button", { name: "Layers" }).press("Escape");
    await until(page, "hidden again", async () => (await globalThis.pixelsOf("solids")) === 0);
  });

  await step("a touch of a known place later says what it is off by, and drift is warned of", async () => {
    await touch(page, corners[1], truth, 0.03);
    let now = await aligning(page);
    assert.ok(now.off_m > 0.005 && now.off_m < 0.04 && !now.drifted, JSON.stringify(now));
    await touch(page, corners[1], truth, 0.3);
    now = await aligning(page);
    assert.ok(Math.abs(now.off_m - 0.28) < 0.03 && now.drifted && now.aligned, JSON.stringify(now));
  });

  await step("an anchor restores the alignment in the next session, until it is forgotten", async () => {
    await until(page, "kept", () => globalThis.worn().aligning.kept);
    const before = (await aligning(page)).place;
    await leave(page);
    await enter(page);
    await until(page, "restored", () => globalThis.worn().aligning.state?.restored);
    const { place, kept } = await aligning(page);
    assert.ok(kept && Math.hypot(place.x - before.x, place.z - before.z) < 1e-3 && Math.abs(place.turn - before.turn) < 1e-3, JSON.stringify([place, before]));
    await page.getByRole("button", { name: "Alignment", exact: true }).press("Enter");
    await page.getByText(/restored from the headset's anchor/).waitFor();
    await page.getByRole("button", { name: "Forget" }).press("Enter");
    await until(page, "forgotten", () => !globalThis.worn().aligning.aligned);
    await page.getByRole("button", { name: "Alignment", exact: true }).press("Escape");
    await leave(page);
    await enter(page);
    await frames(page, 10);
    assert.equal((await aligning(page)).aligned, false);
  });

  await step("mistakes are refused with their reason, and the next touches start again", async () => {
    await touch(page, corners[0]);
    await touch(page, corners[1], truth, 0.5);
    let now = await aligning(page);
    assert.equal(now.refusal?.why, "distance");
    assert.equal(now.aligned, false);
    // Swapped: then the wall would be between the wearer and each corner.
    await touch(page, corners[1]);
    await touch(page, corners[0]);
    now = await aligning(page);
    assert.equal(now.refusal?.why, "hidden");
    assert.equal(now.aligned, false);
    // Where two frames take over a second a touch is taken for a long pull, and counts for nothing.
    for (let tries = 0; tries < 4 && !now.aligned; tries++) {
      await align(page);
      now = await aligning(page);
    }
    assert.equal(now.refusal, null);
    assert.equal(now.aligned, true);
    await pull(page, [0, 1, -1], 1700);
    assert.equal((await aligning(page)).aligned, false);
    await page.close();
  });

  await step("without anchors a reset of the floor space ends the alignment, and nothing is kept", async () => {
    const bare = await opened({ headset: { supportedFeatures: ["viewer", "local", "local-floor"] } });
    await enter(bare);
    await align(bare);
    await frames(bare, 6);
    let now = await aligning(bare);
    assert.deepEqual([now.aligned, now.kept], [true, false]);
    assert.equal(await bare.evaluate(() => Object.keys(localStorage).filter((key) => key.includes("headset.alignment")).length), 0);
    await bare.evaluate(() => globalThis.headset.recenter());
    await until(bare, "reset", () => globalThis.worn().aligning.spaceReset);
    now = await aligning(bare);
    assert.equal(now.aligned, false);
    await bare.getByRole("button", { name: "Alignment", exact: true }).press("Enter");
    await bare.getByText("The headset has reset its floor space. Align again.").waitFor();
    await bare.close();
  });

  await step("a third point improves the alignment, virtual walls are drawn", async () => {
    const three = await opened({ points: corners, virtual: [["screen", "wall", 7, 4, 1, [0.1, 1, 2]]] });
    await enter(three);
    await align(three, corners);
    const { state } = await aligning(three);
    assert.equal(state.points, 3);
    assert.ok((await three.evaluate(() => globalThis.pixelsOf("model"))) > 500);
    await three.close();
  });

  await step("a headset that does not track images says so", async () => {
    const marker = { x: 7.94, y: 2, z: 1.4, yaw: Math.PI, width_m: 0.18, wall: "wall 5" };
    const bare = await opened({ method: "marker", marker });
    await enter(bare);
    await frames(bare);
    const text = await bare.evaluate(() => [...document.querySelectorAll(".ground")].find((each) => each.stage).stage.scene.getObjectByName("prompt").userData.text);
    assert.match(text, /does not track images/);
    assert.equal((await aligning(bare)).aligned, false);
    await bare.close();
  });

  await step("a tracked marker aligns the map", async () => {
    const marker = { x: 7.94, y: 2, z: 1.4, yaw: Math.PI, width_m: 0.18, wall: "wall 5" };
    const page = await opened({ method: "marker", marker, scripts: [fileURLToPath(new URL("install_marker.js", import.meta.url))] });
    await page.evaluate(({ at, turn }) => { globalThis.fakeMarker = { at, turn }; }, { at: toHeadset(truth, marker, 1.4), turn: truth.turn + Math.PI + Math.PI / 2 });
    await enter(page);
    await until(page, "aligned", () => globalThis.worn().aligning.aligned);
    const { place, state } = await aligning(page);
    assert.equal(state.how, "marker");
    assert.ok(Math.hypot(place.x - truth.x, place.z - truth.z) < 0.01 && Math.abs(Math.sin(place.turn - truth.turn)) < 0.005, JSON.stringify(place));
    await door(page, 0);
    await until(page, "hidden", async () => (await globalThis.pixelsOf("solids")) === 0);
    await page.close();
  });

  assert.deepEqual(wrong, []);
} finally {
  await browser.close();
}
