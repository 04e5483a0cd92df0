// An instructor places, commands, marks, writes and saves.
import assert from "node:assert/strict";
import { existsSync } from "node:fs";
import { join } from "node:path";
import { listen } from "../lcm.mjs";
import { until, url } from "../base_station.mjs";

export async function instructor({ step, picture, scratch, trainee, instructor, observer, arrive }) {
  await step("the instructor puts a person where the plan is pressed, and the observer sees it", async () => {
    await arrive("observer", "otto");
    const { page } = instructor;
    await page.getByRole("button", { name: "Person", exact: true }).click();
    await page.getByText("Place by coordinates").click();
    await page.getByLabel("x (m)").fill("1.5");
    await page.getByLabel("y (m)").fill("1.5");
    await page.getByRole("button", { name: "Place" }).click();
    const chosen = page.getByRole("combobox", { name: "Select object", exact: true });
    await until("it is chosen", async () => (await chosen.inputValue()) === "person_1");
    const plan = await page.getByRole("application").boundingBox();
    await page.getByRole("button", { name: "Barrel" }).click();
    await page.mouse.move(plan.x + plan.width * 0.6, plan.y + plan.height * 0.5);
    await page.mouse.down();
    await page.mouse.move(plan.x + plan.width * 0.6, plan.y + plan.height * 0.42, { steps: 3 });
    await picture(page, "placing");
    await page.mouse.up();
    await chosen.locator("option", { hasText: "barrel_1" }).waitFor({ state: "attached" });
    await page.keyboard.press("Escape");
    const listed = (who) => who.page.getByRole("combobox", { name: "Select", exact: true }).locator("option", { hasText: "person_1" });
    await listed(observer).waitFor({ state: "attached" });
  });

  await step("a patrol without a path is not sent, and the page says what to do", async () => {
    const { page } = instructor;
    const chosen = page.getByRole("region", { name: "Selection" });
    await page.getByRole("combobox", { name: "Select object", exact: true }).selectOption("person_1");
    await chosen.getByLabel("Behaviour").selectOption("Patrol");
    await chosen.getByText("No path yet").waitFor();
    await chosen.getByRole("button", { name: "Apply" }).click();
    await page.getByText(/^Draw a path first/).waitFor();
    assert.equal(await page.getByText(/one waypoint/).count(), 0);
  });

  await step("a paused session is said to be paused, and no image stale", async () => {
    const pages = [instructor.page, trainee.page];
    await instructor.page.getByRole("button", { name: "Pause", exact: true }).click();
    for (const page of pages) {
      await page.getByText("The session is paused.").waitFor();
      await page.locator("header .chip", { hasText: "paused" }).waitFor();
      await until("an old image", async () => Number(await page.locator("[data-age]").first().getAttribute("data-age")) > 1500);
      assert.equal(await page.getByText("STALE", { exact: true }).count(), 0);
    }
    await instructor.page.getByRole("button", { name: "Resume", exact: true }).click();
    for (const page of pages) await page.getByText("The session is paused.").waitFor({ state: "detached" });
  });

  await step("the instructor sets off a script and begins a fault; the observer sees what comes of both", async () => {
    const { page } = instructor;
    await page.getByRole("button", { name: "Start visitor" }).click();
    await observer.page.getByRole("combobox", { name: "Select", exact: true }).locator("option", { hasText: "visitor_1" }).waitFor({ state: "attached" });
    await page.getByRole("combobox", { name: "Faults" }).selectOption("Video dropout");
    await page.getByRole("button", { name: "Start", exact: true }).click();
    const findEvent = (what) => observer.page.locator(".events li", { hasText: what }).first().waitFor();
    await findEvent(/Fault started.*Video dropout/);
    await page.getByRole("button", { name: "End", exact: true }).click();
    await findEvent(/Fault ended.*Video dropout/);
  });

  await step("the instructor gives a way, opens a door, freezes, marks, writes, sees what the trainee sees, and saves what was placed", async () => {
    const { page } = instructor;
    const doorCommands = [], stopListening = await listen(url, "MR_DOOR", (payload) => doorCommands.push(Buffer.from(payload).toString("latin1")));
    const plan = await page.getByRole("application").boundingBox();
    const at = (x, y) => page.mouse.click(plan.x + plan.width * x, plan.y + plan.height * y);
    await page.getByRole("combobox", { name: "Select object", exact: true }).selectOption("person_1");
    const chosen = page.getByRole("region", { name: "Selection" });
    await chosen.getByLabel("Behaviour").selectOption("Patrol");
    await chosen.getByRole("button", { name: "Draw path" }).click();
    for (const [x, y] of [[0.2, 0.45], [0.25, 0.6], [0.25, 0.6]]) await at(x, y);
    await chosen.getByText("2 points").waitFor();
    await chosen.getByRole("button", { name: "Apply" }).click();
    await until("it walks", async () => (await page.getByText(/^person_1 /).textContent()) !== null);
    await page.getByRole("button", { name: "Open door" }).click();
    await at(0.5, 0.5);
    await page.keyboard.press("Escape");
    await until("the door is told", () => doorCommands.some((each) => each.includes("door 1")));
    stopListening();
    for (const name of ["Freeze all", "Unfreeze all"]) await page.getByRole("button", { name, exact: true }).click();
    await page.getByLabel("Note").fill("well done");
    await page.getByRole("button", { name: "Add a mark" }).click();
    await page.getByRole("tab", { name: "Messages" }).click();
    await page.getByLabel("Message", { exact: true }).fill("mind the door");
    await page.keyboard.press("Enter");
    await trainee.page.getByText("ines: mind the door").waitFor();
    await trainee.page.getByRole("tab", { name: "Messages" }).click();
    await trainee.page.getByText("mind the door").waitFor();
    await trainee.page.getByRole("tab", { name: "Events" }).click();
    await page.getByRole("tab", { name: "Events" }).click();
    await page.getByRole("combobox", { name: "Robot" }).selectOption({ label: "Trainee's robot (trainee)" });
    await page.locator("[data-age]").waitFor();
    await page.getByLabel("Scenario name").fill("with_visitors");
    await page.getByRole("button", { name: "Save as scenario" }).click();
    await until("the saved scenario", () => existsSync(join(scratch, "site", "scenarios", "with_visitors.yaml")));
  });
}
