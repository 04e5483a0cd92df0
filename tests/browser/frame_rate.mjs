// Frame rate of the page with a crowd, with software rendering: node frame_rate.mjs [AGENTS] [SECONDS]
// The 3D view rotates all the time, so that each refresh of the screen needs a new frame.
import { launch, openPage } from "./built_page.mjs";

const agents = Number(process.argv[2] ?? 1000), seconds = Number(process.argv[3] ?? 10);
const browser = await launch();
try {
  for (const [what, hash] of [["3D view, plan and events (layout scene)", "#instructor/scene"], ["plan alone (layout plan)", "#trainee/plan"]]) {
    const page = await openPage(browser, { station: { agents, rooms: 6, role: hash.slice(1).split("/")[0] }, hash });
    await page.waitForTimeout(4000);
    const result = await page.evaluate(async (s) => {
      const stage = [...document.querySelectorAll(".ground")].map((each) => each.stage).find(Boolean);
      const times = [];
      let on = true, last = performance.now();
      const up = stage?.camera.up, offset = stage && stage.camera.position.clone().sub(stage.controls.target);
      const tick = (now) => {
        times.push(now - last);
        last = now;
        if (stage) {
          stage.camera.position.copy(stage.controls.target).add(offset.applyAxisAngle(up, 0.004));
          stage.controls.update();
        }
        if (on) requestAnimationFrame(tick);
      };
      requestAnimationFrame(tick);
      const drawn = stage?.drawn ?? 0, from = performance.now();
      await new Promise((done) => setTimeout(done, s * 1000));
      on = false;
      const took = (performance.now() - from) / 1000;
      times.sort((a, b) => a - b);
      return { screen: times.length / took, scene: stage ? (stage.drawn - drawn) / took : null, p50: times[times.length >> 1], p95: times[Math.floor(times.length * 0.95)], pixels: stage ? stage.renderer.getPixelRatio() : null, calls: stage?.renderer.info.render.calls, triangles: stage?.renderer.info.render.triangles };
    }, seconds);
    console.log(`${what}, ${agents} agents: ${result.screen.toFixed(1)} screen refreshes a second (p50 ${result.p50.toFixed(1)} ms, p95 ${result.p95.toFixed(1)} ms)`
      + (result.scene === null ? "" : `, 3D ${result.scene.toFixed(1)} pictures a second at ${result.pixels.toFixed(2)} of full resolution, ${result.calls} draw calls, ${result.triangles} triangles`));
    await page.context().close();
  }
} finally {
  await browser.close();
}
