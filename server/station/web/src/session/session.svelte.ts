/** State received on /ws/state, for panels to read. Panels never open a socket to it themselves. */
import { strings } from "../strings.en";
import { parseFrame, SCAN_AGENT, type PointsFrame, type ScanFrame, type WorldFrame } from "./frames";
import { History, type Moment, type Roster } from "./history";
import { Link, type LinkState } from "./link";
import { parseMessage, type Ask, type Chat, type Control, type Entity, type Hazard, type Hello, type Injection, type Joints, type KnownThing, type Mark, type Operator, type Plan, type PoseState, type RealPerson, type Reply, type ClientMessage, type RobotLine, type Score, type ServerMessage, type SessionEvent, type Shape, type Status, type Part, type Zone } from "./protocol";
import { poseOf, type FlatPose } from "./poses";
import { Requests } from "./requests";
import { seenAt } from "./seen";

/** s of silence above which the page shows a warning: the server sends something each second. */
export const SILENT_S = 2.5;
const MAX_EVENTS = 5000;
const UNKNOWN_FORM: Shape[] = [{ shape: "box", size: [0.3, 0.3, 0.3], at: [0, 0, 0.15], turn: [0, 0, 0, 1], colour: [0.5, 0.5, 0.5] }];

class Session {
  link = $state.raw<LinkState>("connecting");
  /** performance.now() of the next attempt while the link is lost. */
  retryAt = $state.raw(0);
  /** Seconds since the server's last message, by the page's clock; updated four times a second. */
  silence_s = $state.raw(0);

  hello = $state.raw<Hello | null>(null);
  entities = $state.raw<Entity[]>([]);
  forms = $state.raw<Shape[][]>([]);
  /** Increments when the set of entities changes; a world frame of another table is not drawn. */
  table = $state.raw(-1);
  events = $state.raw<SessionEvent[]>([]);
  score = $state.raw<Score | null>(null);
  status = $state.raw<Status | null>(null);
  injection = $state.raw<Injection | null>(null);
  pose = $state.raw<PoseState | null>(null);
  operators = $state.raw<Operator[]>([]);
  /** State of each robot, if there are several. */
  robotLines = $state.raw<RobotLine[]>([]);
  /** The robot whose scans, score, pose, joints and sensors the server sends here; empty: the session's first. */
  #followed = $state("");
  chat = $state.raw<Chat[]>([]);
  marks = $state.raw<Mark[]>([]);
  control = $state.raw<Control | null>(null);
  plans = $state.raw<Plan[]>([]);
  people = $state.raw<RealPerson[]>([]);
  zones = $state.raw<Zone[]>([]);
  joints = $state.raw<Record<string, Joints>>({});
  /** What a trainee's robot has sensed, by name; empty for those who see everything. */
  known = $state.raw<ReadonlyMap<string, KnownThing>>(new Map());
  hazard = $state.raw<Hazard | null>(null);
  /** Increments when the semantic model has to be fetched again. */
  modelVersion = $state.raw<number | string>(0);

  world = $state.raw<WorldFrame | null>(null);
  /** Newest of each source: "0" SCAN, "1" MR_SCAN, "2:ENTITY" of an agent. */
  scans = $state.raw<Record<string, ScanFrame>>({});
  depth = $state.raw<PointsFrame | null>(null);
  /** Session time of the world, scans and entities shown during playback; null: now. */
  pastTime = $state.raw<number | null>(null);
  /** performance.now() of this page's last seek in a recording. */
  soughtAt = $state.raw(-Infinity);
  readonly history = new History();
  /** The current state, whatever is shown. */
  #live: Moment = { table: -1, entities: [], forms: [], world: null, scans: {} };

