// The crawler in the room of two real scans: cloud and depth points, arm, gripper, flippers and camera head,
// and a pause.
// node crawler.mjs PROGRAM SOURCES SCANS FOLDER; SCANS: folder with room_scan1.pcd and room_scan2.pcd.
// Pictures are stored in FOLDER.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { hold, logIn, noViolation, openBrowser, person, stepsOf, until } from "./base_station.mjs";
import { serveRoom } from "./real_room.mjs";

const [program, sources, scans, folder] = process.argv.slice(2);
const scratch = mkdtempSync(join(tmpdir(), "parhelion-")), password = "a long enough word";
const people = {}, { step, picture } = stepsOf(people, folder);

const server = await serveRoom(program, sources, scans, scratch), browser = await openBrowser();
try {
  const link = (await server.printed(/(https?:\/\/\S+\/setup\?token=\S+)/))[1], address = new URL(link).origin;
  const post = async (page, path, data) => assert.ok((await page.request.post(`${address}/api/v1/${path}`, { data, headers: { origin: address } })).ok(), path);
  const arrive = async (role, hash, script = "") => {
    people[role] = await person(browser, address);
    await people[role].page.addInitScript(script);
    await logIn(people[role], role, password, hash);
    return people[role].page;
  };
  const { page: admin, context } = await person(browser, address);
  await post(admin, "setup", { token: new URL(link).searchParams.get("token"), name: "ada", password });
  for (const role of ["trainee", "instructor"]) await post(admin, "accounts", { name: role, role, password });
  await context.close();
  const page = await arrive("trainee", "#trainee/scene?layers=robots,scan,depth,cloud");

  /** An evenly spread sample of each point cloud in the 3D view: three numbers each, in map. */
  const clouds = (maxPoints) => page.evaluate((maxPoints) => {
    const ground = [...document.querySelectorAll(".ground")].find((each) => each.stage), drawn = [];
    ground?.stage.map.traverse((each) => { if (each.isPoints && each.visible) drawn.push(each.geometry); });
    return drawn.map((each) => {
      const { array } = each.getAttribute("position"), { count } = each.drawRange, step = Math.ceil(count / maxPoints);
      return Array.from({ length: Math.floor(count / step) }, (_, i) => [...array.slice(3 * step * i, 3 * step * i + 3)]);
    });
  }, maxPoints);
  const middle = (list) => list.sort((a, b) => a - b)[Math.floor(list.length / 2)];

  await step("the registered cloud lies where its building is, and what the depth camera sees lies on it", async () => {
    await until("scan, depth points and cloud", async () => (await clouds(1)).length === 3);
    const [, depth, cloud] = await clouds(20_000);
    assert.ok(cloud.length > 10_000, `${cloud.length} points of the cloud`);
    const floor = cloud.filter(([x, y, z]) => Math.hypot(x, y) < 3 && Math.abs(z) < 0.3).map(([, , z]) => z);
    assert.ok(Math.abs(middle(floor)) < 0.03, "its floor is the model's");
    // Outside the robot's own arm and flippers.
    const seen = depth.filter(([x, y]) => Math.hypot(x + 0.3, y + 0.3) > 1).filter((_, i) => i % 10 === 0);
    assert.ok(seen.length > 50, `${seen.length} points of the depth camera`);
    const near = seen.map((p) => Math.sqrt(Math.min(...cloud.map((q) => (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2))));
    assert.ok(middle(near) < 0.1, `half of the points are ${middle(near)} m off the cloud`);
    await noViolation(page, "layers");
    await picture(page, "layers");
  });

  await step("a layer that is switched off is gone, and the URL says so", async () => {
    await page.getByRole("button", { name: "Layers" }).first().click();
    await page.getByRole("checkbox", { name: "Registered cloud" }).uncheck();
    await until("the cloud is gone", async () => (await clouds(1)).length === 2);
    assert.match(page.url(), /layers=scan,robots,depth$/);
    await page.keyboard.press("Escape");
  });

  await step("arm, gripper, flippers and camera head move while their buttons are held, and one sees it from the side", async () => {
    await page.getByRole("button", { name: "Drive", exact: true }).click();
    await page.getByRole("tab", { name: "Arm and head" }).click();
    const row = (name) => page.locator(".joints li").filter({ has: page.getByRole("button", { name, exact: true }) });
    const value = async (name) => Number.parseFloat(await row(name).locator(".value").textContent());
    const outlines = () => page.locator(".joints polygon").evaluateAll((all) => all.map((each) => each.getAttribute("points")));
    for (const [name, direction, minChange, moves] of [["shoulder", "raise", 5, 2], ["left finger", "raise", 5, 1], ["left flipper", "lower", 5, 1], ["camera pan", "raise", 5, 0]]) {
      const begun = await value(name), sign = direction === "raise" ? 1 : -1, before = await outlines();
      await row(name).getByRole("button", { name: new RegExp(`: ${direction}$`) }).hover();
      await hold(`${name} moves`, () => page.mouse.down(), () => page.mouse.up(), async () => sign * ((await value(name)) - begun) >= minChange);
      await page.mouse.up();
      const after = await outlines();
      assert.ok(after.filter((each, i) => each !== before[i]).length >= moves, `${name}: seen from the side`);
    }
    await noViolation(page, "arm and head");
    await picture(page, "joints");
  });

  await step("both flippers move by one key, and stand when it is let go", async () => {
    await page.getByRole("button", { name: "both flippers", exact: true }).click();
    const values = async () => (await page.locator(".joints li").first().locator(".value").textContent()).split("/").map(Number.parseFloat);
    const [left, right] = await values();
    await hold("both move", () => page.keyboard.down("f"), () => page.keyboard.up("f"), async () => {
      const now = await values();
      return now[0] < left - 5 && now.at(-1) < right - 5;
    });
    await page.keyboard.up("f");
    let last = [];
    await until("they stand", async () => {
      const now = await values(), stand = String(now) === String(last);
      last = now;
      return stand && new Promise((looked) => setTimeout(() => looked(true), 300)).then(async () => String(await values()) === String(now));
    });
    assert.ok(Math.min(...last) > -60, "short of where they end");
  });

  await step("the instructor, whose browser decodes no H.264, has JPEG, and pauses the simulated robot until it goes on", async () => {
    const instructor = await arrive("instructor", "", "delete globalThis.VideoDecoder");
    await instructor.locator("[data-age][data-codec=jpeg]").waitFor();
    await instructor.getByRole("button", { name: "Pause", exact: true }).click();
    await instructor.getByRole("button", { name: "Resume", exact: true }).click();
    await instructor.getByRole("button", { name: "Pause", exact: true }).waitFor();
  });

  await step("nothing went wrong in any page", async () => {
    for (const [role, { wrong }] of Object.entries(people)) assert.deepEqual(wrong, [], role);
  });
} finally {
  await browser.close();
  await server.stop();
  rmSync(scratch, { recursive: true });
}
