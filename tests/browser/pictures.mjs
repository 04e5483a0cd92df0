// The pictures of the page in README.md: node pictures.mjs PROGRAM SOURCES FOLDER (server/hmi/web/pictures). It asserts nothing.
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { driveUntil, logIn, openBrowser, person, run, until, url } from "./base_station.mjs";

const [program, sources, folder] = process.argv.slice(2);
const scratch = mkdtempSync(join(tmpdir(), "parhelion-")), password = "a long enough word";
const browser = await openBrowser();
const picture = (page, name) => page.screenshot({ path: join(folder, `${name}.jpg`), type: "jpeg", quality: 82 });
const settled = (page) => until("video", async () => (await page.locator("[data-age]").count()) > 0).then(() => page.waitForTimeout(1500));

async function open(address, theme, to) {
  const one = await person(browser, address);
  await one.page.addInitScript(`localStorage.setItem("parhelion.theme", "${theme}"); localStorage.setItem("parhelion.hints", "trainee,instructor,observer");`);
  await to(one);
  await one.page.locator("main#panels").waitFor();
  return one.page;
}

/** A simulated robot among people. */
async function busyHall() {
  const server = run(program, ["serve", join(sources, "server/scenarios/programmes/busy_hall.yaml"), "-o", join(scratch, "session.lcm"), "--url", url, "--no-restart",
    "--http", "127.0.0.1:0", "--state-folder", join(scratch, "site")], join(scratch, "serve.txt"));
  const link = (await server.said(/(https?:\/\/\S+\/setup\?token=\S+)/))[1], address = new URL(link).origin;
  const admin = (await person(browser, address)).page;
  const post = (path, data) => admin.request.post(`${address}/api/v1/${path}`, { data, headers: { origin: address } });
  await post("setup", { token: new URL(link).searchParams.get("token"), name: "ada", password });
  for (const [name, role] of [["tess", "trainee"], ["ines", "instructor"]]) await post("accounts", { name, role, password });

  const trainee = await open(address, "light", (one) => logIn(one, "tess", password, "#trainee/drive"));
  await trainee.getByText("Dead-man released").waitFor();
  await settled(trainee);
  await trainee.keyboard.down("w");
  await trainee.waitForTimeout(2500);
  await picture(trainee, "trainee");
  await trainee.keyboard.up("w");

  const scene = await open(address, "dark", (one) => logIn(one, "ines", password, "#instructor/scene"));
  await settled(scene);
  await picture(scene, "scene");
  await server.stop();
}

/** The demo, from the instructor's first press to the result that everybody reads. */
async function demo() {
  const server = run(program, ["demo", "--silent", "--folder", join(scratch, "demo")], join(scratch, "demo.txt"));
  const link = async (who) => (await server.said(new RegExp(`^${who} +(https?://\\S+)`, "m")))[1];
  const links = { instructor: await link("open this"), trainee: await link("trainee"), observer: await link("observer") };
  const enter = (role, theme) => open(new URL(links[role]).origin, theme, ({ page }) => page.goto(links[role]));
  const instructor = await enter("instructor", "dark");
  await until("the robot", async () => (await instructor.getByText("place known").count()) > 0);
  const plan = await instructor.getByRole("application").boundingBox();
  const press = async (kind, x, y) => {
    await instructor.getByRole("button", { name: kind, exact: true }).click();
    await instructor.mouse.click(plan.x + plan.width * x, plan.y + plan.height * y);
  };
  await press("Barrel", 0.72, 0.34);
  await press("Person", 0.68, 0.43);
  await instructor.mouse.move(plan.x + plan.width * 0.69, plan.y + plan.height * 0.5);
  await instructor.mouse.down();
  await instructor.mouse.move(plan.x + plan.width * 0.65, plan.y + plan.height * 0.48, { steps: 3 });
  await instructor.waitForTimeout(700);
  await picture(instructor, "instructor");
  await instructor.mouse.up();
  await instructor.keyboard.press("Escape");

  const trainee = await enter("trainee", "light");
  await trainee.getByText("Dead-man released").waitFor();
  await driveUntil(trainee, trainee.locator(".score li.done").first());
  const observer = await enter("observer", "light");
  await settled(observer);
  await until("it stands", async () => (await trainee.locator(".score li.done").count()) === 2);
  await instructor.getByRole("button", { name: "End and grade" }).click();
  await instructor.getByRole("button", { name: "Press again to end" }).click();
  await observer.getByText("The session has ended.").waitFor();
  await picture(observer, "observer");
  await server.stop();
}

try {
  await demo();
  await busyHall();
} finally {
  await browser.close();
  rmSync(scratch, { recursive: true });
}
