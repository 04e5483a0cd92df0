/** The 3D scene: the stores' contents as meshes, each layer on or off. */
import { CanvasTexture, Color, Group, Mesh, MeshBasicMaterial, PlaneGeometry, SRGBColorSpace, type Camera } from "three";
import type { Layers } from "../plan/draw_site";
import { scanStrength } from "../plan/draw_live";
import { ringOf, WALKS } from "../plan/draw_people";
import { plan } from "../plan/tool.svelte";
import { drawsBySoftware } from "../parts/graphics";
import { poseOf } from "../session/poses";
import type { Entity } from "../session/protocol";
import { selection } from "../session/selection.svelte";
import { session } from "../session/session.svelte";
import { site } from "../session/site.svelte";
import type { Trails } from "../session/trails";
import { colours } from "../theme/theme.svelte";
import { Crowd } from "./crowd";
import { Lines } from "./lines";
import { buildingOccluder, modelMeshes, type ModelMeshes } from "./model_mesh";
import { RecordedSurface } from "./recorded_surface";
import { Returns, type Shades } from "./returns";

const inkNames = ["ground", "canvas", "floor", "wall", "thing", "door", "stairs", "zone", "real", "virtual", "robot", "person", "planned", "predicted", "accent", "bad", "soft", "strong"] as const;
type Inks = Record<(typeof inkNames)[number], Color>;

/** Heights above the floor, m, so that flat objects do not flicker. */
const MAP_Z = 0.01, ZONE_Z = 0.02, PATH_Z = 0.04;
/** Height in m at which walls are cut when the view looks over them. */
export const CUT_M = 1.1;

/** Of building and real robots: `drawn`; `unseen`, because the wearer sees them through glass; `occluding`: unseen, and
 * they hide what is behind them. Robots are drawn unless they occlude. */
export type RealThings = "drawn" | "unseen" | "occluding";

export class Content {
  readonly group = new Group();
  readonly crowd = new Crowd();
  #lines = new Lines();
  #scan = new Returns(46);
  #depth = new Returns(30);
  #cloud = new Returns(18, drawsBySoftware() ? 40_000 : Infinity);
  #model: ModelMeshes | null = null;
  #modelOf = "";
  #occluder: Group | null = null;
  #recorded: RecordedSurface | null = null;
  #virtual: ReadonlySet<string> = new Set();
  /** Height of the lowest floor, m: lower parts are shown on it. */
  #lowest = 0;
  #map: Mesh | null = null;
  #inks = {} as Inks;
  #shades = {} as Record<"depth" | "cloud", Shades>;
  #css = {} as Record<(typeof inkNames)[number], string>;