  /** Names of the trainees' robots. */
  robots: string[] = $derived(this.hello?.session.robots ?? (this.hello ? [this.hello.session.robot] : []));
  /** The robot that this page follows; empty: no session yet. */
  robot: string = $derived(this.robots.includes(this.#followed) ? this.#followed : (this.hello?.session.robot ?? ""));

  /** Permission to place, inject faults, pause and end. Only for the display: the server decides. */
  instructs = $derived(this.hello?.who.role === "instructor" || this.hello?.who.role === "admin");
  mayDrive = $derived(this.hello !== null && this.hello.who.role !== "observer");
  /** Where the report of one of several robots is; of the followed one without a name. */
  reportOf(robot = this.robot): string { return this.robots.length > 1 ? `report?${encodeURIComponent(robot)}` : "report"; }
  /** The live session is over: nothing of it runs any more. */
  ended = $derived(this.hello?.session.mode === "live" && (this.control?.ended ?? false));
  /** A live session is paused: nothing moves and no image comes. The server pauses none with a real robot. */
  held = $derived(this.hello?.session.mode === "live" && this.hello.session.simulated && (this.control?.paused ?? false) && !this.ended);
  silent = $derived(this.link !== "open" || this.silence_s > SILENT_S);

  #requests = new Requests();
  #subscription: Record<string, unknown> = { scan: true, points: false, world_hz: 30, agent_scans: [] };
  #worldArrived = 0;
  #clock: ReturnType<typeof setInterval> | undefined;
  #link = new Link("/ws/state", {
    text: (text) => this.#take(() => this.#message(parseMessage(text))),
    bytes: (bytes) => this.#take(() => this.#frame(bytes)),
    state: (state, retryAt) => this.#linkChanged(state, retryAt),
  });

