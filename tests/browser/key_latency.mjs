// Latency from a key press in Chromium to MR_CMD on LCM: node key_latency.mjs PROGRAM SOURCES [PRESSES]
// The press has the browser's own event stamp; the command is stamped at its arrival here. One machine, one
// clock.
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { listen, readTwist } from "./lcm.mjs";
import { logIn, openBrowser, person, run, until, url, writeScenario } from "./base_station.mjs";

const [program, sources, presses = "300"] = process.argv.slice(2);
const scratch = mkdtempSync(join(tmpdir(), "parhelion-"));
const password = "a long enough word";
const server = run(program, ["serve", writeScenario(scratch, sources), "-o", join(scratch, "session.lcm"), "--url", url, "--no-restart",
  "--http", "127.0.0.1:0", "--state-folder", join(scratch, "site")], join(scratch, "serve.txt"));
const browser = await openBrowser();
const commands = { TELEOP: [], MR_CMD: [] };
const stopListening = await Promise.all(Object.keys(commands).map((channel) => listen(url, channel, (payload, at) => commands[channel].push({ ...readTwist(payload), at }))));
try {
  const link = (await server.printed(/(https?:\/\/\S+\/setup\?token=\S+)/))[1], address = new URL(link).origin;
  const { context, page } = await person(browser, address);
  await page.goto(link);
  await page.keyboard.type("ada");
  await page.keyboard.press("Tab");
  await page.keyboard.type(password);
  await page.keyboard.press("Enter");
  await page.locator("main#panels").waitFor();
  await page.request.post(`${address}/api/v1/accounts`, { data: { name: "tess", role: "trainee", password }, headers: { origin: address } });
  await context.clearCookies();
  await logIn({ page, address }, "tess", password);
  await page.getByText("Dead-man released").waitFor();
  await page.evaluate(() => {
    globalThis.pressed = [];
    addEventListener("keydown", (event) => { if (!event.repeat) globalThis.pressed.push(performance.timeOrigin + event.timeStamp); }, { capture: true });
  });
  const found = { TELEOP: [], MR_CMD: [] };
  for (let i = 0; i < Number(presses); ++i) {
    // Left and right in turn, so that the robot stays in place.
    const key = i % 2 ? "d" : "a";
    for (const list of Object.values(commands)) list.length = 0;
    await page.keyboard.down(key);
    const turns = (channel) => commands[channel].find((each) => (key === "a" ? each.wz > 0 : each.wz < 0));
    await until("MR_CMD turns", () => turns("MR_CMD"));
    const pressed = await page.evaluate(() => globalThis.pressed.at(-1));
    for (const channel of Object.keys(found)) found[channel].push(turns(channel).at - pressed);
    await page.keyboard.up(key);
    await until("MR_CMD stands", () => commands.MR_CMD.at(-1)?.wz === 0);
  }
  for (const [channel, list] of Object.entries(found)) {
    list.sort((a, b) => a - b);
    const at = (fraction) => list[Math.min(list.length - 1, Math.floor(fraction * list.length))].toFixed(2);
    console.log(`key press to ${channel}: p50 ${at(0.5)} ms, p95 ${at(0.95)} ms, p99 ${at(0.99)} ms, worst ${list.at(-1).toFixed(2)} ms of ${list.length}`);
  }
} finally {
  await browser.close();
  stopListening.forEach((stop) => stop());
  await server.stop();
  rmSync(scratch, { recursive: true });
}
