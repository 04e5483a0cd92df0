/** The video of one robot: its connection, its decoder, and the age of the displayed picture. */
import { Link, type LinkState } from "../session/link";
import { AgeStatistics, frameAge, freshness, type FrameAge, type Freshness } from "./age";
import { ServerClock } from "./clock";
import { readFrame, type Frame, type FrameState } from "./frame";
import { canDecodeH264, h264Decoder, jpegDecoder, type PictureDecoder } from "./picture";

const clockEvery = 1000, lookEvery = 100;

export class Video {
  link = $state.raw<LinkState>("connecting");
  codec = $state<"h264" | "jpeg" | "">("");
  /** Why the server has no picture; empty: it has one. */
  why = $state("");
  age = $state.raw<FrameAge | undefined>(undefined);
  freshness = $state<Freshness>("none");
  /** performance.now() when the picture was displayed. */
  shownAt = $state<number | undefined>(undefined);
  picture = $state<FrameState>("live");
  size = $state.raw<{ width: number; height: number }>({ width: 640, height: 480 });
  /** Robots with video, reported by the server. */
  robots = $state.raw<string[]>([]);
  /** Of the last few seconds: median and 95th percentile in ms from the camera's stamp to the screen. */
  usual = $state.raw<{ p50: number; p95: number } | null>(null);
  /** Of the session, times real time. */
  rate = 1;

  #link: Link | undefined;
  #decoder: PictureDecoder | undefined;
  #clock = new ServerClock();
  #ages = new AgeStatistics();
  #timers: ReturnType<typeof setInterval>[] = [];
  #frame: Frame | undefined;
  #shownAt: number | undefined;
  #lastKeyAsked = -Infinity;

  constructor(readonly robot: string, private readonly canvas: HTMLCanvasElement) {
    void this.#open();
  }

  close() {
    this.#timers.forEach(clearInterval);
    this.#timers = [];
    this.#link?.close();
    this.#link = undefined;
    this.#decoder?.close();
    this.#decoder = undefined;
    this.#closed = true;
  }
  #closed = false;

  async #open() {
    const h264 = await canDecodeH264();
    if (this.#closed) return;
    this.#connect(h264 ? "h264" : "jpeg");
    this.#timers = [setInterval(() => this.#askClock(), clockEvery), setInterval(() => this.#look(), lookEvery)];
  }
  #connect(codec: "h264" | "jpeg") {
    this.codec = codec;
    this.#link?.close();
    this.#link = new Link(`/ws/video?robot=${encodeURIComponent(this.robot)}&codec=${codec}`, {
      text: (text) => this.#message(text),
      bytes: (bytes) => this.#received(bytes),
      state: (state) => this.#changed(state),
    });
    this.#link.open();
  }
  #changed(state: LinkState) {
    this.link = state;
    if (state !== "open") return;
    this.#clock.restart();
    this.#decoder?.close();
    const show = (picture: VideoFrame | ImageBitmap, frame: Frame): void => this.#show(picture, frame);
    this.#decoder = this.codec === "h264"
      ? h264Decoder(show, () => this.#askKey(), () => this.#connect("jpeg"))
      : jpegDecoder(show, (why) => console.error("a picture that is none:", why));
    this.#askClock();
  }

  #message(text: string) {
    const message = JSON.parse(text) as { type: string; state?: string; why?: string; robots?: string[]; at_ms?: number; server_us?: number };
    if (message.type === "clock") this.#clock.answer(message.at_ms ?? NaN, message.server_us ?? NaN, performance.now());
    if (message.type !== "video") return;
    this.why = message.state === "live" ? "" : (message.why ?? message.state ?? "");
    if (message.robots) this.robots = message.robots;
  }
  #received(bytes: ArrayBuffer) {
    const frame = readFrame(bytes);
    if (frame) this.#decoder?.decode(frame);
  }
  #show(picture: VideoFrame | ImageBitmap, frame: Frame) {
    const { canvas } = this;
    if (canvas.width !== frame.width || canvas.height !== frame.height) {
      canvas.width = frame.width;
      canvas.height = frame.height;
      this.size = { width: frame.width, height: frame.height };
    }
    canvas.getContext("2d", { alpha: false, desynchronized: true })?.drawImage(picture, 0, 0, frame.width, frame.height);
    picture.close();
    const now = performance.now();
    this.#frame = frame;
    this.#shownAt = now;
    this.picture = frame.state;
    this.#link?.send(JSON.stringify({ type: "ack", sequence: frame.sequence, at_ms: now }));
    const age = frameAge(frame, this.#clock.serverUs(now));
    if (age) this.#ages.add(age.ms);
  }

  #askClock() {
    this.#link?.send(JSON.stringify({ type: "clock", at_ms: performance.now() }));
  }
  #askKey() {
    const now = performance.now();
    if (now - this.#lastKeyAsked < 250) return;
    this.#lastKeyAsked = now;
    this.#link?.send(JSON.stringify({ type: "key" }));
  }

  #look() {
    const now = performance.now(), quiet = this.#shownAt === undefined ? undefined : now - this.#shownAt;
    const age = this.#frame && frameAge(this.#frame, this.#clock.serverUs(now));
    const before = this.freshness;
    this.freshness = freshness(quiet, age, this.rate);
    // Increases between two frames.
    this.age = age;
    this.shownAt = this.#shownAt;
    const p50 = this.#ages.quantile(0.5), p95 = this.#ages.quantile(0.95);
    if (p50 !== undefined && p95 !== undefined) this.usual = { p50, p95 };
    if (before !== "stale" && this.freshness === "stale") this.#askKey();
  }
}
