// A trainee drives: keys, game pad, stick, a stalled connection, the emergency stop.
import assert from "node:assert/strict";
import { hold, noViolation, until } from "../base_station.mjs";

export async function trainee({ step, picture, address, commands, line, trainee, instructor, ahead, driveOn, arrive }) {
  await step("the trainee logs in by keys alone", async () => {
    await trainee.page.goto(address);
    await noViolation(trainee.page, "log-in");
    await arrive("trainee", "tess");
  });

  await step("the trainee sees what the robot sees, and how old it is", async () => {
    const age = trainee.page.locator("[data-age]");
    await age.waitFor();
    // Unknown at first: the page has to measure the server's clock.
    await until("a picture younger than a second", async () => /^\d{1,3} ms$/.test(await age.textContent()));
    await trainee.page.getByText("STALE", { exact: true }).waitFor({ state: "detached" });
  });

  await step("a held key drives the robot; letting go, or losing the page, stops it", async () => {
    const { page } = trainee;
    await page.getByText("Dead-man released").waitFor();
    await driveOn(page);
    await page.getByText("Dead-man pressed").waitFor();
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
    await page.getByText("Gamepad: hold the left shoulder").waitFor();
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

  await step("Space brakes, and neither it nor Escape is the emergency stop", async () => {
    const { page } = trainee;
    await driveOn(page);
    await page.keyboard.press("Space");
    await until("it stands", () => commands.at(-1)?.vx === 0);
    await page.keyboard.press("Escape");
    await page.keyboard.press("Escape");
    commands.length = 0;
    await page.keyboard.up("w");
    await driveOn(page);
    await page.keyboard.up("w");
    assert.equal(await page.getByText("Stopped by").count(), 0);
  });

  await step("the emergency stop holds until the instructor releases it", async () => {
    await arrive("instructor", "ines");
    const { page } = trainee;
    await driveOn(page);
    await page.keyboard.press("x");
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
}
