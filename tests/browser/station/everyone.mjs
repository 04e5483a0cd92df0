// Each role's page as it is in a session that is under way: no violations found by axe.
import { noViolation } from "../base_station.mjs";

export async function everyone({ step, picture, roles }) {
  await step("axe finds nothing in any role's page", async () => {
    for (const [role, { page }] of Object.entries(roles)) {
      await page.evaluate(() => document.activeElement?.blur());
      await noViolation(page, role);
      await picture(page, role);
    }
  });
}
