/** JSON messages between server and page on /ws/state. Lengths in metres, angles in radians, `t` in seconds of
 * session time; places are in the frame `map`. Binary frames: frames.ts. */

export type Role = "observer" | "trainee" | "instructor" | "admin";
export interface Who { name: string; role: Role }

/** `robot`: the trainee's; `graded`: the robot of the tasks, if it is another. */
export interface SessionInfo {
  name: string; mode: "live" | "recorded"; level: 1 | 2 | 3; scenario: string; robot: string; robots?: string[]; graded?: string;
  simulated: boolean; started_us: number; mapped: boolean; textured?: boolean;
}
export interface Controls { pause: boolean; rate: boolean; seek: boolean; end: boolean; save: boolean; step?: boolean }
/** Choices of an instructor. */
export interface SceneInfo { scripts: string[]; faults: string[]; doors: string[]; robot_models: string[]; agents_max?: number; briefing: string }
/** Of a whole recording, for its seek bar. */
export interface TimeMark { t: number; kind: string; text: string; bad: boolean }
export interface Hello { type: "hello"; protocol: number; who: Who; session: SessionInfo; server_us: number; controls: Controls; scene?: SceneInfo; marks?: TimeMark[] }

export type ShapeKind = "box" | "sphere" | "cylinder" | "capsule";
export type Triple = [number, number, number];
export type Quaternion = [x: number, y: number, z: number, w: number];
/** Size: box full lengths; sphere its radius thrice; cylinder radius, radius, height along z; capsule radius,
 * radius, height of its straight part. `at` and `turn` in the frame of the part; colour linear red, green, blue,
 * 0..1. */
/** `mesh`: it looks like that one (`api/v1/mesh`), and `size` is its bounding box. */
export interface Shape { shape: ShapeKind; size: Triple; at: Triple; turn: Quaternion; colour: Triple; mesh?: string }
/** `id` is the row of the binary world frame; `form` the index of its shapes in `forms`, -1 if unknown. */
export interface Part { id: number; name: string; form: number }
export interface Entity {
  id: number; name: string; owner: "agent" | "robot" | "building" | "real_person"; kind: string; robot_model: string; parts: Part[];
}
export interface Entities { type: "entities"; table: number; forms: Shape[][]; list: Entity[] }

export interface SessionEvent {
  t: number; kind: string; subject: string; object: string; pair?: string; position: number[] | null;
  impulse: number; value: number; text: string; undetectable: boolean; request: number;
}
export interface Events { type: "events"; list: SessionEvent[] }

export interface Task { name: string; title: string; state: "waiting" | "running" | "done" | "failed"; points: number; of: number; left_s: number | null }
/** Deductions by one rule so far. */
export interface Penalty { name: string; count: number; points: number }
/** `score` is `awarded` less `deducted`, at least 0. `waiting`: the training has not started; `began`: when it did, s of the session. */
export interface Score { type: "score"; score: number; possible: number; awarded?: number; deducted?: number; penalties?: Penalty[]; passed: boolean | null; graded?: boolean; ended?: boolean; verdict?: string; tasks: Task[]; left_s: number | null; waiting?: boolean; began?: number | null }

