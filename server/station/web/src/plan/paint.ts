/** Draws one frame of the plan from bottom to top. */
import { view } from "../layout/view.svelte";
import { drawsBySoftware } from "../parts/graphics";
import { selection } from "../session/selection.svelte";
import { ageOf } from "../session/known";
import { session } from "../session/session.svelte";
import { site } from "../session/site.svelte";
import type { Trails } from "../session/trails";
import { colours, theme } from "../theme/theme.svelte";
import { toScreen, type Camera } from "./camera";
import { drawDrafts, drawEntities, drawEvents, drawScan, drawSweep, drawTrails, drawPaths, liveInk, scanStrength, type LiveInk } from "./draw_live";
import { drawPeople } from "./draw_people";
import { drawGround, drawModel, drawNames, drawScale, drawZones, siteInk, type Ink } from "./draw_site";
import { plan, type MapPoint } from "./tool.svelte";

let inks: { of: string; site: Ink; live: LiveInk } | null = null;

/** Colours are read from the style sheet once for each scheme. */
function inksNow() {
  if (inks?.of !== theme.shown) inks = { of: theme.shown, site: colours(...siteInk), live: colours(...liveInk) };
  return inks;
}

export function paint(canvas: HTMLCanvasElement, camera: Camera, trails: Trails, robot: string, cross: MapPoint | null) {
  const g = canvas.getContext("2d", { alpha: false, willReadFrequently: drawsBySoftware() });
  if (!g || !camera.width) return;
  const { site: ink, live } = inksNow();
  const layers = view.layers, { world, entities, scans } = session;
  g.setTransform(canvas.width / camera.width, 0, 0, canvas.height / camera.height, 0, 0);
  drawGround(g, camera, site.map, layers, ink);
  if (site.model && layers.has("model"))
    drawModel(g, camera, site.model, new Set(world ? entities.filter((each) => each.owner === "building").map((each) => each.name) : []), ink);
  if (layers.has("zones")) drawZones(g, camera, session.zones, ink);

  const now = session.now();
  const mixed = scans["1"], real = scans["0"] ?? mixed;
  if (real && layers.has("scan")) {
    const strength = scanStrength(real, now);
    drawSweep(g, camera, real, live.real, strength);
    drawScan(g, camera, real, "real", live.real, strength);
  }
  if (layers.has("paths")) drawTrails(g, camera, trails, new Map(entities.map((each) => [each.name, each])), live);
  drawPaths(g, camera, session.pastTime === null ? session.plans : [], layers.has("paths"), layers.has("motion"), live);
  if (world && layers.has("robots"))
    drawEntities(g, camera, { entities, world, shapesOf: (part) => session.shapesOf(part), footprintOf: (name) => site.robots.find((each) => each.name === name)?.footprint ?? [], selected: selection.entity, follows: robot, ageOf }, live);
  if (layers.has("robots") && session.pastTime === null) drawPeople(g, camera, session.people, (name) => session.poseOf(name), live.person);
  if (mixed && layers.has("virtual")) drawScan(g, camera, mixed, "virtual", live.virtual, scanStrength(mixed, now));
  for (const [key, scan] of Object.entries(scans))
    if (key.startsWith("2:") && layers.has("scan")) drawScan(g, camera, scan, "real", live.soft, scanStrength(scan, now));
  if (layers.has("events")) drawEvents(g, camera, session.events, now, live);
  if (site.model && layers.has("labels")) drawNames(g, camera, site.model, ink);
  drawDrafts(g, camera, plan.drafts, live);
  if (cross) drawCross(g, toScreen(camera, cross.x, cross.y), live.accent);
  drawScale(g, camera, ink);
  if (session.silent && session.hello) pale(g, camera, ink.canvas);
}

function drawCross(g: CanvasRenderingContext2D, [x, y]: [number, number], ink: string) {
  g.strokeStyle = ink;
  g.lineWidth = 1.5;
  g.beginPath();
  g.moveTo(x - 12, y);
  g.lineTo(x + 12, y);
  g.moveTo(x, y - 12);
  g.lineTo(x, y + 12);
  g.stroke();
}

/** Old data must not look live. */
function pale(g: CanvasRenderingContext2D, camera: Camera, ink: string) {
  g.globalAlpha = 0.55;
  g.fillStyle = ink;
  g.fillRect(0, 0, camera.width, camera.height);
  g.globalAlpha = 1;
}
