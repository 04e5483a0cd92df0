/** Client of /ws/teleop. Open only while a user who may drive is logged in. */
import { Link, type LinkState } from "../session/link";
import type { RobotJoint } from "./joints";
import type { TeleopMessage } from "./sender";
import type { Twist } from "./twist";

/** `drivable` false: `why` is the reason why nobody can drive it. */
export interface TeleopRobot { name: string; joints: RobotJoint[]; limits: Twist; video: boolean; drivable: boolean; why: string }

interface ReceivedMessage {
  type: string; robot?: string; by?: string; you?: boolean; silent?: boolean; text?: string; rearm?: boolean; on?: boolean; at_ms?: number; server_us?: number;
  list?: { name: string; joints?: (string | RobotJoint)[]; max?: Partial<Twist>; video?: boolean; drivable?: boolean; why?: string }[];
}

/** Slow defaults for a robot without stated limits. */
const modest: Twist = { vx: 0.3, vy: 0, wz: 0.5 };
const pingEvery = 1000;

class Teleop {
  link = $state.raw<LinkState>("connecting");
  robots = $state.raw<TeleopRobot[]>([]);
  /** Name of the robot that this page drives; empty: none. */
  driven = $state("");
  /** The operator of each robot. */
  drivers = $state.raw<ReadonlyMap<string, string>>(new Map());
  /** Why the last request was refused; empty: it was not. */
  refusal = $state("");
  /** The active emergency stops: who pressed the stop of each robot. */
  stops = $state.raw<ReadonlyMap<string, string>>(new Map());
  /** Round trip of the last ping in ms; null: none yet. */
  roundTrip_ms = $state<number | null>(null);
  robot = $derived(this.robots.find((each) => each.name === this.driven));

  #wanted = "";
  #timer: ReturnType<typeof setInterval> | undefined;
  #pong: { pong_us?: number; pong_received_at_ms?: number } = {};
  #rearm = (): void => {};
  #link = new Link("/ws/teleop", {
    text: (text) => this.#take(text),
    bytes: () => {},
    state: (state) => this.#changed(state),
  });

  /** `rearm`: the connection or the robot is new, or the server stopped it: the dead-man must be released first. */
  start(rearm: () => void) {
    this.#rearm = rearm;
    this.#link.open();
    clearInterval(this.#timer);
    this.#timer = setInterval(() => this.#send({ type: "ping", at_ms: performance.now(), ...this.#pong }), pingEvery);
  }
  stop() {
    clearInterval(this.#timer);
    this.#link.close();
    this.driven = "";
  }

  /** Name of the requested robot, granted or not; empty: none, or taken by somebody else. */
  get wanted(): string {
    return this.#wanted;
  }
  drive(robot: string) {
    this.#wanted = robot;
    this.refusal = "";
    if (robot) this.#send({ type: "drive", robot });
  }
  driveNext() {
    const drivable = this.robots.filter((each) => each.drivable);
    const next = drivable[(drivable.findIndex((each) => each.name === this.driven) + 1) % drivable.length];
    if (next) this.drive(next.name);
  }
  send(messages: TeleopMessage[]) {
    for (const message of messages) this.#send(message);
  }
  /** `robot` empty: the driven one, or all. false: not connected. */
  emergencyStop(robot = ""): boolean {
    return this.#send(robot ? { type: "stop", robot } : { type: "stop" });
  }

  #send(message: object): boolean {
    return this.#link.send(JSON.stringify(message));
  }
  #changed(state: LinkState) {
    this.link = state;
    this.driven = "";
    this.roundTrip_ms = null;
    this.#pong = {};
    this.drivers = new Map();
    this.stops = new Map();
    this.#rearm();
    if (state === "open" && this.#wanted) this.drive(this.#wanted);
  }
  #take(text: string) {
    const message = JSON.parse(text) as ReceivedMessage;
    switch (message.type) {
      case "robots": return this.#robots(message);
      case "driven": return this.#drives(message);
      case "refused":
        this.refusal = message.text ?? "";
        if (message.rearm) this.#rearm();
        break;
      case "estop":
        this.stops = changed(this.stops, message.robot, message.on ? message.by : undefined);
        if (message.on) break;
        this.refusal = "";
        this.#rearm();
        break;
      case "sent": this.refusal = ""; break;
      case "pong": {
        const now = performance.now();
        this.roundTrip_ms = now - (message.at_ms ?? NaN);
        this.#pong = { pong_us: message.server_us, pong_received_at_ms: now };
        break;
      }
    }
  }
  #drives({ robot = "", by = "", you = false, silent = false }: ReceivedMessage) {
    this.drivers = changed(this.drivers, robot, by || undefined);
    if (you) {
      this.driven = robot;
      this.refusal = "";
      this.#rearm();
    } else if (robot === this.driven) {
      this.driven = "";
      // If control was released only because of silence, it is taken again: nothing moves before the dead-man
      // is pressed. Otherwise two pages could take it from each other forever.
      if (silent && !by) this.drive(robot);
      else this.#wanted = "";
    }
  }
  #robots({ list }: ReceivedMessage) {
    this.robots = (list ?? []).map(({ name, joints, max, video, drivable, why }) => ({
      name,
      joints: (joints ?? []).map((joint) => (typeof joint === "string" ? { name: joint } : joint)),
      limits: { ...modest, ...max },
      video: video ?? false,
      drivable: drivable ?? true,
      why: why ?? "",
    }));
    if (!this.robots.some((each) => each.name === this.driven)) this.driven = "";
  }
}

function changed(map: ReadonlyMap<string, string>, key = "", value: string | undefined): ReadonlyMap<string, string> {
  const copy = new Map(map);
  if (value === undefined) copy.delete(key);
  else copy.set(key, value);
  return copy;
}

export const teleop = new Teleop();
