/** A flat panel in 3D space: the robot's video with its age, or text, in front of all walls. Always turned to the
 * wearer. */
import { CanvasTexture, Mesh, MeshBasicMaterial, PlaneGeometry, SRGBColorSpace, type Vector3 } from "three";
import { ageText } from "../parts/age";
import { strings } from "../strings.en";
import { Video } from "../video/video.svelte";

export class Board {
  readonly mesh: Mesh;
  readonly canvas = document.createElement("canvas");
  #texture: CanvasTexture;

  constructor(width: number, height: number, pixels: [number, number]) {
    [this.canvas.width, this.canvas.height] = pixels;
    this.#texture = new CanvasTexture(this.canvas);
    this.#texture.colorSpace = SRGBColorSpace;
    this.mesh = new Mesh(new PlaneGeometry(width, height), new MeshBasicMaterial({ map: this.#texture, transparent: true }));
  }

  draw(paint: (g: CanvasRenderingContext2D, width: number, height: number) => void) {
    const g = this.canvas.getContext("2d");
    if (!g) return;
    paint(g, this.canvas.width, this.canvas.height);
    this.#texture.needsUpdate = true;
  }

  face(eye: Vector3) {
    this.mesh.rotation.set(0, Math.atan2(eye.x - this.mesh.position.x, eye.z - this.mesh.position.z), 0);
  }

  /** Nothing hides it: an instrument, not a part of the scene. */
  overAll() {
    (this.mesh.material as MeshBasicMaterial).depthTest = false;
    this.mesh.renderOrder = 1;
  }

  dispose() {
    this.#texture.dispose();
    this.mesh.geometry.dispose();
  }
}

/** Lines of text. */
export class TextBoard extends Board {
  #shown = "";

  constructor(name: string, private readonly count: number, lines: string[] = []) {
    super(1.1, 0.1 + 0.09 * count, [1100, 100 + 90 * count]);
    this.mesh.name = name;
    this.overAll();
    this.show(lines);
  }

  /** At most the number of lines that it was made for. */
  show(lines: string[]) {
    if (this.#shown === lines.join("\n")) return;
    this.#shown = this.mesh.userData.text = lines.join("\n");
    this.draw((g, width, height) => {
      g.clearRect(0, 0, width, height);
      g.fillStyle = "#10161ee6";
      g.fillRect(0, 0, width, 100 + 90 * lines.length);
      g.fillStyle = "#fff";
      g.font = "46px system-ui, sans-serif";
      g.textAlign = "center";
      lines.slice(0, this.count).forEach((line, i) => g.fillText(line, width / 2, 100 + 90 * i, width - 60));
    });
  }
}

/** The video of one robot; stale video is labelled as on the flat page. */
export class VideoBoard extends Board {
  #picture = document.createElement("canvas");
  #video: Video;

  constructor(robot: string) {
    super(0.96, 0.72, [640, 480]);
    this.#video = new Video(robot, this.#picture);
  }

  refresh() {
    const { freshness, age, why } = this.#video;
    this.mesh.visible = true;
    this.draw((g, width, height) => {
      g.fillStyle = "#000";
      g.fillRect(0, 0, width, height);
      if (freshness !== "none") {
        const scale = Math.min(width / this.#picture.width, height / this.#picture.height), w = this.#picture.width * scale, h = this.#picture.height * scale;
        g.drawImage(this.#picture, (width - w) / 2, (height - h) / 2, w, h);
      }
      g.textAlign = "center";
      g.font = "30px system-ui, sans-serif";
      g.fillStyle = freshness === "fresh" ? "#fff" : "#ff9a90";
      if (freshness === "none") g.fillText(why || strings.video.none, width / 2, height / 2, width - 40);
      else g.fillText(age ? ageText(age.ms / 1000) : strings.video.unknownAge, width / 2, height - 16);
      if (freshness !== "stale") return;
      g.fillStyle = "#000b";
      g.fillRect(0, 0, width, height);
      g.fillStyle = "#ff7a70";
      g.font = "bold 96px system-ui, sans-serif";
      g.fillText(strings.video.stale, width / 2, height / 2);
    });
  }

  override dispose() {
    this.#video.close();
    super.dispose();
  }
}
