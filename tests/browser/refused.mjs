// What the page shows when the server refuses what was pressed: the built page with a simulated station that refuses
// everything. node refused.mjs
import assert from "node:assert/strict";
import { launch, openPage } from "./built_page.mjs";

const refusal = "delayed by the connection for more than 2 s", settings = { timeout: 15_000 };
const browser = await launch();
const recorded = { mode: "recorded", controls: { pause: true, rate: true, seek: true, step: true } };

/** A page of its own for each, so that no other notice is mistaken for it. */
async function refused(what, station, press) {
  const page = await openPage(browser, { station: { role: "instructor", refusal, ...station } });
  await press(page);
  await page.getByText(refusal).waitFor(settings);
  console.log(`ok  a refused ${what}`);
  return page;
}
const button = (name) => (page) => page.getByRole("button", { name }).click(settings);

try {
  await refused("pause of a recording", recorded, button("Pause (Space)"));
  await refused("speed of a recording", recorded, button("Faster (up)"));
  await refused("jump to an event", recorded, (page) => page.locator(".events li button").first().click(settings));
  const page = await refused("mark", {}, async (each) => {
    await each.getByRole("textbox", { name: "Note" }).fill("late brake", settings);
    await each.keyboard.press("Enter");
  });
  assert.equal(await page.getByRole("textbox", { name: "Note" }).inputValue(), "late brake", "its text stays");
} finally {
  await browser.close();
}
console.log("ok  refusals are shown");