  constructor(private readonly trails: Trails) {
    this.group.add(this.crowd.group, this.#lines.object, this.#scan.points, this.#depth.points, this.#cloud.points);
  }

  setInks() {
    this.#css = colours(...inkNames);
    for (const name of inkNames) this.#inks[name] = new Color(this.#css[name]);
    this.crowd.setInk(this.#css);
    this.#modelOf = "";
    // Current measurements are blue; the cloud of another day has no colour.
    const { real, soft, canvas } = this.#inks;
    this.#shades = { depth: { low: real.clone().lerp(canvas, 0.35), high: real }, cloud: { low: soft.clone().lerp(canvas, 0.7), high: soft } };
    return this.#css;
  }

  /** Called before each frame; `pixels`: size of a metre at a distance of a metre. */
  update(camera: Camera, pixels: number, robot: string, layers: Layers, cut: boolean, things: RealThings = "drawn") {
    this.#standing(layers, cut, things);
    const { world, entities } = session;
    this.crowd.group.visible = layers.has("robots") && world !== null;
    this.crowd.showCollision(layers.has("collision"));
    if (world && this.crowd.group.visible) this.crowd.update(entities, world, session.forms, (part) => session.shapesOf(part), camera, pixels, things === "occluding" ? this.#isReal : () => false);
    const now = session.now(), real = session.scans["0"] ?? session.scans["1"], mixed = session.scans["1"];
    const fresh = (scan: typeof real) => (scan && scanStrength(scan, now) > 0 ? scan : null);
    const laser = site.robots[0]?.laser?.at[2] ?? 0.3;
    this.#scan.setScan(layers.has("scan") ? fresh(real) : null, layers.has("virtual") ? fresh(mixed) : null, laser, this.#inks);
    const top = cut ? CUT_M : 1e6;
    this.#depth.setPoints(layers.has("depth") ? session.depth : null, this.#shades.depth, top);
    this.#cloud.setPoints(layers.has("cloud") ? site.cloud : null, this.#shades.cloud, top);
    this.#draw(layers, robot);
  }

  #standing(layers: Layers, cut: boolean, real: RealThings) {
    const doors = session.world ? session.entities.filter((each) => each.owner === "building").map((each) => each.name) : [];
    const wanted = site.model ? `${site.model.version} ${doors.length}` : "";
    if (site.model && wanted !== this.#modelOf) {
      this.#modelOf = wanted;
      this.#forget();
      this.#virtual = new Set(site.model.elements.filter((each) => each.virtual).map((each) => each.name));
      this.#model = modelMeshes(site.model, new Set(doors), this.#css);
      this.#model.group.name = "model";
      this.group.add(this.#model.group);
      this.#lowest = Math.min(...site.model.elements.filter((each) => each.label === "floor").map((each) => each.at[2] + each.size[2] / 2));
      if (!Number.isFinite(this.#lowest)) this.#lowest = 0;
    }
    if (this.#model) {
      this.#model.group.visible = layers.has("model");
      this.#model.real.visible = real === "drawn";
      const recorded = this.#look(layers.has("recorded") && layers.has("model") && real === "drawn", cut);
      this.#model.recorded.visible = !recorded;
      for (const each of this.#model.above) each.visible = !cut;
      this.#model.walls.uniforms.cut!.value = cut ? CUT_M : 1e6;
      this.#model.edges.visible = layers.has("collision");
    }
    this.#occlude(real === "occluding", doors);
    if (site.map && !this.#map) {
      const { image, x, y, resolution } = site.map;
      const texture = new CanvasTexture(image);
      texture.colorSpace = SRGBColorSpace;
      const width = image.width * resolution, height = image.height * resolution;
      this.#map = new Mesh(new PlaneGeometry(width, height), new MeshBasicMaterial({ map: texture, transparent: true, opacity: 0.4, depthWrite: false }));
      this.#map.position.set(x + width / 2, y + height / 2, MAP_Z);
      this.group.add(this.#map);
    }
    if (this.#map) this.#map.visible = layers.has("map");
  }

  /** Draws the recorded surfaces; false: not, or there are none. */
  #look(on: boolean, cut: boolean): boolean {
    if (on && site.recorded && !this.#recorded) {
      this.#recorded = new RecordedSurface(site.recorded);
      this.group.add(this.#recorded.mesh);
    }
    if (!this.#recorded) return false;
    this.#recorded.mesh.visible = on;
    this.#recorded.cut = cut ? CUT_M : 1e6;
    return on;
  }

  /** `doors`: those with an angle of their own. */
  #occlude(on: boolean, doors: string[]) {
    if (on && site.model && !this.#occluder) {
      this.#occluder = buildingOccluder(site.model, new Set(doors));
      this.#occluder.name = "occluder";
      this.group.add(this.#occluder);
    }
    if (this.#occluder) this.#occluder.visible = on;
  }

  /** Stands in the room itself: real persons and doors, and robots unless they are simulated. */
  #isReal = ({ name, owner }: Entity): boolean => {
    if (owner === "robot") return !session.hello?.session.simulated;
    return owner === "real_person" || (owner === "building" && !this.#virtual.has(name));
  };

  /** Of the model that was. */
  #forget() {
    for (const group of [this.#model?.group, this.#occluder]) {
      group?.traverse((each) => { if (each instanceof Mesh) each.geometry.dispose(); });
      group?.removeFromParent();
    }
    this.#occluder = null;
  }

  #draw(layers: Layers, robot: string) {
    const lines = this.#lines, inks = this.#inks;
    lines.begin();
    if (layers.has("zones"))
      for (const zone of session.zones) lines.path(zone.points.flat(), Math.max(zone.bottom ?? 0, this.#lowest) + ZONE_Z, inks.zone, true);
    const owners = new Map(session.entities.map((each) => [each.name, each]));
    if (layers.has("paths"))
      for (const [name, trail] of this.trails.of) {
        const entity = owners.get(name);
        if (entity) lines.path(trail.points, PATH_Z, entity.owner === "agent" ? inks.virtual : entity.owner === "real_person" ? inks.person : inks.robot);
      }
    for (const each of session.pastTime === null ? session.plans : [])
      if (layers.has(each.kind === "path" ? "paths" : "motion")) lines.path(each.points.flat(), PATH_Z, each.kind === "predicted" ? inks.predicted : inks.planned);
    for (const draft of plan.drafts) lines.path(draft.points.flat(), PATH_Z, draft.refused ? inks.bad : inks.accent, draft.closed);
    for (const [name, ink] of [[selection.entity, inks.accent], [robot, inks.robot]] as const) {
      const pose = poseOf(owners.get(name), session.world);
      if (!pose) continue;
      lines.ring(pose.x, pose.y, pose.z + ZONE_Z, 0.55, ink);
      const cos = Math.cos(pose.yaw), sin = Math.sin(pose.yaw);
      lines.segment(pose.x + 0.55 * cos, pose.y + 0.55 * sin, pose.z + ZONE_Z, pose.x + 0.95 * cos, pose.y + 0.95 * sin, pose.z + ZONE_Z, ink);
    }
    if (layers.has("robots") && session.pastTime === null) this.#people();
    lines.end();
  }

  #people() {
    const ink = this.#inks.person;
    for (const person of session.people) {
      const pose = session.poseOf(person.name);
      if (!pose) continue;
      const z = pose.z + ZONE_Z, [vx, vy] = person.velocity, speed = Math.hypot(vx, vy);
      this.#lines.ellipse(pose.x, pose.y, z, ...ringOf(person), person.ellipse[2], ink);
      if (speed < WALKS) continue;
      const bx = pose.x + vx, by = pose.y + vy, heading = Math.atan2(vy, vx);
      this.#lines.segment(pose.x, pose.y, z, bx, by, z, ink);
      for (const side of [2.6, -2.6]) this.#lines.segment(bx, by, z, bx + 0.2 * Math.cos(heading + side), by + 0.2 * Math.sin(heading + side), z, ink);
    }
  }
}
