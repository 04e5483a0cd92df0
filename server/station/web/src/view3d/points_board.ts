/** A small plan with the chosen points, so that the wearer finds the next one. */
import { drawModel, siteInk, trace } from "../plan/draw_site";
import { toScreen, type Camera } from "../plan/camera";
import { session } from "../session/session.svelte";
import { site } from "../session/site.svelte";
import { colours } from "../theme/theme.svelte";
import { Board } from "./board";
import { references } from "./references.svelte";

const WIDTH = 660, HEIGHT = 440, MARGIN_M = 2;

export class PointsBoard extends Board {
  #drawn = "";

  constructor() {
    super(0.66, 0.44, [WIDTH, HEIGHT]);
    this.mesh.name = "points";
    this.overAll();
  }

  /** `next`: index of the point to be touched. */
  show(next: number) {
    const { points } = references, wanted = JSON.stringify([next, points]);
    if (this.#drawn === wanted || !points.length) return;
    this.#drawn = wanted;
    const places = points.map((each) => (each.robot ? (session.poseOf(each.robot) ?? each) : each));
    const x0 = Math.min(...places.map((p) => p.x)) - MARGIN_M, x1 = Math.max(...places.map((p) => p.x)) + MARGIN_M;
    const y0 = Math.min(...places.map((p) => p.y)) - MARGIN_M, y1 = Math.max(...places.map((p) => p.y)) + MARGIN_M;
    const camera: Camera = { x: (x0 + x1) / 2, y: (y0 + y1) / 2, scale: Math.min(WIDTH / (x1 - x0), HEIGHT / (y1 - y0)), width: WIDTH, height: HEIGHT };
    const ink = colours(...siteInk, "accent", "on-accent");
    this.draw((g) => {
      g.fillStyle = ink.canvas;
      g.fillRect(0, 0, WIDTH, HEIGHT);
      if (site.model) drawModel(g, camera, site.model, new Set(), ink);
      g.font = "bold 26px system-ui, sans-serif";
      g.textAlign = "center";
      g.textBaseline = "middle";
      for (const [i, { x, y }] of places.entries()) {
        const circle = new Path2D(), [px, py] = toScreen(camera, x, y);
        trace(circle, camera, { circle: [x, y, (i === next ? 24 : 16) / camera.scale] });
        g.fillStyle = i === next ? ink.accent : ink.soft;
        g.fill(circle);
        g.fillStyle = ink["on-accent"];
        g.fillText(String(i + 1), px, py);
      }
    });
  }
}
