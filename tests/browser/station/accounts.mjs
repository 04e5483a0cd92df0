// The first account by the link that is printed once, the others by the administrator.
import assert from "node:assert/strict";
import { noViolation } from "../base_station.mjs";

export async function accounts({ step, picture, address, link, password, admin }) {
  await step("the link that the server prints makes the first account, and works once", async () => {
    const { page } = admin;
    // The form is usable before the server replies: users may type as soon as the page is loaded.
    let answer;
    const asked = new Promise((resolve) => { answer = resolve; });
    await page.route("**/api/v1/me", (route) => asked.then(() => route.continue()));
    await page.goto(link);
    await page.keyboard.type("ada");
    await page.keyboard.press("Tab");
    await page.keyboard.type(password);
    await noViolation(page, "set-up");
    answer();
    await page.keyboard.press("Enter");
    await page.locator("main#panels").waitFor();
    assert.match(page.url(), /\/#admin\//);
    const again = await page.request.post(`${address}/api/v1/setup`, { data: { token: new URL(link).searchParams.get("token"), name: "eve", password }, headers: { origin: address } });
    assert.equal(again.status(), 403);
  });

  await step("the administrator makes the others' accounts and reads in the log who did it", async () => {
    const { page } = admin;
    await page.locator("summary", { hasText: "ada" }).click();
    await page.getByRole("button", { name: "Accounts and log" }).click();
    const dialogue = page.getByRole("dialog", { name: "Accounts and log" });
    for (const [name, role] of [["tess", "Trainee"], ["ines", "Observer"], ["otto", "Observer"], ["eve", "Observer"]]) {
      await dialogue.getByLabel("Name", { exact: true }).fill(name);
      await dialogue.getByLabel("Role", { exact: true }).selectOption(role);
      await dialogue.getByLabel("Password", { exact: true }).fill(password);
      await dialogue.getByRole("button", { name: "Create account" }).click();
      await dialogue.getByRole("rowheader", { name }).waitFor();
    }
    await dialogue.getByLabel("Role of ines").selectOption("Instructor");
    const eve = dialogue.getByRole("row", { name: /^eve/ });
    await eve.getByRole("button", { name: "Delete" }).click();
    await eve.getByRole("button", { name: "Press again to delete eve" }).click();
    await eve.waitFor({ state: "detached" });
    await noViolation(page, "accounts");
    await picture(page, "accounts");
    await dialogue.getByRole("button", { name: "Log", exact: true }).click();
    await dialogue.getByRole("row", { name: /ines/ }).first().waitFor();
    await page.keyboard.press("Escape");
    await dialogue.waitFor({ state: "detached" });
  });

  await step("a password is changed by who has it, and by nobody else", async () => {
    const { page } = admin;
    await page.locator("summary", { hasText: "ada" }).click();
    await page.getByRole("button", { name: "Change my password" }).click();
    const dialogue = page.getByRole("dialog", { name: "Change my password" });
    const change = async (old) => {
      await dialogue.getByLabel("Current password").fill(old);
      await dialogue.getByLabel("New password (at least 8 characters)").fill("another long word");
      await dialogue.getByLabel("New password again").fill("another long word");
      await dialogue.getByRole("button", { name: "Change password" }).click();
    };
    await change("a wrong old word");
    await dialogue.getByRole("alert").filter({ hasText: /\S/ }).waitFor();
    await noViolation(page, "password");
    await change(password);
    await page.getByText("Password changed.").waitFor();
    await admin.context.close();
  });
}
