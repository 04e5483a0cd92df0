// Latency from the publication of a picture to reading it back out of the trainee's whole page, including
// encoding and sending:
// node picture_latency.mjs PROGRAM SOURCES [SECONDS [SESSION RATE]]
// `serve` with a simulated robot, whose camera is rendered meanwhile; or `play` of a session log at RATE
// times its speed, with recorded pictures (the demo's 10 Hz become 30 Hz at 3). One machine, one clock.
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { openBrowser, person, run, url, writeScenario } from "./base_station.mjs";

const [program, sources, seconds = "20", session, rate = "3"] = process.argv.slice(2);
const scratch = mkdtempSync(join(tmpdir(), "parhelion-")), password = "a long enough word";
const station = ["--http", "127.0.0.1:0"];
const server = run(program, session
  ? ["play", resolve(session), "--rate", rate, "--loop", ...station]
  : ["serve", writeScenario(scratch, sources), "-o", join(scratch, "session.lcm"), "--url", url, "--no-restart", ...station, "--state-folder", join(scratch, "site")],
join(scratch, "server.txt"));
const browser = await openBrowser();

/** Runs in the page: for each picture of the video the time from drawing to reading it back, and from there to the
 * next paint of the page, ms. */
function watch() {
  Object.assign(globalThis, { readBack: [], painted: [], since: "sent" });
  const drawn = new Map();
  const handler = Object.getOwnPropertyDescriptor(WebSocket.prototype, "onmessage");
  Object.defineProperty(WebSocket.prototype, "onmessage", {
    set(listener) {
      handler.set.call(this, (event) => {
        if (event.data instanceof ArrayBuffer && this.url.includes("/ws/video")) {
          const view = new DataView(event.data), hasDrawnTime = view.getUint8(0) >= 5;
          if (hasDrawnTime) globalThis.since = "drawn";
          drawn.set(view.getUint32(4, true), Number(view.getBigInt64(hasDrawnTime ? 24 : 16, true)) / 1000);
        }
        listener.call(this, event);
      });
    },
  });
  const now = () => performance.timeOrigin + performance.now(), draw = CanvasRenderingContext2D.prototype.drawImage;
  CanvasRenderingContext2D.prototype.drawImage = function (picture, ...place) {
    draw.call(this, picture, ...place);
    if (!(picture instanceof VideoFrame)) return;
    const at = drawn.get(picture.timestamp);
    this.getImageData(this.canvas.width >> 1, this.canvas.height >> 1, 1, 1);
    globalThis.readBack.push(now() - at);
    requestAnimationFrame(() => { globalThis.painted.push(now() - at); });
  };
}

try {
  // `serve` prints a link that creates the first account, `play` one for an observer.
  const link = (await server.printed(/(https?:\/\/\S+\?token=\S+)/))[1], address = new URL(link).origin;
  const { context, page } = await person(browser, address);
  await page.addInitScript(watch);
  if (link.includes("/setup")) {
    const post = (path, data) => page.request.post(`${address}/api/v1/${path}`, { data, headers: { origin: address } });
    await post("setup", { token: new URL(link).searchParams.get("token"), name: "ada", password });
    await post("accounts", { name: "a_trainee", role: "trainee", password });
    await context.clearCookies();
    await post("login", { name: "a_trainee", password });
    await page.goto(address);
  } else await page.goto(link);
  await page.locator("[data-age]").first().waitFor();
  await page.waitForTimeout(2000);  // exclude what a page loads at its start
  await page.evaluate(() => { globalThis.readBack.length = globalThis.painted.length = 0; });
  await page.waitForTimeout(Number(seconds) * 1000);
  const { readBack, painted, since } = await page.evaluate(() => ({ readBack: globalThis.readBack, painted: globalThis.painted, since: globalThis.since }));
  for (const [what, found] of [["read back in the page", readBack], ["the page painted next", painted]]) {
    found.sort((a, b) => a - b);
    const at = (fraction) => found[Math.min(found.length - 1, Math.floor(fraction * found.length))]?.toFixed(1);
    console.log(`${since} to ${what}: p50 ${at(0.5)} ms, p95 ${at(0.95)} ms, p99 ${at(0.99)} ms of ${found.length} (${(found.length / Number(seconds)).toFixed(1)} a second)`);
  }
} finally {
  await browser.close();
  await server.stop();
  rmSync(scratch, { recursive: true });
}
