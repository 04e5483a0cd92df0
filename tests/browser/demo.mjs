// `parhelion demo` with users who open the printed links: node demo.mjs PROGRAM FOLDER
// PROGRAM: the built parhelion. Pictures are stored in FOLDER.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { driveUntil, noViolation, openBrowser, person, run, stepsOf, until } from "./base_station.mjs";

const [program, folder] = process.argv.slice(2);
const scratch = mkdtempSync(join(tmpdir(), "parhelion-"));
const people = {};
const { step, picture } = stepsOf(people, folder);

const demo = run(program, ["demo", "--silent", "--folder", join(scratch, "demo")], join(scratch, "demo.txt"));
const browser = await openBrowser();
try {
  const link = async (who) => (await demo.printed(new RegExp(`^${who} +(https?://\\S+)`, "m")))[1];
  const links = { instructor: await link("open this"), trainee: await link("trainee"), observer: await link("observer") };
  const address = new URL(links.instructor).origin;
  const arrive = async (role) => {
    people[role] = await person(browser, address);
    await people[role].page.goto(links[role]);
    await people[role].page.locator("main#panels").waitFor();
    assert.match(new URL(people[role].page.url()).hash, new RegExp(`^#${role}/`));
    return people[role].page;
  };

  await step("whoever opens the link is the instructor, and the first thing to press puts a person before the robot", async () => {
    const page = await arrive("instructor");
    const put = page.getByRole("button", { name: "Add a person ahead" });
    await until("the robot is seen", () => put.isEnabled());
    await picture(page, "demo-opened");
    await noViolation(page, "the instructor's first look");
    await put.click();
    await page.getByRole("combobox", { name: "Select object", exact: true }).locator("option", { hasText: "person_1" }).waitFor({ state: "attached" });
    await put.waitFor({ state: "detached" });  // wait until it is confirmed
  });

  await step("a live robot is not paused: neither by the button nor by who asks the server", async () => {
    const { page } = people.instructor;
    const pause = page.getByRole("button", { name: "Pause", exact: true });
    assert.equal(await pause.isDisabled(), true);
    assert.equal(await pause.getAttribute("title"), "A session with a real robot cannot be paused.");
    const reply = await page.evaluate(() => new Promise((resolve) => {
      const socket = new WebSocket(`${location.origin.replace("http", "ws")}/ws/state`);
      let asked = false;
      socket.onmessage = ({ data }) => {
        const message = typeof data === "string" ? JSON.parse(data) : {};
        if (message.type === "reply") resolve(message);
        if (message.type !== "control" || asked) return;
        asked = true;
        socket.send(JSON.stringify({ type: "control", action: "pause", request: 1, seen: message.clock }));
      };
    }));
    assert.equal(reply.ok, false);
    assert.match(reply.text, /a real robot cannot be paused/);
  });

  await step("a thing is dragged from the palette to where it is to stand", async () => {
    const { page } = people.instructor;
    const plan = await page.getByRole("application").boundingBox(), barrel = await page.getByRole("button", { name: "Barrel" }).boundingBox();
    await page.mouse.move(barrel.x + 20, barrel.y + 10);
    await page.mouse.down();
    await page.mouse.move(plan.x + plan.width * 0.4, plan.y + plan.height * 0.3, { steps: 4 });
    await page.mouse.up();
    await page.getByRole("combobox", { name: "Select object", exact: true }).locator("option", { hasText: "barrel_1" }).waitFor({ state: "attached" });
    await page.keyboard.press("Escape");
    await picture(page, "demo-injected");
  });

  await step("the observer sees what was put in, and has nothing to press that changes it", async () => {
    const page = await arrive("observer");
    await page.getByRole("combobox", { name: "Select", exact: true }).locator("option", { hasText: "barrel_1" }).waitFor({ state: "attached" });
    for (const name of [/^Emergency stop/, "Remove all", "End and grade"]) assert.equal(await page.getByRole("button", { name }).count(), 0);
  });

  await step("the trainee has a virtual robot at once, is told what to do with it, and a key drives it into the zone", async () => {
    const page = await arrive("trainee");
    await page.getByText("Dead-man released").waitFor();
    await page.getByText("No camera: rendered by this page").waitFor();
    await picture(page, "demo-trainee");
    await driveUntil(page, page.locator(".score li.done").first());
    await until("it stands", async () => (await page.locator(".score li.done").count()) === 2);
    await picture(page, "demo-driven");
  });

  await step("a second trainee by the same link is another; two pages of one do not take robots from each other for ever", async () => {
    const { context } = people.trainee, second = await person(browser, address);
    await second.page.goto(links.trainee);
    await second.page.locator("summary", { hasText: "trainee_2" }).waitFor();
    await second.context.close();
    const otherPage = await context.newPage(), printed = [];
    otherPage.on("websocket", (socket) => socket.on("framesent", ({ payload }) => printed.push(String(payload))));
    const times = (type) => printed.filter((each) => each.includes(`"type":"${type}"`)).length;
    await otherPage.goto(links.trainee);
    // Of the virtual robots a trainee is offered the one that is for trainees.
    const own = otherPage.locator(".drive button", { hasText: /^robot_/ });
    await own.click();
    await otherPage.locator(".drive button[aria-pressed=true]", { hasText: /^robot_/ }).waitFor();
    const pinged = times("ping"), asked = times("drive");
    await until("a while that both would have fought in", () => times("ping") > pinged + 1);
    assert.ok(times("drive") < asked + 4, `asked ${times("drive") - asked} times more`);  // one or two if a busy machine released control
    await otherPage.close();
  });

  await step("the instructor ends and grades, and everybody reads how it went", async () => {
    const { page } = people.instructor;
    await page.getByRole("button", { name: "End and grade" }).click();
    await page.getByRole("button", { name: "Press again to end" }).click();
    for (const [role, { page }] of Object.entries(people)) {
      const end = page.getByRole("region", { name: "The session has ended." });
      await end.getByText(/^\d+ of 100 points$/).waitFor();
      await end.getByText("passed", { exact: true }).waitFor();
      await picture(page, `demo-ended-${role}`);
    }
    const report = await people.trainee.page.request.get(`${address}/report`);
    assert.equal(report.status(), 200);
  });

  await step("who opens another's link in a second tab is told so in the first, and goes on as that one", async () => {
    const { page, context } = people.trainee, second = await context.newPage();
    await second.goto(links.observer);
    await second.locator("main#panels").waitFor();
    await page.getByRole("alert").getByText(/^Another tab of this browser logged in as observer/).waitFor();
    await page.getByRole("button", { name: /^Continue as observer/ }).click();
    await page.locator(".banner").waitFor({ state: "detached" });
    assert.match(new URL(page.url()).hash, /^#observer\//);
    await page.getByRole("tab", { name: "Status" }).waitFor();
    people.trainee.wrong.length = 0;  // the browser reports refused sockets
  });

  await step("nothing went wrong in any page, and none asked another server", async () => {
    for (const [role, { wrong, asked }] of Object.entries(people)) {
      assert.deepEqual(wrong, [], role);
      assert.deepEqual(asked.filter((each) => !each.startsWith(address) && !/^(data|blob):/.test(each)), [], role);
    }
  });

  await step("^C ends the demo, and it names its pictures", async () => {
    assert.equal(await demo.stop(), 0);
    await demo.printed(/^map +\S+\.png$/m);
  });
} finally {
  await browser.close();
  await demo.stop();
  rmSync(scratch, { recursive: true });
}
