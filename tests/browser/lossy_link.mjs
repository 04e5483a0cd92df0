// Driving and video over a link that loses packets: node lossy_link.mjs PROGRAM SOURCES [PRESSES]
// Run it on a lossy network (tests/bench/with_loss). A key is held for half a second, repeatedly, on the
// trainee's whole page. Measures when the robot's command turns, whether it turns at all, and how long it
// continues after the key was released (silence stops it after 0.3 s, commands older than 0.25 s move
// nothing), and the pictures that the page draws meanwhile.
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { listen, readTwist } from "./lcm.mjs";
import { logIn, openBrowser, person, run, url, writeScenario } from "./base_station.mjs";

const [program, sources, presses = "100"] = process.argv.slice(2);
const scratch = mkdtempSync(join(tmpdir(), "parhelion-")), password = "a long enough word";
const server = run(program, ["serve", writeScenario(scratch, sources), "-o", join(scratch, "session.lcm"), "--url", url, "--no-restart",
  "--http", "127.0.0.1:0", "--state-folder", join(scratch, "site")], join(scratch, "serve.txt"));
const browser = await openBrowser();
let commands = [];
const stopListening = await listen(url, "MR_CMD", (payload, at) => commands.push({ ...readTwist(payload), at }));
const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const now = () => performance.timeOrigin + performance.now();

/** Runs in the page: the times when the pictures of the video were drawn. */
function watch() {
  globalThis.drawn = [];
  const draw = CanvasRenderingContext2D.prototype.drawImage;
  CanvasRenderingContext2D.prototype.drawImage = function (picture, ...place) {
    draw.call(this, picture, ...place);
    if (picture instanceof VideoFrame) globalThis.drawn.push(performance.now());
  };
}

function printLatencies(what, list) {
  list.sort((a, b) => a - b);
  const at = (fraction) => list[Math.min(list.length - 1, Math.floor(fraction * list.length))]?.toFixed(1);
  console.log(`${what}: p50 ${at(0.5)} ms, p95 ${at(0.95)} ms, p99 ${at(0.99)} ms, worst ${list.at(-1)?.toFixed(1)} ms of ${list.length}`);
}

try {
  const link = (await server.printed(/(https?:\/\/\S+\/setup\?token=\S+)/))[1], address = new URL(link).origin;
  const { context, page } = await person(browser, address);
  await page.addInitScript(watch);
  const post = (path, data) => page.request.post(`${address}/api/v1/${path}`, { data, headers: { origin: address } });
  await post("setup", { token: new URL(link).searchParams.get("token"), name: "ada", password });
  await post("accounts", { name: "tess", role: "trainee", password });
  await context.clearCookies();
  await logIn({ page, address }, "tess", password);
  await page.getByText("Dead-man released").waitFor();
  await page.locator("[data-age]").first().waitFor();
  await wait(2000); // exclude what a page loads at its start
  await page.evaluate(() => { globalThis.drawn.length = 0; });
  const turned = [], stood = [];
  let nothing = 0;
  for (let i = 0; i < Number(presses); ++i) {
    const key = i % 2 ? "d" : "a", turns = (each) => (key === "a" ? each.wz > 0 : each.wz < 0);
    commands = [];
    const pressed = now();
    await page.keyboard.down(key);
    await wait(500);
    const released = now();
    await page.keyboard.up(key);
    await wait(700);
    const moving = commands.filter(turns);
    if (moving.length === 0) nothing += 1;
    else {
      turned.push(moving[0].at - pressed);
      stood.push(Math.max(0, moving.at(-1).at - released));
    }
  }
  const drawn = await page.evaluate(() => [...globalThis.drawn, performance.now()]);
  printLatencies("key press to the first command that turns", turned);
  console.log(`presses that moved nothing: ${nothing} of ${presses}`);
  printLatencies("key let go to the last command that turns", stood);
  printLatencies("from one picture to the next, or to the end", drawn.slice(1).map((at, i) => at - drawn[i]));
} finally {
  await browser.close();
  stopListening();
  await server.stop();
  rmSync(scratch, { recursive: true });
}
