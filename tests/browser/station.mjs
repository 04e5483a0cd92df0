// The actions of each role on a live base station, from log-in to the graded session: node station.mjs
// PROGRAM SOURCES FOLDER
// PROGRAM: the built parhelion. Pictures are stored in FOLDER. The steps are in station/.
import assert from "node:assert/strict";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { listen, readTwist } from "./lcm.mjs";
import { hold, logIn, openBrowser, person, run, stepsOf, url, writeScenario } from "./base_station.mjs";
import { accounts } from "./station/accounts.mjs";
import { end } from "./station/end.mjs";
import { everyone } from "./station/everyone.mjs";
import { instructor as instructs } from "./station/instructor.mjs";
import { observer as observes } from "./station/observer.mjs";
import { trainee as drives } from "./station/trainee.mjs";

const [program, sources, folder] = process.argv.slice(2);
const scratch = mkdtempSync(join(tmpdir(), "parhelion-"));
const password = "a long enough word";
const pages = {};
const { step, picture } = stepsOf(pages, folder);

const server = run(program, ["serve", writeScenario(scratch, sources), "-o", join(scratch, "session.lcm"), "--url", url, "--no-restart",
  "--http", "127.0.0.1:0", "--state-folder", join(scratch, "site")], join(scratch, "serve.txt"));
const commands = [];
const stopListening = await listen(url, "MR_CMD", (payload) => commands.push(readTwist(payload)));
const browser = await openBrowser();
try {
  const link = (await server.printed(/(https?:\/\/\S+\/setup\?token=\S+)/))[1];
  const address = new URL(link).origin;
  const [admin, trainee, instructor, observer] = await Promise.all([0, 1, 2, 3].map(() => person(browser, address)));
  const roles = Object.assign(pages, { trainee, instructor, observer });
  // The trainee's connection: while `hangs`, messages of the server (video) and of the page (teleop) are held
  // back in order.
  const line = { hangs: false, kept: [] };
  const through = (send) => (message) => (line.hangs ? line.kept.push(() => send(message)) : send(message));
  await trainee.page.routeWebSocket(/\/ws\/video/, (socket) => {
    const server = socket.connectToServer();
    server.onMessage(through((message) => socket.send(message)));
  });
  await trainee.page.routeWebSocket(/\/ws\/teleop/, (socket) => {
    const server = socket.connectToServer();
    socket.onMessage(through((message) => server.send(message)));
  });

  const ahead = () => commands.at(-1)?.vx > 0.2;
  const driveOn = (page) => hold("MR_CMD by the key", () => page.keyboard.down("w"), () => page.keyboard.up("w"), ahead);
  /** By keyboard alone, to the role's own layout. Each page is opened when needed, because three pages are much for
   * two cores. */
  const arrive = async (role, name) => {
    await logIn(roles[role], name, password);
    assert.match(new URL(roles[role].page.url()).hash, new RegExp(`^#${role}/`));
  };
  const at = { step, picture, program, scratch, folder, browser, server, pages, roles, ...roles, admin, address, link, password, commands, line, ahead, driveOn, arrive };
  for (const part of [accounts, drives, instructs, observes, everyone, end]) await part(at);

  await step("nothing went wrong in any page, and none asked another server", async () => {
    for (const [role, { wrong, asked, address }] of Object.entries(roles)) {
      assert.deepEqual(wrong, [], role);
      assert.deepEqual(asked.filter((each) => !each.startsWith(address) && !/^(data|blob):/.test(each)), [], role);
    }
  });
} finally {
  await browser.close();
  stopListening();
  await server.stop();
  rmSync(scratch, { recursive: true });
}
