/** What hangs in the air for the wearer: video, instructions, the alignment, the emergency stop. */
import { Vector3, type Object3D, type Scene } from "three";
import { stopState } from "../drive/stop.svelte";
import { strings } from "../strings.en";
import type { Aligning } from "./aligning.svelte";
import { promptLines, stateText, warningText } from "./alignment_text";
import { VideoBoard, TextBoard } from "./board";
import { PointsBoard } from "./points_board";

const VIDEO_HEIGHT_M = 1.55;
/** Longest line of the alignment's board. */
const LINE = 46;

export class HeadsetBoards {
  readonly #video: VideoBoard;
  readonly #prompt = new TextBoard("prompt", 5);
  readonly #points = new PointsBoard();
  readonly #state = new TextBoard("alignment", 6);
  readonly #stopped = new TextBoard("stopped", 1, strings.headset.stopped);
  readonly #unheard = new TextBoard("unheard", 2, strings.headset.unheard);

  /** `overWalls`: real walls do not hide the video. */
  constructor(private readonly scene: Scene, robot: string, overWalls: boolean) {
    this.#video = new VideoBoard(robot);
    if (overWalls) this.#video.overAll();
    this.#state.mesh.scale.setScalar(0.25);
    for (const { mesh } of this.#all) mesh.visible = false;
    scene.add(...this.#all.map(({ mesh }) => mesh));
  }

  get #all() {
    return [this.#video, this.#prompt, this.#points, this.#state, this.#stopped, this.#unheard];
  }

  /** Before each frame; `robot`: where it stands in the headset's space, null: unknown. `wrist`: what carries the
   * alignment's board. */
  update(eye: Vector3, ahead: Vector3, robot: Vector3 | null, wrist: Object3D, aligning: Aligning, tracks: boolean) {
    this.#video.mesh.visible = robot !== null;
    if (robot) {
      this.#video.mesh.position.copy(robot).setY(robot.y + VIDEO_HEIGHT_M);
      this.#video.refresh();
    }
    const prompt = promptLines(aligning, tracks), warning = warningText(aligning);
    this.#prompt.mesh.visible = prompt !== null;
    this.#prompt.show([...(warning && !aligning.aligned ? broken(warning).slice(0, 2) : []), ...(prompt ?? []), strings.headset.stop].slice(0, 5));
    this.#prompt.mesh.position.set(eye.x, 1.2, eye.z - 1.4);
    this.#points.mesh.visible = aligning.next !== null;
    this.#points.show(aligning.touches.length);
    this.#points.mesh.position.set(eye.x, 0.7, eye.z - 1.4);
    this.#state.show([...broken(stateText(aligning.state)), ...broken(warning)].slice(0, 6));
    this.#state.mesh.visible = wrist.visible;
    wrist.getWorldPosition(this.#state.mesh.position).setY(this.#state.mesh.position.y + 0.14);
    this.#stopped.mesh.visible = stopState.latched && !stopState.failed;
    this.#unheard.mesh.visible = stopState.failed;
    for (const { mesh } of [this.#stopped, this.#unheard]) mesh.position.copy(ahead).multiplyScalar(1.2).add(eye);
    for (const board of this.#all) board.face(eye);
  }

  dispose() {
    this.scene.remove(...this.#all.map(({ mesh }) => mesh));
    for (const board of this.#all) board.dispose();
  }
}

/** Into lines of at most LINE letters, between words. */
function broken(text: string): string[] {
  const lines: string[] = [];
  for (const word of text.split(" ").filter(Boolean)) {
    const last = lines[lines.length - 1];
    if (last !== undefined && last.length + word.length < LINE) lines[lines.length - 1] = `${last} ${word}`;
    else lines.push(word);
  }
  return lines;
}
