// Each role's page in a session that is under way: usable by keyboard alone, and no violations found by axe.
import { noViolation } from "../base_station.mjs";
import { walkByKeys } from "../walk.mjs";

export async function everyone({ step, picture, roles }) {
  await step("Tab comes by everything that can be pressed, and one sees where it is", async () => {
    for (const role of ["trainee", "instructor"]) await walkByKeys(roles[role].page, role);
  });

  await step("axe finds nothing in any role's layout in any theme", async () => {
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
  });
}
