// The pictures of the page in docs/base-station.md: node pictures.mjs PROGRAM SOURCES SCANS FOLDER
// (server/station/web/pictures). It asserts nothing.
// SCANS: folder with room_scan1.pcd and room_scan2.pcd. Run it on an idle machine: the pictures show the age
// of their video.
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { driveUntil, hold, logIn, openBrowser, person, run, until, url } from "./base_station.mjs";
import { serveRoom } from "./real_room.mjs";

const [program, sources, scans, folder] = process.argv.slice(2);
const scratch = mkdtempSync(join(tmpdir(), "parhelion-")), password = "a long enough word";
const browser = await openBrowser();
const picture = (page, name) => page.screenshot({ path: join(folder, `${name}.jpg`), type: "jpeg", quality: 82 });
/** Waits for video at its minimum age. */
const settled = async (page) => {
  await page.locator("[data-age]").first().waitFor();
  await page.waitForTimeout(2000);
  await until("a young picture", async () => Number(await page.locator("[data-age]").first().getAttribute("data-age")) < 100, 10_000).catch(() => console.log("the video is old: is the machine busy?"));
};

async function open(address, theme, to) {
  const one = await person(browser, address);
  await one.page.addInitScript(`localStorage.setItem("parhelion.theme", "${theme}"); localStorage.setItem("parhelion.hints", "trainee,instructor,observer");`);
  await to(one);
  await one.page.locator("main#panels").waitFor();
  return one.page;
}

/** For a `serve` that has just started: its address, with a trainee tess and an instructor ines. */
async function withAccounts(server) {
  const link = (await server.printed(/(https?:\/\/\S+\/setup\?token=\S+)/))[1], address = new URL(link).origin;
  const { context, page: admin } = await person(browser, address);
  const post = (path, data) => admin.request.post(`${address}/api/v1/${path}`, { data, headers: { origin: address } });
  await post("setup", { token: new URL(link).searchParams.get("token"), name: "ada", password });
  for (const [name, role] of [["tess", "trainee"], ["ines", "instructor"]]) await post("accounts", { name, role, password });
  await context.close();
  return address;
}

/** A simulated robot among people. */
async function busyHall() {
  const server = run(program, ["serve", join(sources, "server/scenarios/programmes/busy_hall.yaml"), "-o", join(scratch, "session.lcm"), "--url", url, "--no-restart",
    "--http", "127.0.0.1:0", "--state-folder", join(scratch, "site")], join(scratch, "serve.txt"));
  const address = await withAccounts(server);
  const trainee = await open(address, "light", (one) => logIn(one, "tess", password, "#trainee/drive"));
  await trainee.getByText("Dead-man released").waitFor();
  await settled(trainee);
  await trainee.keyboard.down("w");
  await trainee.waitForTimeout(2500);
  await picture(trainee, "trainee");
  await trainee.keyboard.up("w");

  const scene = await open(address, "dark", (one) => logIn(one, "ines", password, "#instructor/scene"));
  await settled(scene);
  await picture(scene, "scene");
  await server.stop();
}

/** The room of two scans: their cloud, the returns of a depth camera and a laser, and the crawler's arm. */
async function realRoom() {
  const server = await serveRoom(program, sources, scans, mkdtempSync(join(scratch, "room-"))), address = await withAccounts(server);
  const page = await open(address, "dark", (one) => logIn(one, "tess", password, "#trainee/drive"));
  await page.getByText("Dead-man released").waitFor();
  await page.getByRole("tab", { name: "Arm and head" }).click();
  const raise = page.getByRole("button", { name: /^shoulder.*raise$/ }), value = () => page.locator(".joints li", { has: raise }).locator(".value").textContent();
  await raise.hover();
  await hold("the arm is up", () => page.mouse.down(), () => page.mouse.up(), async () => Number.parseFloat(await value()) > 60);
  await page.mouse.up();
  await settled(page);
  await picture(page, "crawler");
  await page.evaluate(() => { location.hash = "#trainee/scene?layers=robots,scan,virtual,depth,cloud"; });
  await page.getByRole("application", { name: /three dimensions/ }).focus();
  for (let i = 0; i < 5; ++i) await page.keyboard.press("+");
  await settled(page);
  await picture(page, "cloud");
  await server.stop();
}

/** The demo, from the instructor's first press to the published result. */
async function demo() {
  const server = run(program, ["demo", "--silent", "--folder", join(scratch, "demo")], join(scratch, "demo.txt"));
  const link = async (who) => (await server.printed(new RegExp(`^${who} +(https?://\\S+)`, "m")))[1];
  const links = { instructor: await link("open this"), trainee: await link("trainee"), observer: await link("observer") };
  const enter = (role, theme) => open(new URL(links[role]).origin, theme, ({ page }) => page.goto(links[role]));
  const instructor = await enter("instructor", "dark");
  await until("the robot", async () => (await instructor.getByText("Localized").count()) > 0);
  const plan = await instructor.getByRole("application").boundingBox();
  const press = async (kind, x, y) => {
    await instructor.getByRole("button", { name: kind, exact: true }).click();
    await instructor.mouse.click(plan.x + plan.width * x, plan.y + plan.height * y);
  };
  await press("Barrel", 0.72, 0.34);
  await press("Person", 0.68, 0.43);
  await instructor.mouse.move(plan.x + plan.width * 0.69, plan.y + plan.height * 0.5);
  await instructor.mouse.down();
  await instructor.mouse.move(plan.x + plan.width * 0.65, plan.y + plan.height * 0.48, { steps: 3 });
  await instructor.waitForTimeout(700);
  await picture(instructor, "instructor");
  await instructor.mouse.up();
  await instructor.keyboard.press("Escape");

  const trainee = await enter("trainee", "light");
  await trainee.getByText("Dead-man released").waitFor();
  await driveUntil(trainee, trainee.locator(".score li.done").first());
  const observer = await enter("observer", "light");
  await settled(observer);
  await until("it stands", async () => (await trainee.locator(".score li.done").count()) === 2);
  await instructor.getByRole("button", { name: "End and grade" }).click();
  await instructor.getByRole("button", { name: "Press again to end" }).click();
  await observer.getByText("The session has ended.").waitFor();
  await picture(observer, "observer");
  await server.stop();
}

try {
  await demo();
  await busyHall();
  await realRoom();
} finally {
  await browser.close();
  rmSync(scratch, { recursive: true });
}