  start() {
    this.#link.open();
    clearInterval(this.#clock);
    this.#clock = setInterval(() => {
      this.silence_s = this.#link.receivedAt ? (performance.now() - this.#link.receivedAt) / 1000 : 0;
    }, 250);
  }

  stop() {
    clearInterval(this.#clock);
    this.#link.close();
    this.#requests.fail(strings.link.notConnected);
    this.hello = null;
  }

  /** Session time now: that of the newest world, extrapolated by the page's clock unless paused, silent or at its
   * end. */
  now(): number {
    if (this.pastTime !== null) return this.pastTime;
    const t = this.world?.t ?? this.control?.position ?? 0;
    if (!this.world || this.silent || this.control?.paused || this.control?.ended) return t;
    return t + ((performance.now() - this.#worldArrived) / 1000) * (this.control?.rate || 1);
  }

  /** Sends a command; resolves with the server's reply, or `ok: false` and the reason. */
  ask(message: Ask): Promise<Reply> {
    if (message.type === "control" && message.action === "seek") this.soughtAt = performance.now();
    return this.#requests.ask((request) => this.#link.send(JSON.stringify({ ...message, ...seenAt(message, this.control), request })), strings.link);
  }

  /** Sends a message without a reply; false: not connected. */
  send(message: ClientMessage): boolean {
    return this.#link.send(JSON.stringify(message));
  }

  /** The shapes of a part in its own frame; an unknown one is a small box. */
  shapesOf(part: Part): Shape[] {
    return this.forms[part.form] ?? UNKNOWN_FORM;
  }

  /** s since a trainee's robot sensed it last; null: it is sensed now, or not only remembered. */
  rememberedFor(name: string): number | null {
    const thing = this.known.get(name);
    return thing && !thing.now ? Math.max(0, this.now() - thing.t) : null;
  }

  /** Pose of an entity now (its first part, in map), or null if unknown. */
  poseOf(name: string): FlatPose | null {
    return poseOf(this.entities.find((each) => each.name === name), this.world);
  }

  /** Which poses are known: that of the session's robot, only others', or none. */
  placed: "site" | "others" | "robot" = $derived(this.poseOf(this.robot) ? "robot" : this.world ? "others" : "site");

  /** Positions of robots and agents; doors and the like are part of the site. */
  places(): FlatPose[] {
    return this.entities.flatMap((each) => (each.owner === "building" ? [] : (poseOf(each, this.world) ?? [])));
  }

  /** Shows the state at `t`; null, or a time no longer stored: the current state. */
  lookBack(t: number | null) {
    const moment = t === null ? null : this.history.at(t);
    this.pastTime = moment ? t : null;
    this.#show(moment ?? this.#live);
  }
  #show(shown: Moment) {
    [this.table, this.entities, this.forms] = [shown.table, shown.entities, shown.forms];
    [this.world, this.scans] = [shown.world, shown.scans];
  }
  /** Session time now, also during playback of the past. */
  liveTime(): number {
    return this.pastTime === null ? this.now() : (this.#live.world?.t ?? this.pastTime);
  }

  /** Another name than that of a trainee's robot changes nothing. */
  follow(robot: string) {
    if (!this.robots.includes(robot) || robot === this.robot) return;
    this.#followed = robot;
    [this.score, this.status, this.injection, this.pose, this.hazard] = [null, null, null, null, null];
    this.#live = { ...this.#live, scans: Object.fromEntries(Object.entries(this.#live.scans).filter(([key]) => key.startsWith(`${SCAN_AGENT}:`))) };
    if (this.pastTime === null) this.scans = this.#live.scans;
    this.subscribe({ robot });
  }

  subscribe(change: { robot?: string; scan?: boolean; points?: boolean; world_hz?: number; agent_scans?: string[] }) {
    this.#subscription = { ...this.#subscription, ...change };
    this.send({ type: "subscribe", ...this.#subscription });
  }

  #linkChanged(state: LinkState, retryAt: number) {
    this.link = state;
    this.retryAt = retryAt;
    if (state === "open") this.subscribe({});
    else this.#requests.fail(strings.link.notConnected);
  }

  #take(run: () => void) {
    try {
      run();
    } catch (error) {
      // A bad message must not stop the next one: it is dropped and logged to the console.
      console.error("from the server:", error);
    }
  }

  #frame(bytes: ArrayBuffer) {
    const frame = parseFrame(bytes);
    if (frame.kind === "world") {
      if (frame.table !== this.#live.table) return;
      this.#live.world = frame;
      if (this.hello?.session.mode === "live") this.history.world(frame);
      if (this.pastTime === null) this.world = frame;
      this.#worldArrived = performance.now();
    } else if (frame.kind === "scan") {
      const key = frame.source === SCAN_AGENT ? `${SCAN_AGENT}:${frame.entity}` : String(frame.source);
      this.#live.scans = { ...this.#live.scans, [key]: frame };
      if (this.hello?.session.mode === "live") this.history.scan(key, frame);
      if (this.pastTime === null) this.scans = this.#live.scans;
    } else this.depth = frame;
  }

  #message(message: ServerMessage | null) {
    switch (message?.type) {
      case "hello": return this.#begin(message);
      case "entities": return this.#rosterChanged({ table: message.table, entities: message.list, forms: message.forms });
      case "events": this.events = [...this.events, ...message.list].slice(-MAX_EVENTS); break;
      case "score": this.score = message; break;
      case "status": this.status = message; break;
      case "injection": this.injection = message; break;
      case "pose": this.pose = message; break;
      case "robots": this.robotLines = message.list; break;
      case "operators": this.operators = message.list; break;
      case "chat": this.chat = [...this.chat, message]; break;
      case "mark": this.marks = [...this.marks, message]; break;
      case "control": this.control = message; break;
      case "plans": this.plans = message.list; break;
      case "people": this.people = message.list; break;
      case "zones": this.zones = message.list; break;
      case "joints": this.joints = { ...this.joints, [message.robot]: message }; break;
      case "known": this.known = new Map(message.list.map((each) => [each.name, each])); break;
      case "hazard": this.hazard = message; break;
      case "model": this.modelVersion = message.version; break;
      case "reply": this.#requests.answer(message); break;
    }
  }

  #rosterChanged(roster: Roster) {
    this.history.roster(roster);
    this.#live = { ...roster, world: null, scans: this.#live.scans };
    if (this.pastTime === null) this.#show(this.#live);
  }

  /** Each connection starts with the complete state, which replaces that of earlier ones. */
  #begin(hello: Hello) {
    this.events = [];
    this.chat = [];
    this.marks = [];
    this.pastTime = null;
    this.history.clear();
    this.#live = { ...this.#live, world: null, scans: {} };
    this.#show(this.#live);
    this.hello = hello;
    this.robotLines = [];
    this.people = [];
    this.known = new Map();
  }
}

export const session = new Session();
