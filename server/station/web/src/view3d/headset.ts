/** The site in a headset (WebXR): virtual objects appear at their positions in the real environment, the video hangs
 * over the robot. Through glass the real building is not drawn; once aligned, it hides what is behind it. */
import { Vector3, type Color, type XRTargetRaySpace } from "three";
import { emergencyStop } from "../drive/stop.svelte";
import { layerNames, type LayerName } from "../layout/layers";
import { view } from "../layout/view.svelte";
import { session } from "../session/session.svelte";
import { Aligning } from "./aligning.svelte";
import type { RealThings } from "./content";
import { HeadsetBoards } from "./headset_boards";
import { markerSight, trackedMarker, tracksImages } from "./image_tracking";
import { references } from "./references.svelte";
import { RoomAnchor } from "./room_anchor";
import type { Stage } from "./stage";

export type HeadsetMode = "immersive-ar" | "immersive-vr";

/** The best mode of this browser; null: none. */
export async function headsetMode(): Promise<HeadsetMode | null> {
  for (const mode of ["immersive-ar", "immersive-vr"] as const)
    if (await navigator.xr?.isSessionSupported(mode).catch(() => false)) return mode;
  return null;
}

/** Layers hidden in see-through mode, because the real building is visible. The model's virtual parts are drawn. */
const hiddenThroughGlass: LayerName[] = ["labels", "map", "collision"];
export const headsetLayers = (mode: HeadsetMode, layers: ReadonlySet<LayerName>): ReadonlySet<LayerName> =>
  new Set(layerNames.filter((name) => layers.has(name) && !(mode === "immersive-ar" && hiddenThroughGlass.includes(name))));

const AGAIN_MS = 1500;  // trigger held for this long: the site is to be aligned again

export class Headset {
  readonly aligning: Aligning;
  readonly #anchor: RoomAnchor;
  readonly #boards: HeadsetBoards;
  #tracks = false;
  #pulled = 0;
  #whole = false;
  #background: Color | null;
  #hands: XRTargetRaySpace[];
  #wrist: XRTargetRaySpace;
  #eye = new Vector3();
  #ahead = new Vector3();

  private constructor(private readonly stage: Stage, private readonly opened: XRSession, private readonly mode: HeadsetMode, private readonly robot: string, private readonly left: () => void) {
    this.aligning = new Aligning(robot);
    this.#anchor = new RoomAnchor(opened, this.aligning);
    this.#boards = new HeadsetBoards(stage.scene, robot, mode === "immersive-ar");
    this.#background = stage.scene.background as Color | null;
    this.#hands = [0, 1].map((i) => stage.renderer.xr.getController(i));
    this.#wrist = this.#hands[0] as XRTargetRaySpace;
    stage.scene.add(...this.#hands);
    for (const hand of this.#hands) {
      hand.addEventListener("connected", this.#connected);
      hand.addEventListener("selectstart", this.#pull);
      hand.addEventListener("select", this.#selected);
      hand.addEventListener("selectend", this.#point);
      hand.addEventListener("squeezestart", this.#stop);
    }
  }

  /** Must be called in a user gesture. Throws if the headset refuses. */
  static async enter(stage: Stage, mode: HeadsetMode, robot: string, frame: (real: RealThings) => void, left: () => void): Promise<Headset> {
    const xr = stage.renderer.xr, marker = references.method === "marker" ? references.marker : null;
    const options = { requiredFeatures: ["local-floor"], optionalFeatures: ["anchors", ...(marker ? ["image-tracking"] : [])], ...(marker && (await trackedMarker(marker.width_m))) };
    const opened = await (navigator.xr as XRSystem).requestSession(mode, options);
    const headset = new Headset(stage, opened, mode, robot, left);
    opened.addEventListener("end", () => headset.#end());
    xr.enabled = true;
    xr.setReferenceSpaceType("local-floor");
    if (mode === "immersive-ar") stage.scene.background = null;
    stage.renderer.setAnimationLoop(() => {
      headset.#align();
      frame(headset.#realThings);
      headset.#draw();
    });
    await xr.setSession(opened);
    xr.getReferenceSpace()?.addEventListener("reset", headset.#spaceReset);
    void headset.#anchor.restore();
    void tracksImages(opened).then((tracks) => { headset.#tracks = tracks; });
    return headset;
  }

  leave() {
    void this.opened.end();
  }

  alignAgain() {
    this.aligning.restart();
    this.#anchor.release();
  }

  /** Before an alignment a building that hides things would hide the wrong ones. Without the layer of the model nothing
   * is hidden, and the drawn robot shows by eye how well the map is aligned. */
  get #realThings(): RealThings {
    return this.mode === "immersive-vr" ? "drawn" : this.aligning.aligned && view.layers.has("model") ? "occluding" : "unseen";
  }

  #align() {
    const { stage, aligning } = this, { xr } = stage.renderer;
    const frame = xr.getFrame(), space = xr.getReferenceSpace();
    if (frame && space) {
      const sight = references.method === "marker" ? markerSight(frame, space) : null;
      if (sight) aligning.sight(sight);
      this.#anchor.follow(frame, space, this.#eye);
    }
    stage.map.rotation.set(-Math.PI / 2, 0, aligning.place.turn);
    stage.map.position.set(aligning.place.x, aligning.place.y, aligning.place.z);
    stage.map.updateMatrixWorld();
  }

  #draw() {
    const { stage } = this, camera = stage.renderer.xr.getCamera(), pose = session.poseOf(this.robot);
    camera.getWorldPosition(this.#eye);
    camera.getWorldDirection(this.#ahead);
    this.#boards.update(this.#eye, this.#ahead, pose && stage.map.localToWorld(new Vector3(pose.x, pose.y, pose.z)), this.#wrist, this.aligning, this.#tracks);
    stage.renderer.render(stage.scene, stage.camera);
  }

  #connected = ({ target, data }: { target: XRTargetRaySpace; data: XRInputSource }) => {
    if (data.handedness === "left") this.#wrist = target;
  };

  #pull = () => {
    this.#pulled = performance.now();
  };

  /** Not told of a pull that was broken off, unlike its end. */
  #selected = () => {
    this.#whole = true;
  };

  #point = ({ target }: { target: XRTargetRaySpace }) => {
    if (!this.#whole) return;
    this.#whole = false;
    const held = performance.now() - this.#pulled > AGAIN_MS;
    if (held) this.alignAgain();
    if (held && references.method !== "robot") return;
    this.aligning.touch(target.getWorldPosition(new Vector3()), target.getWorldDirection(new Vector3()).negate(), this.#eye.clone());
  };

  /** The wearer sees no button: a closed hand is the stop. */
  #stop = () => {
    if (session.mayDrive) emergencyStop();
  };

  #spaceReset = () => {
    if (this.aligning.aligned && !this.#anchor.holds) this.aligning.reset();
  };

  #end() {
    const { stage } = this;
    stage.renderer.setAnimationLoop(null);
    stage.renderer.xr.enabled = false;
    for (const hand of this.#hands) {
      hand.removeEventListener("connected", this.#connected);
      hand.removeEventListener("selectstart", this.#pull);
      hand.removeEventListener("select", this.#selected);
      hand.removeEventListener("selectend", this.#point);
      hand.removeEventListener("squeezestart", this.#stop);
    }
    stage.scene.remove(...this.#hands);
    this.#boards.dispose();
    stage.scene.background = this.#background;
    stage.map.rotation.set(0, 0, 0);
    stage.map.position.set(0, 0, 0);
    stage.camera.up.set(0, 0, 1);
    this.left();
  }
}