export interface SensorStatus { name: string; rate_hz: number; age_ms: number | null; loss: number; state: "ok" | "late" | "lost" | "none" }
export interface Status { type: "status"; values: Record<string, number>; notes: Record<string, string>; sensors: SensorStatus[] }
export interface Injection { type: "injection"; live: boolean; reason: string; predicted_error: number | null }
export interface PoseState { type: "pose"; state: string; sigma_m: number | null }
export interface Operator { name: string; robot: string; state: string; console: string }
export interface Operators { type: "operators"; list: Operator[] }
/** Recipients of a message: a role or a person, which may have the name of a role; neither: everybody. */
export interface Recipients { to_role?: Role; to_person?: string }
export interface Chat extends Recipients { type: "chat"; from: string; role: Role; text: string; t: number }
export interface Mark { type: "mark"; t: number; text: string; by: string }
export interface Control {
  type: "control"; mode: "live" | "recorded"; paused: boolean; rate: number; position: number; duration: number | null;
  ended: boolean; frozen: boolean; estop: boolean;
  /** s, the server's monotonic clock. */
  clock: number;
}
export interface Plan { entity: string; kind: "planned" | "predicted" | "path"; points: [number, number][] }
export interface Plans { type: "plans"; list: Plan[] }
export interface Zone { name: string; points: [number, number][]; bottom: number | null; top: number | null }
export interface Zones { type: "zones"; list: Zone[] }
export interface Joints { type: "joints"; robot: string; names: string[]; positions: number[] }
/** A rate or concentration (unit "uSv/h", "ppm"), or its dose since the start ("uSv", "ppm min"). */
export interface HazardValue { kind: "radiation" | "gas"; value: number; unit: string }
export interface Hazard { type: "hazard"; t: number; values: HazardValue[] }
export interface ModelVersion { type: "model"; version: number | string }
export interface Reply { type: "reply"; request: number; ok: boolean; text: string }

/** Each of several trainees' robots; `silent_s`: without POSE_COV, if it has stopped; `reason`: why nothing is injected. */
export interface RobotLine { name: string; localized: boolean; silent_s: number | null; injecting: boolean; reason: string; score: number | null }
export interface Robots { type: "robots"; list: RobotLine[] }

/** A real person whom sensors follow, beside the pose of the entity: m/s, m; `ellipse`: major and minor axis of the
 * place's uncertainty (1 sigma, m) and the direction of the major one. */
export interface RealPerson { name: string; velocity: [number, number]; radius: number; ellipse: [number, number, number] }
export interface People { type: "people"; list: RealPerson[] }

/** A thing that a trainee's robot has sensed: when, how, and whether it does so now. */
export interface KnownThing { name: string; t: number; by: "laser" | "camera" | "touch"; now: boolean }
export interface Known { type: "known"; list: KnownThing[] }

export type ServerMessage = Hello | Entities | Events | Score | Status | Injection | PoseState | Operators | Chat | Mark
  | Robots | People | Known | Control | Plans | Zones | Joints | Hazard | ModelVersion | Reply;

/** Commands that get a `reply` with the same `request`: whoever sends one shows a refusal. */
export interface Ask { type: "agent" | "script" | "fault" | "start" | "end" | "save" | "report" | "chat" | "mark" | "control" | "estop_release"; [field: string]: unknown }
/** Never refused, or sent on another connection too. */
export interface ClientMessage { type: "subscribe" | "estop"; [field: string]: unknown }

const lists: Record<string, string[]> = {
  hello: [], entities: ["forms", "list"], events: ["list"], score: ["tasks"], status: ["sensors"], injection: [], pose: [],
  operators: ["list"], chat: [], mark: [], control: [], plans: ["list"], zones: ["list"], joints: ["names", "positions"],
  hazard: ["values"], model: [], reply: [], robots: ["list"], people: ["list"], known: ["list"],
};

/** null: unknown message (a newer server may send more); throws if a known one is invalid. */
export function parseMessage(text: string): ServerMessage | null {
  const message: unknown = JSON.parse(text);
  if (typeof message !== "object" || message === null) throw new Error("a message is an object with a type");
  const fields = message as Record<string, unknown>;
  const needed = typeof fields.type === "string" && Object.hasOwn(lists, fields.type) ? lists[fields.type] : undefined;
  if (!needed) return null;
  for (const name of needed)
    if (!Array.isArray(fields[name])) throw new Error(`${String(fields.type)} has no list "${name}"`);
  if (fields.type === "hello" && (typeof fields.who !== "object" || typeof fields.session !== "object"))
    throw new Error("hello says neither who nor which session");
  return message as ServerMessage;
}
