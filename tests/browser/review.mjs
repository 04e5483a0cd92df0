// Opens a page of `parhelion report` in Chromium like a reader: node review.mjs ONE.html TWO.html FOLDER
// ONE: a session whose names try to inject script. TWO: two sessions. The browser's output is stored in
// FOLDER.
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import axe from "axe-core";
import { chromium } from "playwright-core";

const [one, two, folder] = process.argv.slice(2);
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM || "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu"],
});
const context = await browser.newContext({ viewport: { width: 1366, height: 768 } });
const page = await context.newPage();
const asked = [], wrong = [];
page.on("request", (request) => asked.push(request.url()));
page.on("console", (message) => { if (message.type() === "error") wrong.push(message.text()); });
page.on("pageerror", (error) => wrong.push(error.message));
page.on("dialog", (dialog) => { wrong.push(`dialog: ${dialog.message()}`); void dialog.dismiss(); });

async function step(name, run) {
  await run();
  console.log(`ok  ${name}`);
}
async function open(path, colorScheme) {
  await page.emulateMedia({ media: "screen", colorScheme });
  await page.goto(pathToFileURL(path).href);
}
async function noViolation() {
  await page.evaluate(axe.source);
  const found = await page.evaluate(() => globalThis.axe.run(document));
  assert.deepEqual(found.violations.map((v) => `${v.id}: ${v.nodes.map((n) => n.target).join(" ")}`), []);
}
const robot = () => page.locator(".map .robot").first().getAttribute("transform");
const second = () => page.locator("#second").textContent();

try {
  for (const scheme of ["light", "dark"]) {
    await step(`axe finds nothing, ${scheme}`, async () => {
      await open(one, scheme);
      await noViolation();
      await page.screenshot({ path: join(folder, `${scheme}.png`) });
    });
  }

  await step("what the log calls things is text", async () => {
    assert.equal(await page.evaluate(() => globalThis.ran), undefined);
    assert.match(await page.locator("h1").textContent(), /<script>/);
    assert.match(await page.locator("table.deductions").textContent(), /<img src=x onerror/);
    assert.equal(await page.locator("table.deductions img, table.deductions script").count(), 0);
  });

  await step("a press on a penalty moves the robot, the plots' cursor and the picture", async () => {
    const presses = page.locator("table.deductions button.jump");
    await presses.first().click();
    const before = { robot: await robot(), second: await second(), cursor: await page.locator(".plot .cursor").first().getAttribute("d"), picture: await page.locator(".picture img").getAttribute("src") };
    await presses.last().click();
    assert.notEqual(await robot(), before.robot);
    assert.notEqual(await second(), before.second);
    assert.notEqual(await page.locator(".plot .cursor").first().getAttribute("d"), before.cursor);
    assert.ok(await page.locator(".picture img").getAttribute("src") !== before.picture);
    assert.equal(await second(), await presses.last().textContent());
    assert.equal(await page.locator("table.deductions tr[aria-current=true]").count(), 1);
  });

  await step("the plot of the score ends where the score does", async () => {
    await page.locator("#moment").press("End");
    const shown = await page.locator(".plot", { hasText: "Score" }).locator("output").textContent();
    assert.equal(shown, `${(await page.locator(".sum").textContent()).split("= ")[1]} points`);
  });

  await step("a press on the timeline shows that moment", async () => {
    const before = await second();
    await page.locator("svg.timeline").click({ position: { x: 300, y: 10 } });
    assert.notEqual(await second(), before);
  });

  await step("all of it is reached by the keyboard alone", async () => {
    await open(one, "light");
    const reached = async (selector) => {
      for (let i = 0; i < 60; ++i) {
        await page.keyboard.press("Tab");
        if (await page.evaluate((s) => document.activeElement.matches(s), selector)) return;
      }
      assert.fail(`Tab does not reach ${selector}`);
    };
    await reached("#moment");
    const before = await second();
    await page.keyboard.press("ArrowRight");
    assert.notEqual(await second(), before);
    await reached("table.deductions tr:last-child button.jump");
    const place = await robot();
    await page.keyboard.press("Enter");
    assert.notEqual(await robot(), place);
    await page.keyboard.press("Tab");
    await reached("ol.events button.jump");
  });

  await step("events have the names of the base station's page", async () => {
    const texts = await page.locator("ol.events li").evaluateAll((rows) => rows.map((row) => row.textContent.slice(row.querySelector("button").textContent.length + 1)));
    assert.ok(texts.length > 0);
    for (const text of texts) assert.match(text, /^(?:[^:]*: )?(?:[A-Z][a-z-]+)(?: [a-z]+)*/, text);
  });

  await step("nothing is wider than the window", async () => {
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
  });

  await step("it prints to a few pages of A4, dark on light whatever the screen is", async () => {
    await page.emulateMedia({ media: "print", colorScheme: "dark" });
    assert.equal(await page.evaluate(() => getComputedStyle(document.body).backgroundColor), "rgb(255, 255, 255)");
    assert.ok(!(await page.locator(".control").isVisible()) && !(await page.locator(".picture").isVisible()));
    const pdf = await page.pdf({ preferCSSPageSize: true, printBackground: true });
    writeFileSync(join(folder, "one.pdf"), pdf);
    const pages = pdf.toString("latin1").match(/\/Type\s*\/Page\b/g).length;
    assert.ok(pages >= 2 && pages <= 3, `${pages} pages`);
  });

  await step("two sessions stand beside each other, and move together", async () => {
    await open(two, "light");
    await noViolation();
    await page.screenshot({ path: join(folder, "two.png"), fullPage: true });
    const maps = page.locator("svg.map");
    assert.equal(await maps.count(), 2);
    const [a, b] = [await maps.nth(0).boundingBox(), await maps.nth(1).boundingBox()];
    assert.ok(b.x > a.x + a.width && Math.abs(a.width - b.width) < 2);
    const places = () => page.locator(".map .robot").evaluateAll((all) => all.map((each) => each.getAttribute("transform")));
    const before = await places();
    await page.locator("table.deductions button.jump").last().click();
    const after = await places();
    assert.ok(before.every((place, i) => place !== after[i]));
  });

  await step("no request leaves the page, and nothing went wrong", () => {
    assert.deepEqual(asked.filter((url) => !url.startsWith("file:") && !url.startsWith("data:")), []);
    assert.deepEqual(wrong, []);
  });

  await step("the list of packages holds no addresses, so that any registry serves them", () => {
    const lock = JSON.parse(readFileSync(new URL("package-lock.json", import.meta.url), "utf8"));
    for (const each of Object.values(lock.packages))
      assert.ok(!each.resolved, each.resolved);
  });
} finally {
  await browser.close();
}
