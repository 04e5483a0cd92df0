// Checks for every page: usable by keyboard alone, and no violations found by axe.
import assert from "node:assert/strict";
import { noViolation } from "../base_station.mjs";
import { walkByKeys } from "../walk.mjs";

export async function everyone({ step, picture, roles, observer }) {
  await step("Tab comes by everything that can be pressed, and one sees where it is", async () => {
    for (const role of ["trainee", "instructor"]) await walkByKeys(roles[role].page, role);
  });

  await step("axe finds nothing in any role's layout in any theme, in three dimensions, and in the list of keys", async () => {
    for (const [role, { page }] of Object.entries(roles)) {
      await page.evaluate(() => document.activeElement?.blur());
      await noViolation(page, role);
      for (const theme of role === "observer" ? [] : ["light", "dark", "contrast"]) {
        await page.keyboard.press("t");
        await page.locator(`html[data-theme="${theme}"]`).waitFor();
        if (theme !== "light") await noViolation(page, `${role}, ${theme}`, "color-contrast");  // the system's theme is light
      }
      if (role !== "observer") await page.keyboard.press("t");  // back to the system's theme
      await picture(page, role);
    }
    const { page } = observer;
    await page.getByRole("button", { name: "3D", exact: true }).click();
    await page.getByRole("application", { name: "Site, robots and scans in three dimensions" }).waitFor();
    for (const theme of ["light", "dark", "contrast"]) {
      await page.keyboard.press("t");
      await page.locator(`html[data-theme="${theme}"]`).waitFor();
      const [drawn, named] = await page.evaluate(() => {
        const [{ stage }] = [...document.querySelectorAll(".ground")].filter((each) => each.stage), named = new stage.scene.background.constructor();
        return [stage.scene.background, named.set(getComputedStyle(document.documentElement).getPropertyValue("--ground").trim())].map((each) => each.getHexString());
      });
      assert.equal(drawn, named, `ground of the 3D view, ${theme}`);
    }
    await page.keyboard.press("t");
    await page.keyboard.press("?");
    await page.getByRole("dialog", { name: "Keyboard shortcuts" }).waitFor();
    await noViolation(page, "3D, keys");
    await page.keyboard.press("Escape");
    await page.getByRole("dialog", { name: "Keyboard shortcuts" }).waitFor({ state: "detached" });
    await picture(page, "scene");
    await page.goBack();
    await page.getByRole("button", { name: "Observer", exact: true, pressed: true }).waitFor();
  });

  await step("axe finds nothing in the other layouts of each role", async () => {
    for (const [role, { page }] of Object.entries(roles)) {
      const layouts = page.getByRole("navigation", { name: "Layout" }).getByRole("button"), [first, ...others] = await layouts.allTextContents();
      for (const layout of [...others, first]) {
        await layouts.getByText(layout, { exact: true }).click();
        await page.locator("[data-age]").first().waitFor();
        if (layout !== first) await noViolation(page, `${role}, ${layout}`);
      }
    }
  });
}
