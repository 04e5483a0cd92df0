// The pictures of the page in README.md: node pictures.mjs PROGRAM SOURCES FOLDER (server/hmi/web/pictures). It asserts nothing.
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { logIn, openBrowser, person, run, until, url } from "./base_station.mjs";

const [program, sources, folder] = process.argv.slice(2);
const scratch = mkdtempSync(join(tmpdir(), "parhelion-")), password = "a long enough word";
const server = run(program, ["serve", join(sources, "server/scenarios/programmes/busy_hall.yaml"), "-o", join(scratch, "session.lcm"), "--url", url, "--no-restart",
  "--http", "127.0.0.1:0", "--state-folder", join(scratch, "site")], join(scratch, "serve.txt"));
const browser = await openBrowser();
const picture = (page, name) => page.screenshot({ path: join(folder, `${name}.jpg`), type: "jpeg", quality: 82 });
const settled = (page) => until("video", async () => (await page.locator("[data-age]").count()) > 0).then(() => page.waitForTimeout(1500));

async function come(address, name, theme, hash) {
  const one = await person(browser, address);
  await one.page.addInitScript(`localStorage.setItem("parhelion.theme", "${theme}")`);
  await logIn(one, name, password, hash);
  return one.page;
}

try {
  const link = (await server.said(/(https?:\/\/\S+\/setup\?token=\S+)/))[1], address = new URL(link).origin;
  const admin = (await person(browser, address)).page;
  const post = (path, data) => admin.request.post(`${address}/api/v1/${path}`, { data, headers: { origin: address } });
  await post("setup", { token: new URL(link).searchParams.get("token"), name: "ada", password });
  for (const [name, role] of [["tess", "trainee"], ["ines", "instructor"], ["otto", "observer"]]) await post("accounts", { name, role, password });

  const instructor = await come(address, "ines", "dark", "#instructor/direct");
  const trainee = await come(address, "tess", "light", "#trainee/drive");
  await trainee.getByText("Dead-man released").waitFor();
  await settled(trainee);
  await trainee.keyboard.down("w");
  await trainee.waitForTimeout(2500);
  await picture(trainee, "trainee");
  await trainee.keyboard.up("w");

  const plan = await instructor.getByRole("application").boundingBox();
  await instructor.getByRole("button", { name: "Barrel" }).click();
  await instructor.mouse.click(plan.x + plan.width * 0.3, plan.y + plan.height * 0.68);
  await instructor.getByRole("button", { name: "Person", exact: true }).click();
  await instructor.mouse.move(plan.x + plan.width * 0.4, plan.y + plan.height * 0.4);
  await instructor.mouse.down();
  await instructor.mouse.move(plan.x + plan.width * 0.46, plan.y + plan.height * 0.36, { steps: 3 });
  await settled(instructor);
  await picture(instructor, "instructor");
  await instructor.mouse.up();
  await instructor.keyboard.press("Escape");
  await instructor.close();

  const observer = await come(address, "otto", "light", "#observer/watch");
  await settled(observer);
  await picture(observer, "observer");
  await observer.close();

  const scene = await come(address, "ines", "dark", "#instructor/scene");
  await settled(scene);
  await picture(scene, "scene");
} finally {
  await browser.close();
  await server.stop();
  rmSync(scratch, { recursive: true });
}
