// Completes the task, grades the session, and plays its recording.
import assert from "node:assert/strict";
import { join } from "node:path";
import { noViolation, person, run, until } from "../base_station.mjs";

export async function end({ step, picture, program, scratch, address, browser, server, pages, roles, trainee, instructor, observer, driveOn }) {
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

  await step("the instructor takes all that is virtual away at once", async () => {
    const { page } = instructor, chosen = page.getByRole("combobox", { name: "Select object", exact: true });
    await page.getByRole("button", { name: "Remove all" }).click();
    await page.getByRole("button", { name: "Press again to remove all" }).click();
    for (const name of ["person_1", "barrel_1", "crate_1"]) await chosen.locator("option", { hasText: name }).waitFor({ state: "detached" });
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
    for (const { context } of Object.values(roles)) await context.close();
    await server.stop();
    const player = run(program, ["play", join(scratch, "session.lcm"), "--paused", "--http", "127.0.0.1:0"], join(scratch, "play.txt"));
    const viewer = (pages.viewer = await person(browser, ""));
    const { page } = viewer;
    await page.goto((viewer.address = (await player.printed(/(https?:\/\/\S+\?token=\S+)/))[1]));
    viewer.address = new URL(viewer.address).origin;
    const bar = page.getByRole("slider", { name: "Time in the recording" }), at = async () => Number(await bar.inputValue());
    await bar.waitFor();
    await page.evaluate(() => document.activeElement?.blur());
    const begun = await at();
    await page.keyboard.press("Space");
    await until("it goes on", async () => (await at()) > begun + 0.2);
    await page.keyboard.press("Space");
    await page.getByRole("button", { name: "Play (Space)" }).waitFor();
    await page.keyboard.press("ArrowUp");
    await page.getByText("× 1.1").waitFor();
    // A paused recording shows the picture of its moment, whose age does not increase.
    // A slider writes whole seconds without a decimal, as String() does.
    await bar.fill(String(Math.round(Number(await bar.getAttribute("max")) * 5) / 10));
    await page.locator("[data-age]").filter({ hasText: "paused" }).waitFor();
    await page.evaluate(() => new Promise((older) => setTimeout(older, 1500)));
    assert.equal(await page.getByText("STALE", { exact: true }).count(), 0);
    await picture(page, "paused");
    await page.evaluate(() => document.activeElement?.blur());
    await page.keyboard.press("End");
    await until("the end", async () => (await at()) > Number(await bar.getAttribute("max")) - 1);
    await page.keyboard.press("Home");
    await until("the beginning", async () => (await at()) < 1);
    assert.ok((await page.locator(".marks i").count()) > 0, "events are marked");
    await noViolation(page, "a recording");
    await picture(page, "recording");
    await player.stop();
  });
}
