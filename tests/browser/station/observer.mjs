// An observer: playback of the session, a screenshot, and no control that changes anything.
import assert from "node:assert/strict";
import { statSync } from "node:fs";
import { join } from "node:path";

export async function observer({ step, picture, folder, observer }) {
  await step("who looks back sees what was, is told so, and comes back to now", async () => {
    const { page } = observer;
    const bar = page.getByRole("slider", { name: "Time in the session" });
    await bar.focus();
    await page.keyboard.press("Home");
    await page.getByText(/Viewing the past: plan and 3D show 0:/).waitFor();
    await picture(page, "back");
    await page.getByRole("button", { name: "Return to live" }).click();
    await page.getByText(/Viewing the past/).waitFor({ state: "detached" });
    await page.locator(".events li button", { hasText: "Fault started" }).first().click();
    await page.getByText(/Viewing the past: plan and 3D show 0:/).waitFor();
    await page.getByRole("button", { name: "Return to live" }).click();
    await page.getByText(/Viewing the past/).waitFor({ state: "detached" });
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
    observer.wrong.length = 0;  // the browser reports the refused socket
  });
}
