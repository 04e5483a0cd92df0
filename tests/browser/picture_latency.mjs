// From the server's stamp as it sends a coded picture to reading it back out of the trainee's page: node picture_latency.mjs PROGRAM SOURCES
// [SECONDS]. One machine, one clock.
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { logIn, openBrowser, person, run, url, writeLesson } from "./base_station.mjs";

const [program, sources, seconds = "20"] = process.argv.slice(2);
const scratch = mkdtempSync(join(tmpdir(), "parhelion-")), password = "a long enough word";
const server = run(program, ["serve", writeLesson(scratch, sources), "-o", join(scratch, "session.lcm"), "--url", url, "--no-restart",
  "--http", "127.0.0.1:0", "--state-folder", join(scratch, "site")], join(scratch, "serve.txt"));
const browser = await openBrowser();

/** Runs in the page: how long after it was sent each picture of the video had been read back, ms. */
function watch() {
  globalThis.readBack = [];
  const sent = new Map();
  const handler = Object.getOwnPropertyDescriptor(WebSocket.prototype, "onmessage");
  Object.defineProperty(WebSocket.prototype, "onmessage", {
    set(heard) {
      handler.set.call(this, (event) => {
        if (event.data instanceof ArrayBuffer && this.url.includes("/ws/video")) {
          const view = new DataView(event.data);
          sent.set(view.getUint32(4, true), Number(view.getBigInt64(16, true)) / 1000);
        }
        heard.call(this, event);
      });
    },
  });
  const draw = CanvasRenderingContext2D.prototype.drawImage;
  CanvasRenderingContext2D.prototype.drawImage = function (picture, ...place) {
    draw.call(this, picture, ...place);
    if (!(picture instanceof VideoFrame)) return;
    this.getImageData(this.canvas.width >> 1, this.canvas.height >> 1, 1, 1);
    globalThis.readBack.push(performance.timeOrigin + performance.now() - sent.get(picture.timestamp));
  };
}

try {
  const link = (await server.said(/(https?:\/\/\S+\/setup\?token=\S+)/))[1], address = new URL(link).origin;
  const { context, page } = await person(browser, address);
  const post = (path, data) => page.request.post(`${address}/api/v1/${path}`, { data, headers: { origin: address } });
  await post("setup", { token: new URL(link).searchParams.get("token"), name: "ada", password });
  await post("accounts", { name: "tess", role: "trainee", password });
  await context.clearCookies();
  await page.addInitScript(watch);
  await logIn({ page, address }, "tess", password);
  await page.locator("[data-age]").waitFor();
  await page.evaluate(() => { globalThis.readBack.length = 0; });
  await page.waitForTimeout(Number(seconds) * 1000);
  const found = (await page.evaluate(() => globalThis.readBack)).sort((a, b) => a - b);
  const at = (share) => found[Math.min(found.length - 1, Math.floor(share * found.length))]?.toFixed(1);
  console.log(`sent to read back in the page: p50 ${at(0.5)} ms, p95 ${at(0.95)} ms, p99 ${at(0.99)} ms of ${found.length}`);
} finally {
  await browser.close();
  await server.stop();
  rmSync(scratch, { recursive: true });
}
