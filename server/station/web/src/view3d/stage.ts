/** The 3D canvas: camera, drawing on demand, and a coarser resolution on slow machines. */
import { Color, Group, MOUSE, PerspectiveCamera, Plane, Raycaster, Scene, TOUCH, Vector2, Vector3, WebGLRenderer } from "three";
import { drawsBySoftware } from "../parts/graphics";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

/** Frames with a longer latency than this get fewer pixels, those with a shorter one more, ms. */
const SLOW_MS = 33, QUICK_MS = 22;
const COARSEST = 0.5;
/** Minimum interval between frames for new messages alone, ms. */
const NEWS_MS = 25;
/** After this rest, ms, the frame is drawn once more at full resolution. */
const REST_MS = 250;

export class Stage {
  readonly scene = new Scene();
  /** Everything in the frame map, z up; a headset rotates it. */
  readonly map = new Group();
  readonly camera = new PerspectiveCamera(50, 1, 0.05, 500);
  readonly renderer: WebGLRenderer;
  readonly controls: OrbitControls;
  /** Frames drawn, for measurements. */
  drawn = 0;
  #wanted = 0;
  #asked = 0;
  #urgent = false;
  #last = 0;
  #scale = 1;
  #sharp = false;
  #took = QUICK_MS;
  #rest: ReturnType<typeof setTimeout> | undefined;
  #ray = new Raycaster();

  /** Draws on `canvas` and is controlled through `ground`, which has the same size. */
  constructor(canvas: HTMLCanvasElement, private readonly ground: HTMLElement, private readonly before: () => void, private readonly after: () => void) {
    this.renderer = new WebGLRenderer({ canvas, antialias: !drawsBySoftware(), powerPreference: "high-performance" });
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(6, -8, 9);
    this.scene.add(this.map);
    this.controls = new OrbitControls(this.camera, ground);
    this.controls.maxPolarAngle = Math.PI * 0.495;
    this.controls.minDistance = 0.5;
    this.controls.maxDistance = 250;
    this.controls.mouseButtons = { LEFT: MOUSE.ROTATE, MIDDLE: MOUSE.DOLLY, RIGHT: MOUSE.PAN };
    this.controls.touches = { ONE: TOUCH.ROTATE, TWO: TOUCH.DOLLY_PAN };
    this.controls.addEventListener("change", () => this.ask());
  }

  get pixels(): number {
    return this.ground.clientHeight / (2 * Math.tan((this.camera.fov * Math.PI) / 360));
  }

  setGround(css: string) {
    this.scene.background = new Color(css);
    this.ask();
  }

  /** Draws before the next screen refresh, once for any number of requests. */
  ask() {
    this.#urgent = true;
    this.#request();
  }

  /** For new messages, which arrive at many rates: half as often. */
  askForNews() {
    this.#request();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.ground;
    if (!width || !height) return;
    this.renderer.setPixelRatio(devicePixelRatio * this.#scale);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.ask();
  }

  /** Intersection of a canvas point (page pixels) with the floor; null: none. */
  onFloor(px: number, py: number, z = 0): { x: number; y: number } | null {
    const { clientWidth: width, clientHeight: height } = this.ground;
    this.#ray.setFromCamera(new Vector2((px / width) * 2 - 1, 1 - (py / height) * 2), this.camera);
    const hit = this.#ray.ray.intersectPlane(new Plane(new Vector3(0, 0, 1), -z), new Vector3());
    return hit && { x: hit.x, y: hit.y };
  }

  look(box: { x0: number; y0: number; x1: number; y1: number }) {
    const x = (box.x0 + box.x1) / 2, y = (box.y0 + box.y1) / 2;
    const reach = Math.max(box.x1 - box.x0, (box.y1 - box.y0) * this.camera.aspect) / Math.min(this.camera.aspect, 1.4);
    this.controls.target.set(x, y, 0);
    this.camera.position.set(x, y - reach * 0.64, reach * 0.8);
    this.controls.update();
    this.ask();
  }

  /** The eye moves together with its target. */
  moveTo(x: number, y: number) {
    const dx = x - this.controls.target.x, dy = y - this.controls.target.y;
    if (Math.abs(dx) + Math.abs(dy) < 1e-4) return;
    this.controls.target.x = x;
    this.controls.target.y = y;
    this.camera.position.x += dx;
    this.camera.position.y += dy;
    this.controls.update();
  }

  dispose() {
    cancelAnimationFrame(this.#wanted);
    clearTimeout(this.#rest);
    this.controls.dispose();
    this.renderer.dispose();
  }

  drawNow() {
    if (!this.renderer.xr.isPresenting) this.#render();
  }

  #request() {
    if (this.#wanted) return;
    this.#asked = performance.now();
    this.#wanted = requestAnimationFrame((now) => this.#draw(now));
  }

  #draw(now: number) {
    this.#wanted = 0;
    if (this.renderer.xr.isPresenting) return;
    if (!this.#urgent && now - this.#last < NEWS_MS) return this.#request();
    this.#urgent = false;
    this.#last = now;
    if (this.#sharp) this.#resolve(false);
    this.#render();
    this.#adapt();
  }

  #render() {
    this.before();
    this.renderer.render(this.scene, this.camera);
    this.after();
    ++this.drawn;
  }

  /** A slow GPU delays the next frame, software this one: both are included in the latency. */
  #adapt() {
    this.#took += (Math.min(100, performance.now() - this.#asked) - this.#took) * 0.1;
    const scale = this.#took > SLOW_MS ? Math.max(COARSEST, this.#scale * 0.85) : this.#took < QUICK_MS ? Math.min(1, this.#scale * 1.1) : this.#scale;
    if (scale !== this.#scale) {
      this.#scale = scale;
      this.#took = (SLOW_MS + QUICK_MS) / 2;
      this.#resolve(false);
    }
    clearTimeout(this.#rest);
    if (this.#scale < 1) this.#rest = setTimeout(() => this.#finish(), REST_MS);
  }

  #finish() {
    if (this.renderer.xr.isPresenting) return;
    this.#resolve(true);
    this.#render();
  }

  #resolve(sharp: boolean) {
    this.#sharp = sharp;
    this.renderer.setPixelRatio(devicePixelRatio * (sharp ? 1 : this.#scale));
  }
}
