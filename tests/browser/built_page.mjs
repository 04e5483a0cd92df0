// The built page in Chromium with a station simulated in the page (fake_station.js), without a server or a
// port.
import { readFileSync } from "node:fs";
import { extname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

const here = fileURLToPath(new URL(".", import.meta.url));
const dist = join(here, "../../server/station/web/dist");
const types = { ".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml" };

export const launch = () => chromium.launch({
  executablePath: process.env.CHROMIUM || "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--enable-unsafe-swiftshader"],
});

/** A page with `station` as the fake's options; its errors are added to `wrong`. */
export async function openPage(browser, { station = {}, hash = "", theme = "dark", width = 1366, height = 768, wrong = [], scripts = [], ...context } = {}) {
  const page = await (await browser.newContext({ viewport: { width, height }, ...context })).newPage();
  page.on("console", (message) => { if (message.type() === "error") wrong.push(message.text()); });
  page.on("pageerror", (error) => wrong.push(error.message));
  await page.addInitScript(`globalThis.fakeStation = ${JSON.stringify(station)}; localStorage.setItem("parhelion.theme", "${theme}");`);
  await page.addInitScript({ path: join(here, "fake_station.js") });
  for (const path of scripts) await page.addInitScript({ path });
  await page.route("**/*", (route) => {
    const path = new URL(route.request().url()).pathname;
    try {
      return route.fulfill({ body: readFileSync(join(dist, path === "/" || path === "/setup" ? "index.html" : path)), contentType: types[extname(path)] ?? "text/html" });
    } catch {
      return route.fulfill({ status: 404 });
    }
  });
  await page.goto(`https://station.test/${hash}`);
  return page;
}
