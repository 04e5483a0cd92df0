/** The site in a headset (WebXR): virtual objects appear at their positions in the real environment, the video hangs
 * over the robot. */
import { Color, Vector3, type XRTargetRaySpace } from "three";
import { emergencyStop, stopState } from "../drive/stop.svelte";
import { layerNames, type LayerName } from "../layout/layers";
import { session } from "../session/session.svelte";
import { strings } from "../strings.en";
import { VideoBoard, wordsBoard, type Board } from "./board";
import { assumed, calibrated, type SiteInHeadset } from "./calibration";
import type { Stage } from "./stage";

export type HeadsetMode = "immersive-ar" | "immersive-vr";

/** The best mode of this browser; null: none. */
export async function headsetMode(): Promise<HeadsetMode | null> {
  for (const mode of ["immersive-ar", "immersive-vr"] as const)
    if (await navigator.xr?.isSessionSupported(mode).catch(() => false)) return mode;
  return null;
}

/** Layers hidden in see-through mode, because the real building is visible. */
const hiddenThroughGlass: LayerName[] = ["model", "labels", "map", "collision"];
export const headsetLayers = (mode: HeadsetMode, layers: ReadonlySet<LayerName>): ReadonlySet<LayerName> =>
  new Set(layerNames.filter((name) => layers.has(name) && !(mode === "immersive-ar" && hiddenThroughGlass.includes(name))));

const VIDEO_HEIGHT_M = 1.55;
const AGAIN_MS = 1500;  // trigger held for this long: the site is to be placed again

export class Headset {
  /** True after a calibration; until then the site's pose is assumed. */
  calibrated = false;
  place: SiteInHeadset;
  #video: VideoBoard;
  #words: Board;
  #stopped: Board;
  #unheard: Board;
  #pulled = 0;
  #session: XRSession | null = null;
  #background: Color | null;
  #hands: XRTargetRaySpace[];
  #eye = new Vector3();

  private constructor(private readonly stage: Stage, private readonly robot: string, private readonly left: () => void) {
    const pose = session.poseOf(robot);
    this.place = assumed(pose ?? { x: 0, y: 0, yaw: 0 });
    this.#background = stage.scene.background as Color | null;
    this.#video = new VideoBoard(robot);
    this.#words = wordsBoard(strings.headset.how);
    this.#stopped = wordsBoard(strings.headset.stopped);
    this.#stopped.mesh.name = "stopped";
    this.#unheard = wordsBoard(strings.headset.unheard);
    this.#unheard.mesh.name = "unheard";
    for (const { mesh } of [this.#stopped, this.#unheard]) mesh.visible = false;
    this.#hands = [0, 1].map((i) => stage.renderer.xr.getController(i));
    stage.scene.add(this.#video.mesh, this.#words.mesh, this.#stopped.mesh, this.#unheard.mesh, ...this.#hands);
    for (const hand of this.#hands) {
      hand.addEventListener("selectstart", this.#pull);
      hand.addEventListener("select", this.#point);
      hand.addEventListener("squeezestart", this.#stop);
    }
  }

  /** Must be called in a user gesture. Throws if the headset refuses. */
  static async enter(stage: Stage, mode: HeadsetMode, robot: string, frame: () => void, left: () => void): Promise<Headset> {
    const xr = stage.renderer.xr;
    const opened = await (navigator.xr as XRSystem).requestSession(mode, { requiredFeatures: ["local-floor"] });
    const headset = new Headset(stage, robot, left);
    headset.#session = opened;
    opened.addEventListener("end", () => headset.#end());
    xr.enabled = true;
    xr.setReferenceSpaceType("local-floor");
    if (mode === "immersive-ar") stage.scene.background = null;
    stage.renderer.setAnimationLoop(() => {
      frame();
      headset.#frame();
    });
    await xr.setSession(opened);
    return headset;
  }

  leave() {
    void this.#session?.end();
  }

  #frame() {
    const { stage } = this;
    stage.map.rotation.set(-Math.PI / 2, 0, this.place.turn);
    stage.map.position.set(this.place.x, 0, this.place.z);
    stage.map.updateMatrixWorld();
    stage.renderer.xr.getCamera().getWorldPosition(this.#eye);
    const pose = session.poseOf(this.robot);
    this.#video.mesh.visible = pose !== null;
    if (pose) {
      this.#video.mesh.position.copy(stage.map.localToWorld(new Vector3(pose.x, pose.y, pose.z + VIDEO_HEIGHT_M)));
      this.#video.face(this.#eye);
      this.#video.refresh();
    }
    this.#words.mesh.visible = !this.calibrated;
    this.#words.mesh.position.set(this.#eye.x, 1.2, this.#eye.z - 1.4);
    this.#words.face(this.#eye);
    this.#stopped.mesh.visible = stopState.latched && !stopState.failed;
    this.#unheard.mesh.visible = stopState.failed;
    for (const board of [this.#stopped, this.#unheard]) {
      stage.renderer.xr.getCamera().getWorldDirection(board.mesh.position).multiplyScalar(1.2).add(this.#eye);
      board.face(this.#eye);
    }
    stage.renderer.render(stage.scene, stage.camera);
  }

  #pull = () => {
    this.#pulled = performance.now();
  };

  #point = ({ target }: { target: XRTargetRaySpace }) => {
    if (performance.now() - this.#pulled > AGAIN_MS) this.calibrated = false;
    const pose = session.poseOf(this.robot);
    if (this.calibrated || !pose) return;
    const found = calibrated(target.getWorldPosition(new Vector3()), target.getWorldDirection(new Vector3()).negate(), pose);
    if (!found) return;
    this.place = found;
    this.calibrated = true;
  };

  /** The wearer sees no button: a closed hand is the stop. */
  #stop = () => {
    if (session.mayDrive) emergencyStop();
  };

  #end() {
    const { stage } = this;
    stage.renderer.setAnimationLoop(null);
    stage.renderer.xr.enabled = false;
    for (const hand of this.#hands) {
      hand.removeEventListener("selectstart", this.#pull);
      hand.removeEventListener("select", this.#point);
      hand.removeEventListener("squeezestart", this.#stop);
    }
    stage.scene.remove(this.#video.mesh, this.#words.mesh, this.#stopped.mesh, this.#unheard.mesh, ...this.#hands);
    this.#video.dispose();
    this.#words.dispose();
    this.#stopped.dispose();
    this.#unheard.dispose();
    stage.scene.background = this.#background;
    stage.map.rotation.set(0, 0, 0);
    stage.map.position.set(0, 0, 0);
    stage.camera.up.set(0, 0, 1);
    this.left();
  }
}
