// Every role in every layout and theme of a live base station: axe, and one round with Tab; the 3D view's colours.
// node every_layout.mjs PROGRAM SOURCES FOLDER [--pictures]
// With --pictures one of each is stored in FOLDER, on a laptop's screen and a tablet's.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { logIn, noViolation, openBrowser, person, run, url, writeScenario } from "./base_station.mjs";
import { walkByKeys } from "./walk.mjs";

const [program, sources, folder, pictures] = process.argv.slice(2);
const scratch = mkdtempSync(join(tmpdir(), "parhelion-")), password = "a long enough word";
const server = run(program, ["serve", writeScenario(scratch, sources), "-o", join(scratch, "session.lcm"), "--url", url, "--no-restart",
  "--http", "127.0.0.1:0", "--state-folder", join(scratch, "site")], join(scratch, "serve.txt"));
const browser = await openBrowser();
const screens = { laptop: { width: 1366, height: 768 }, tablet: { width: 1024, height: 768 }, upright: { width: 768, height: 1024 } };
let wrong = 0;
const themes = ["light", "dark", "contrast"];
const attempt = async (what, look) => look().catch((error) => { ++wrong; console.log(`${what}: ${error.message}`); });

const chooseTheme = async (page, theme) => {
  await page.locator("header summary").click();
  await page.getByRole("combobox", { name: "Theme" }).selectOption(theme);
  await page.keyboard.press("Escape");
};
/** The ground of the 3D view has the theme's colour; its keys are listed. */
async function lookAtThreeDimensions(page) {
  await page.getByRole("button", { name: "3D", exact: true }).click();
  await page.getByRole("application", { name: "Site, robots and scans in three dimensions" }).waitFor();
  for (const theme of themes) {
    await page.keyboard.press("t");
    await page.locator(`html[data-theme="${theme}"]`).waitFor();
    const [drawn, named] = await page.evaluate(() => {
      const [{ stage }] = [...document.querySelectorAll(".ground")].filter((each) => each.stage), named = new stage.scene.background.constructor();
      return [stage.scene.background, named.set(getComputedStyle(document.documentElement).getPropertyValue("--ground").trim())].map((each) => each.getHexString());
    });
    assert.equal(drawn, named, `ground of the 3D view, ${theme}`);
  }
  await page.keyboard.press("t");  // the system's theme
  await page.keyboard.press("?");
  await page.getByRole("dialog", { name: "Keyboard shortcuts" }).waitFor();
  await noViolation(page, "3D, keys");
  await page.keyboard.press("Escape");
  await page.getByRole("dialog", { name: "Keyboard shortcuts" }).waitFor({ state: "detached" });
  await page.screenshot({ path: join(folder, "scene.png") });
}

try {
  const link = (await server.printed(/(https?:\/\/\S+\/setup\?token=\S+)/))[1], address = new URL(link).origin;
  const { context, page: admin } = await person(browser, address);
  const post = (path, data) => admin.request.post(`${address}/api/v1/${path}`, { data, headers: { origin: address } });
  await post("setup", { token: new URL(link).searchParams.get("token"), name: "ada", password });
  for (const role of ["trainee", "instructor", "observer"]) await post("accounts", { name: `a_${role}`, role, password });
  await context.close();
  for (const role of ["trainee", "instructor", "observer"]) {
    const one = await person(browser, address), { page } = one;
    await logIn(one, `a_${role}`, password);
    if (role === "observer") await attempt("observer", () => lookAtThreeDimensions(page));
    const layouts = await page.locator("nav button").allTextContents();
    for (const layout of layouts) {
      await page.locator("nav button", { hasText: new RegExp(`^${layout}$`) }).click();
      await page.locator("[data-age]").first().waitFor();
      const walked = await walkByKeys(page, `${role}, ${layout}`).catch((error) => { ++wrong; console.log(error.message); return []; });
      for (const theme of themes) {
        await chooseTheme(page, theme);
        // Of the other themes only the colours differ.
        await attempt(`${role}, ${layout}`, () => noViolation(page, theme, ...(theme === "light" ? [] : ["color-contrast"])));
      }
      for (const [screen, size] of pictures ? Object.entries(screens) : []) {
        await page.setViewportSize(size);
        await page.waitForTimeout(800);
        await page.screenshot({ path: join(folder, `${role}-${layout}-${screen}.png`) });
      }
      await page.setViewportSize(screens.laptop);
      console.log(`${role}, ${layout}: ${walked.length} stops of Tab`);
    }
    for (const each of one.wrong) { ++wrong; console.log(`${role}: ${each}`); }
    await one.context.close();
  }
} finally {
  await browser.close();
  await server.stop();
  rmSync(scratch, { recursive: true });
}
console.log(wrong ? `${wrong} wrong` : "ok  nothing went wrong in any page");
process.exitCode = wrong ? 1 : 0;
