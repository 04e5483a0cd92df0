// Every role in every layout and theme of a live base station: axe, and one round with Tab.
// node every_layout.mjs PROGRAM SOURCES [FOLDER]
// With FOLDER a picture of each is stored, on a laptop's screen and a tablet's.
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { logIn, noViolation, openBrowser, person, run, url, writeScenario } from "./base_station.mjs";
import { walkByKeys } from "./walk.mjs";

const [program, sources, folder] = process.argv.slice(2);
const scratch = mkdtempSync(join(tmpdir(), "parhelion-")), password = "a long enough word";
const server = run(program, ["serve", writeScenario(scratch, sources), "-o", join(scratch, "session.lcm"), "--url", url, "--no-restart",
  "--http", "127.0.0.1:0", "--state-folder", join(scratch, "site")], join(scratch, "serve.txt"));
const browser = await openBrowser();
const screens = { laptop: { width: 1366, height: 768 }, tablet: { width: 1024, height: 768 }, upright: { width: 768, height: 1024 } };
let wrong = 0;
const attempt = async (what, look) => look().catch((error) => { ++wrong; console.log(`${what}: ${error.message}`); });

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
    const layouts = await page.locator("nav button").allTextContents();
    for (const layout of layouts) {
      await page.locator("nav button", { hasText: new RegExp(`^${layout}$`) }).click();
      await page.locator("[data-age]").first().waitFor();
      const walked = await walkByKeys(page, `${role}, ${layout}`).catch((error) => { ++wrong; console.log(error.message); return []; });
      for (const theme of ["light", "dark", "contrast"]) {
        await page.locator("header summary").click();
        await page.getByRole("combobox", { name: "Theme" }).selectOption(theme);
        await page.keyboard.press("Escape");
        await attempt(`${role}, ${layout}`, () => noViolation(page, theme));
      }
      for (const [screen, size] of folder ? Object.entries(screens) : []) {
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
console.log(wrong ? `${wrong} wrong` : "nothing wrong");
process.exitCode = wrong ? 1 : 0;
