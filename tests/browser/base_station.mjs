// A base station as a separate process, and users who open its page in Chromium.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { createWriteStream, writeFileSync } from "node:fs";
import { join } from "node:path";
import axe from "axe-core";
import { chromium } from "playwright-core";

/** Timeout that also suffices on a busy machine. */
const PATIENCE_MS = 60_000;
/** A separate multicast group, so that parallel runs do not interfere. */
export const url = `udpm://239.255.76.67:${20_000 + (process.pid % 20_000)}?ttl=0`;

/** Runs the program until stop(), or to its end: `ended` resolves to its exit status. `printed(pattern)` resolves to
 * the match once its output contains it, and rejects when it has ended. */
export function run(program, options, log) {
  const child = spawn(program, options, { stdio: ["ignore", "pipe", "pipe"] });
  const file = createWriteStream(log);
  let output = "", ended = null, waiting = [];
  const look = () => {
    for (const each of waiting) {
      const match = each.pattern.exec(output);
      if (match) each.resolve(match);
      else if (ended !== null) each.reject(new Error(`it ended (${ended}) and never said ${each.pattern}:\n${output.slice(-2000)}`));
      else continue;
      waiting = waiting.filter((other) => other !== each);
    }
  };
  for (const stream of [child.stdout, child.stderr]) stream.on("data", (bytes) => { file.write(bytes); output += bytes; look(); });
  const exit = new Promise((resolve) => child.on("exit", (code, signal) => { ended = code ?? signal; look(); resolve(ended); }));
  return {
    ended: exit,
    printed: (pattern) => new Promise((resolve, reject) => { waiting.push({ pattern, resolve, reject }); look(); }),
    async stop() {
      if (ended === null) child.kill("SIGINT");
      return exit;
    },
  };
}

/** A scenario with one short driving task; the folder's scenario.yaml. */
export function writeScenario(folder, sources) {
  const path = join(folder, "scenario.yaml");
  writeFileSync(path, `name: first steps
level: 1
seed: 1
model: ${sources}/server/scenarios/workshop_model.yaml
trainee: {model: rover, pose: {x: 4 m, y: 2.5 m, yaw: 0 deg}}
agents:
  - {name: crate_1, kind: box, size: [0.3 m, 0.3 m, 0.3 m], pose: {x: 9 m, y: 1 m}}
zones:
  - {name: gate, box: {center: [5 m, 2.5 m], size: [0.6 m, 3 m]}, top: 2 m}
scripts:
  - name: visitor
    when: {time: 1000 s}
    do: [{spawn: {name: visitor_1, kind: person, pose: {x: 2 m, y: 4 m}}}]
training:
  text: Drive a metre ahead, into the gate.
  limit: 10 min
  pass_mark: 0.5
  tasks: [{name: to the gate, points: 10, required: true, done: {reach: gate}}]
  penalties: [{name: collision, points: 1, when: {event: contact_started}}]
`);
  return path;
}

export async function openBrowser() {
  return chromium.launch({ executablePath: process.env.CHROMIUM || "/usr/bin/chromium", args: ["--no-sandbox", "--disable-gpu"] });
}

/** One user: a separate browser, and the errors in it. */
export async function person(browser, address, viewport = { width: 1366, height: 768 }) {
  // Disables colour transitions, since a fading colour has a wrong contrast.
  const context = await browser.newContext({ viewport, ignoreHTTPSErrors: true, reducedMotion: "reduce" });
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE_MS);
  const wrong = [];
  page.on("pageerror", (error) => wrong.push(error.message));
  page.on("console", (message) => { if (message.type() === "error" && !message.text().startsWith("Failed to load resource")) wrong.push(message.text()); });
  const asked = [];
  page.on("request", (request) => asked.push(request.url()));
  return { context, page, wrong, asked, address };
}

/** By keyboard alone: the name field has the focus at first. */
export async function logIn({ page, address }, name, password, hash = "") {
  await page.goto(`${address}/${hash}`);
  await page.getByRole("heading", { name: "Log in" }).waitFor();
  await page.keyboard.type(name);
  await page.keyboard.press("Tab");
  await page.keyboard.type(password);
  await page.keyboard.press("Enter");
  await page.locator("main#panels").waitFor();
}

/** Presses until `look` returns true, and keeps holding. A busy machine may delay the page by 2 s: the robot is then
 * released, and the key must be pressed again. */
export async function hold(what, press, release, look) {
  for (let tries = 0; tries < 20; ++tries) {
    await press();
    if (await until(what, look, 2000).catch(() => false)) return;
    await release();
  }
  assert.fail(`never: ${what}`);
}

/** Holds W until `done`. A busy machine may release the robot: the key is then pressed again. */
export async function driveUntil(page, done) {
  await until("driven there", async () => {
    await page.keyboard.down("w");
    await page.getByText("Dead-man pressed").waitFor({ timeout: 2000 }).then(() => done.waitFor({ timeout: 4000 })).catch(() => {});
    if (await done.count()) return true;
    return page.keyboard.up("w").then(() => false);
  });
  await page.keyboard.up("w");
}

/** `rules`: axe rules to check; none: all. */
export async function noViolation(page, what, ...rules) {
  if (!(await page.evaluate(() => "axe" in globalThis))) await page.evaluate(axe.source);
  const found = await page.evaluate((only) => globalThis.axe.run(document, { ...(only.length ? { runOnly: only } : {}), resultTypes: ["violations"] }), rules);
  assert.deepEqual(found.violations.map((each) => `${what}: ${each.id}: ${each.nodes.map((node) => `${node.target} ${node.any[0]?.message ?? ""}`).join(" | ")}`), []);
}

/** Steps of a test with several users' pages, printed as they are done; if one fails, a picture of each page is
 * stored in `folder`. */
export function stepsOf(people, folder) {
  const picture = (page, name) => page.screenshot({ path: join(folder, `${name}.png`) });
  const step = async (name, act) => {
    const began = performance.now();
    await act().catch(async (error) => {
      for (const [role, { page }] of Object.entries(people)) await picture(page, `failed-${role}`).catch(() => {});
      throw new Error(`${name}: ${error.message}`, { cause: error });
    });
    console.log(`ok  ${name} (${((performance.now() - began) / 1000).toFixed(1)} s)`);
  };
  return { step, picture };
}

/** Waits until `look` resolves to something true; `what` is for the error message. */
export async function until(what, look, patience = PATIENCE_MS) {
  const last = performance.now() + patience;
  for (;;) {
    const seen = await look();
    if (seen) return seen;
    assert.ok(performance.now() < last, `never: ${what}`);
    await new Promise((again) => setTimeout(again, 50));
  }
}
