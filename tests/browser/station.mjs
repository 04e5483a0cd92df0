// What each role does on a live base station, from log-in to the graded session: node station.mjs PROGRAM SOURCES FOLDER
// PROGRAM: the built parhelion. Pictures are left in FOLDER.
import assert from "node:assert/strict";
import { existsSync, mkdtempSync, rmSync, statSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { listen, readTwist } from "./lcm.mjs";
import { logIn, noViolation, openBrowser, person, run, stepsOf, until, url, writeLesson } from "./base_station.mjs";
import { walkByKeys } from "./walk.mjs";

const [program, sources, folder] = process.argv.slice(2);
const scratch = mkdtempSync(join(tmpdir(), "parhelion-"));
const password = "a long enough word";
const pages = {};
const { step, picture } = stepsOf(pages, folder);

const server = run(program, ["serve", writeLesson(scratch, sources), "-o", join(scratch, "session.lcm"), "--url", url, "--no-restart",
  "--http", "127.0.0.1:0", "--state-folder", join(scratch, "site")], join(scratch, "serve.txt"));
const commands = [];
const deaf = await listen(url, "MR_CMD", (payload) => commands.push(readTwist(payload)));
const browser = await openBrowser();
try {
  const link = (await server.said(/(https?:\/\/\S+\/setup\?token=\S+)/))[1];
  const address = new URL(link).origin;
  const [admin, trainee, instructor, observer] = await Promise.all([0, 1, 2, 3].map(() => person(browser, address)));
  const everyone = Object.assign(pages, { trainee, instructor, observer });
  // The trainee's line: `hangs` keeps back what the server sends (video) and what the page says (teleop), in order.
  const line = { hangs: false, kept: [] };
  const through = (send) => (message) => (line.hangs ? line.kept.push(() => send(message)) : send(message));
  await trainee.page.routeWebSocket(/\/ws\/video/, (socket) => {
    const server = socket.connectToServer();
    server.onMessage(through((message) => socket.send(message)));
  });
  await trainee.page.routeWebSocket(/\/ws\/teleop/, (socket) => {
    const server = socket.connectToServer();
    socket.onMessage(through((message) => server.send(message)));
  });

  await step("the link that the server prints makes the first account, and works once", async () => {
    const { page } = admin;
    await page.goto(link);
    await noViolation(page, "set-up");
    await page.keyboard.type("ada");
    await page.keyboard.press("Tab");
    await page.keyboard.type(password);
    await page.keyboard.press("Enter");
    await page.locator("main#panels").waitFor();
    const again = await page.request.post(`${address}/api/v1/setup`, { data: { token: new URL(link).searchParams.get("token"), name: "eve", password }, headers: { origin: address } });
    assert.equal(again.status(), 403);
  });

  await step("the administrator makes the others' accounts and reads in the log who did it", async () => {
    const { page } = admin;
    await page.locator("summary", { hasText: "ada" }).click();
    await page.getByRole("button", { name: "Accounts and log" }).click();
    const dialogue = page.getByRole("dialog", { name: "Accounts and log" });
    for (const [name, role] of [["tess", "Trainee"], ["ines", "Observer"], ["otto", "Observer"], ["eve", "Observer"]]) {
      await dialogue.getByLabel("Name", { exact: true }).fill(name);
      await dialogue.getByLabel("Role", { exact: true }).selectOption(role);
      await dialogue.getByLabel("Password", { exact: true }).fill(password);
      await dialogue.getByRole("button", { name: "Make an account" }).click();
      await dialogue.getByRole("rowheader", { name }).waitFor();
    }
    await dialogue.getByLabel("Role of ines").selectOption("Instructor");
    const eve = dialogue.getByRole("row", { name: /^eve/ });
    await eve.getByRole("button", { name: "Delete" }).click();
    await eve.getByRole("button", { name: "Press again to delete eve" }).click();
    await eve.waitFor({ state: "detached" });
    await noViolation(page, "accounts");
    await picture(page, "accounts");
    await dialogue.getByRole("button", { name: "Log", exact: true }).click();
    await dialogue.getByRole("row", { name: /ines/ }).first().waitFor();
    await page.keyboard.press("Escape");
    await dialogue.waitFor({ state: "detached" });
  });

  await step("a password is changed by who has it, and by nobody else", async () => {
    const { page } = admin;
    await page.locator("summary", { hasText: "ada" }).click();
    await page.getByRole("button", { name: "Change my password" }).click();
    const dialogue = page.getByRole("dialog", { name: "Change my password" });
    const change = async (old) => {
      await dialogue.getByLabel("The password you have now").fill(old);
      await dialogue.getByLabel("The new one, of 8 characters at least").fill("another long word");
      await dialogue.getByLabel("The new one again").fill("another long word");
      await dialogue.getByRole("button", { name: "Change it" }).click();
    };
    await change("a wrong old word");
    await dialogue.getByRole("alert").filter({ hasText: /\S/ }).waitFor();
    await noViolation(page, "password");
    await change(password);
    await page.getByText("Your password is changed.").waitFor();
    await admin.context.close();
  });

  /** A machine that is busy may keep the page from speaking for 2 s: then the robot is let go, and the key must be pressed anew. */
  const hold = async (what, press, release, look) => {
    for (let tries = 0; tries < 20; ++tries) {
      await press();
      if (await until(what, look, 2000).catch(() => false)) return;
      await release();
    }
    assert.fail(`never: ${what}`);
  };
  const ahead = () => commands.at(-1)?.vx > 0.2;
  const driveOn = (page) => hold("MR_CMD by the key", () => page.keyboard.down("w"), () => page.keyboard.up("w"), ahead);
  /** By keys alone, to the role's own layout. Each comes when there is work: three pages are much for two cores. */
  const arrive = async (role, name) => {
    await logIn(everyone[role], name, password);
    assert.match(new URL(everyone[role].page.url()).hash, new RegExp(`^#${role}/`));
  };
  await step("the trainee logs in by keys alone", async () => {
    await trainee.page.goto(address);
    await noViolation(trainee.page, "log-in");
    await arrive("trainee", "tess");
  });

  await step("the trainee sees what the robot sees, and how old it is", async () => {
    const age = trainee.page.locator("[data-age]");
    await age.waitFor();
    await until("a picture younger than a second", async () => Number(await age.getAttribute("data-age")) < 1000);
    assert.match(await age.textContent(), /^\d+ ms$/);
    await trainee.page.getByText("STALE", { exact: true }).waitFor({ state: "detached" });
  });

  await step("a held key drives the robot; letting go, or losing the page, stops it", async () => {
    const { page } = trainee;
    await page.getByText("Dead-man released").waitFor();
    await driveOn(page);
    await page.getByText("Dead-man held").waitFor();
    await page.keyboard.up("w");
    commands.length = 0;
    await until("MR_CMD still", () => commands.at(-1)?.vx === 0);
    await driveOn(page);
    await page.evaluate(() => dispatchEvent(new Event("blur")));
    await until("stopped without the keyboard", () => commands.at(-1)?.vx === 0);
    await page.keyboard.up("w");
  });

  await step("a game pad drives while its shoulder button is held; so does the stick on the screen", async () => {
    const { page } = trainee;
    await page.evaluate(() => {
      const buttons = Array.from({ length: 17 }, () => ({ pressed: false, value: 0 }));
      globalThis.pad = { id: "Pad", index: 0, connected: true, mapping: "standard", axes: [0, -1, 0, 0], buttons };
      navigator.getGamepads = () => [globalThis.pad, null, null, null];
    });
    await page.getByText("Game pad: hold the left shoulder").waitFor();
    const shoulder = (pressed) => page.evaluate((on) => { globalThis.pad.buttons[4].pressed = on; }, pressed);
    await hold("MR_CMD by the pad", () => shoulder(true), () => shoulder(false), ahead);
    await page.evaluate(() => { globalThis.pad.connected = false; });
    await until("stopped as it was unplugged", () => commands.at(-1)?.vx === 0);
    const well = await page.getByRole("img", { name: /^Stick/ }).boundingBox();
    const x = well.x + well.width / 2, y = well.y + well.height / 2;
    const pull = async () => {
      await page.mouse.move(x, y);
      await page.mouse.down();
      await page.mouse.move(x, y + well.height / 2, { steps: 3 });
    };
    await hold("MR_CMD back by the stick", pull, () => page.mouse.up(), () => commands.at(-1)?.vx < -0.2);
    await page.mouse.up();
    await until("stopped as it was let go", () => commands.at(-1)?.vx === 0);
  });

  await step("where the line hangs, STALE stands over the picture, the robot stops, and nothing old is driven later", async () => {
    const { page } = trainee;
    await driveOn(page);
    line.hangs = true;
    await until("stopped by silence", () => commands.at(-1)?.vx === 0);
    await page.getByText("STALE", { exact: true }).waitFor();
    await picture(page, "stale");
    commands.length = 0;
    line.hangs = false;
    for (const send of line.kept.splice(0)) send();
    await page.getByText("STALE", { exact: true }).waitFor({ state: "detached" });
    await until("a while of commands", () => commands.length > 5);
    assert.ok(commands.every((command) => command.vx === 0), "what was asked for before is driven now");
    await page.keyboard.up("w");
    await driveOn(page);
    await page.keyboard.up("w");
  });

  await step("the emergency stop holds until the instructor releases it", async () => {
    await arrive("instructor", "ines");
    const { page } = trainee;
    await driveOn(page);
    await page.keyboard.press("Space");
    await page.getByText("Stopped by tess").waitFor();
    await until("it stands", () => commands.at(-1)?.vx === 0);
    commands.length = 0;
    await page.keyboard.up("w");
    await page.keyboard.down("w");
    await until("a while of commands", () => commands.length > 5);
    assert.ok(commands.every((command) => command.vx === 0));
    await page.keyboard.up("w");
    await instructor.page.getByRole("button", { name: "Release the stop" }).click();
    await page.getByText("Stopped by tess").waitFor({ state: "detached" });
  });

  await step("the instructor puts a person where the plan is pressed, and everybody sees it", async () => {
    await arrive("observer", "otto");
    const { page } = instructor;
    await page.getByRole("button", { name: "Person", exact: true }).click();
    await page.getByText("Place by numbers").click();
    await page.getByLabel("x (m)").fill("1.5");
    await page.getByLabel("y (m)").fill("1.5");
    await page.getByRole("button", { name: "Put there" }).click();
    const chosen = page.getByRole("combobox", { name: "Choose", exact: true });
    await until("it is chosen", async () => (await chosen.inputValue()) === "person_1");
    const plan = await page.getByRole("application").boundingBox();
    await page.getByRole("button", { name: "Barrel" }).click();
    await page.mouse.move(plan.x + plan.width * 0.3, plan.y + plan.height * 0.5);
    await page.mouse.down();
    await page.mouse.move(plan.x + plan.width * 0.3, plan.y + plan.height * 0.4, { steps: 3 });
    await picture(page, "placing");
    await page.mouse.up();
    await page.keyboard.press("Escape");
    const listed = (who) => who.page.getByRole("combobox", { name: "Select", exact: true }).locator("option", { hasText: "person_1" });
    for (const who of [trainee, observer]) await listed(who).waitFor({ state: "attached" });
  });

  await step("the instructor sets off a script and begins a lesson; the trainee sees what comes of both", async () => {
    const { page } = instructor;
    await page.getByRole("button", { name: "Start visitor" }).click();
    await trainee.page.getByRole("combobox", { name: "Select", exact: true }).locator("option", { hasText: "visitor_1" }).waitFor({ state: "attached" });
    await page.getByRole("combobox", { name: "Lessons" }).selectOption("Lost video");
    await page.getByRole("button", { name: "Start", exact: true }).click();
    const said = (what) => trainee.page.locator(".events li", { hasText: what }).first().waitFor();
    await said(/lesson begins.*Lost video/);
    await page.getByRole("button", { name: "End", exact: true }).click();
    await said(/lesson ends.*Lost video/);
  });

  await step("the instructor gives a way, opens a door, freezes, marks, writes, sees what the trainee sees, and saves what was placed", async () => {
    const { page } = instructor;
    const told = [], deaf = await listen(url, "MR_AGENT_CMD", (payload) => told.push(Buffer.from(payload).toString("latin1")));
    const plan = await page.getByRole("application").boundingBox();
    const at = (x, y) => page.mouse.click(plan.x + plan.width * x, plan.y + plan.height * y);
    await page.getByRole("combobox", { name: "Choose", exact: true }).selectOption("person_1");
    const chosen = page.getByRole("region", { name: "Chosen" });
    await chosen.getByLabel("Does").selectOption("patrols a way");
    await chosen.getByRole("button", { name: "Draw its way" }).click();
    for (const [x, y] of [[0.2, 0.45], [0.25, 0.6], [0.25, 0.6]]) await at(x, y);
    await chosen.getByText("2 points").waitFor();
    await chosen.getByRole("button", { name: "Do so" }).click();
    await until("it walks", async () => (await page.getByText(/^person_1 /).textContent()) !== null);
    await page.getByRole("button", { name: "Open door" }).click();
    await at(0.5, 0.5);
    await page.keyboard.press("Escape");
    await until("the door is told", () => told.some((each) => each.includes("door 1")));
    deaf();
    for (const name of ["Freeze all", "Let all go"]) await page.getByRole("button", { name, exact: true }).click();
    await page.getByLabel("What was it?").fill("well done");
    await page.getByRole("button", { name: "Mark this moment" }).click();
    await page.getByRole("tab", { name: "Messages" }).click();
    await page.getByLabel("Message", { exact: true }).fill("mind the door");
    await page.keyboard.press("Enter");
    await trainee.page.getByRole("tab", { name: "Messages" }).click();
    await trainee.page.getByText("mind the door").waitFor();
    await trainee.page.getByRole("tab", { name: "Events" }).click();
    await page.getByRole("tab", { name: "Events" }).click();
    await page.getByRole("combobox", { name: "Robot" }).selectOption({ label: "as the trainee (trainee)" });
    await page.locator("[data-age]").waitFor();
    await page.getByLabel("Name of the scenario").fill("with_visitors");
    await page.getByRole("button", { name: "Save as scenario" }).click();
    await until("the saved scenario", () => existsSync(join(scratch, "site", "scenarios", "with_visitors.yaml")));
  });

  await step("who looks back sees what was, is told so, and comes back to now", async () => {
    const { page } = observer;
    const bar = page.getByRole("slider", { name: "Look back in the session" });
    await bar.focus();
    await page.keyboard.press("Home");
    await page.getByText(/You look back: plan and 3D show 0:/).waitFor();
    await picture(page, "back");
    await page.getByRole("button", { name: "Back to now" }).click();
    await page.getByText(/You look back/).waitFor({ state: "detached" });
  });

  await step("P saves a picture of the page", async () => {
    const { page } = observer;
    const [saved] = await Promise.all([page.waitForEvent("download"), page.keyboard.press("p")]);
    assert.match(saved.suggestedFilename(), /^first steps-\d+\.\ds\.png$/);
    await saved.saveAs(join(folder, "saved.png"));
    assert.ok(statSync(join(folder, "saved.png")).size > 20_000);
  });

  await step("the observer only looks: nothing to press, and the server refuses what is said all the same", async () => {
    const { page } = observer;
    for (const name of [/^Emergency stop/, "Freeze all", "End and grade"]) assert.equal(await page.getByRole("button", { name }).count(), 0);
    const refused = await page.evaluate(() => new Promise((resolve) => {
      const socket = new WebSocket(`${location.origin.replace("http", "ws")}/ws/teleop`);
      socket.onopen = () => resolve("open");
      socket.onerror = () => resolve("refused");
    }));
    assert.equal(refused, "refused");
    const reply = await page.evaluate(() => new Promise((resolve) => {
      const socket = new WebSocket(`${location.origin.replace("http", "ws")}/ws/state`);
      socket.onopen = () => socket.send(JSON.stringify({ type: "agent", action: "remove_all", request: 1 }));
      socket.onmessage = ({ data }) => { if (typeof data === "string" && JSON.parse(data).type === "reply") resolve(JSON.parse(data)); };
    }));
    assert.equal(reply.ok, false);
    observer.wrong.length = 0;  // the browser says that the socket was refused
  });

  await step("Tab comes by everything that can be pressed, and one sees where it is", async () => {
    for (const role of ["trainee", "instructor"]) await walkByKeys(everyone[role].page, role);
  });

  await step("axe finds nothing in any role's layout in any theme, in three dimensions, and in the list of keys", async () => {
    for (const [role, { page }] of Object.entries(everyone)) {
      await page.evaluate(() => document.activeElement?.blur());
      await noViolation(page, role);
      for (const theme of role === "observer" ? [] : ["light", "dark", "contrast"]) {
        await page.keyboard.press("t");
        await page.locator(`html[data-theme="${theme}"]`).waitFor();
        if (theme !== "light") await noViolation(page, `${role}, ${theme}`, "color-contrast");  // the system's is light
      }
      if (role !== "observer") await page.keyboard.press("t");  // as the system again
      await picture(page, role);
    }
    const { page } = observer;
    await page.getByRole("button", { name: "3D", exact: true }).click();
    await page.getByRole("application", { name: "Site, robots and scans in three dimensions" }).waitFor();
    await page.keyboard.press("?");
    await page.getByRole("dialog", { name: "Keys" }).waitFor();
    await noViolation(page, "3D, keys");
    await page.keyboard.press("Escape");
    await page.getByRole("dialog", { name: "Keys" }).waitFor({ state: "detached" });
    await picture(page, "scene");
    await page.getByRole("button", { name: "Watch", exact: true }).click();
  });

  await step("the trainee reaches the gate, and the score says so", async () => {
    const { page } = trainee;
    await page.locator("[data-age]").waitFor();
    await page.getByText("Dead-man released").waitFor();
    await until("the task is done", async () => {
      await driveOn(page);
      return page.locator(".score li.done").waitFor({ timeout: 3000 }).then(() => true, () => page.keyboard.up("w").then(() => false));
    });
    await page.keyboard.up("w");
    await picture(page, "driven");
    await observer.page.locator(".score li.done").waitFor();
  });

  await step("the instructor ends and grades; everybody reads the same result", async () => {
    await instructor.page.getByRole("button", { name: "End and grade" }).click();
    await instructor.page.getByRole("button", { name: "Press again to end" }).click();
    for (const { page } of [trainee, observer]) {
      await page.getByRole("tab", { name: "Briefing" }).click();
      await page.locator(".briefing .result").getByText("10 of 10 points").waitFor();
      await page.locator(".briefing").getByText("passed", { exact: true }).waitFor();
    }
    await until("the report", async () => (await trainee.page.request.get(`${address}/api/v1/report`)).status() === 200);
    await picture(trainee.page, "result");
  });

  await step("its recording plays by the keys of ros2 bag, with a seek bar", async () => {
    for (const { context } of Object.values(everyone)) await context.close();
    await server.stop();
    const player = run(program, ["play", join(scratch, "session.lcm"), "--paused", "--http", "127.0.0.1:0"], join(scratch, "play.txt"));
    const viewer = (pages.viewer = await person(browser, ""));
    const { page } = viewer;
    await page.goto((viewer.address = (await player.said(/(https?:\/\/\S+\?token=\S+)/))[1]));
    viewer.address = new URL(viewer.address).origin;
    const bar = page.getByRole("slider", { name: "Place in the recording" }), at = async () => Number(await bar.inputValue());
    await bar.waitFor();
    await page.evaluate(() => document.activeElement?.blur());
    const begun = await at();
    await page.keyboard.press("Space");
    await until("it goes on", async () => (await at()) > begun + 0.2);
    await page.keyboard.press("Space");
    await page.getByRole("button", { name: "Play (Space)" }).waitFor();
    await page.keyboard.press("ArrowUp");
    await page.getByText("× 1.1").waitFor();
    await page.keyboard.press("End");
    await until("the end", async () => (await at()) > Number(await bar.getAttribute("max")) - 1);
    await page.keyboard.press("Home");
    await until("the beginning", async () => (await at()) < 1);
    assert.ok((await page.locator(".marks i").count()) > 0, "events are marked");
    await noViolation(page, "a recording");
    await picture(page, "recording");
    await player.stop();
  });

  await step("nothing went wrong in any page, and none asked another server", async () => {
    for (const [role, { wrong, asked, address }] of Object.entries(everyone)) {
      assert.deepEqual(wrong, [], role);
      assert.deepEqual(asked.filter((each) => !each.startsWith(address) && !/^(data|blob):/.test(each)), [], role);
    }
  });
} finally {
  await browser.close();
  deaf();
  await server.stop();
  rmSync(scratch, { recursive: true });
}
