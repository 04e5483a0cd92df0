/** The objects and faults that an instructor can add to the session, and their commands (in the terms of a scenario
 * file). */

export type MapPoint = { x: number; y: number };
export type AgentKind = "person" | "robot" | "box" | "barrel" | "container" | "cable";

export interface PaletteItem {
  kind: AgentKind;
  model?: string;  // of a robot; none: the simple one
  size: [number, number, number];  // m; of persons and robots only for the drawing
}

export const obstacles: PaletteItem[] = [
  { kind: "box", size: [0.4, 0.4, 0.6] },
  { kind: "barrel", size: [0.6, 0.6, 0.9] },
  { kind: "container", size: [0.6, 0.4, 0.3] },
  { kind: "cable", size: [2, 0.03, 0.03] },
];

export function palette(robotModels: readonly string[]): PaletteItem[] {
  return [
    { kind: "person", size: [0.5, 0.5, 1.75] },
    { kind: "robot", size: [0.6, 0.5, 0.4] },
    ...robotModels.map((model): PaletteItem => ({ kind: "robot", model, size: [0.7, 0.6, 0.4] })),
    ...obstacles,
  ];
}

/** `person_3` if `person_1` and `person_2` exist. */
export function freeName(item: PaletteItem, taken: ReadonlySet<string>): string {
  const stem = item.model ?? item.kind;
  for (let number = 1; ; ++number) if (!taken.has(`${stem}_${number}`)) return `${stem}_${number}`;
}

export const behaviours = ["stay", "patrol", "wander", "teleop", "follow", "flee", "block", "go"] as const;
export type BehaviourKind = (typeof behaviours)[number];
export const needsPath = (behaviour: BehaviourKind): boolean => behaviour === "patrol" || behaviour === "go";
export const needsTarget = (behaviour: BehaviourKind): boolean => ["follow", "flee", "block"].includes(behaviour);

/** The server would refuse it. */
export const lacksPath = (choice: BehaviourChoice): boolean => needsPath(choice.behaviour) && choice.waypoints.length === 0;

export interface BehaviourChoice {
  behaviour: BehaviourKind;
  speed: number;      // m/s
  target: string;     // empty: the trainee's robot
  distance: number;   // m
  waypoints: [number, number][];
  yields: boolean;
  opens_doors: boolean;
}

export const standStill: BehaviourChoice = {
  behaviour: "stay", speed: 0.5, target: "", distance: 1.5, waypoints: [], yields: true, opens_doors: true,
};

export type AgentAction = Record<string, unknown> & { type: "agent"; action: string };

const round = (x: number, digits = 3): number => Number(x.toFixed(digits));

function behaviourFields(choice: BehaviourChoice): Record<string, unknown> {
  return {
    behaviour: choice.behaviour, speed: choice.speed, yields: choice.yields, opens_doors: choice.opens_doors,
    ...(needsPath(choice.behaviour) ? { waypoints: choice.waypoints.map(([x, y]) => [round(x), round(y)]) } : {}),
    ...(needsTarget(choice.behaviour) ? { target: choice.target, distance: choice.distance } : {}),
  };
}

export function spawn(item: PaletteItem, name: string, at: MapPoint, yaw: number, choice: BehaviourChoice): AgentAction {
  return {
    type: "agent", action: "spawn", name, kind: item.kind, x: round(at.x), y: round(at.y), z: 0, yaw: round(yaw, 4),
    ...(item.kind === "person" || item.kind === "robot" ? {} : { size: item.size }),
    ...(item.model ? { model: item.model } : {}),
    ...(["person", "robot"].includes(item.kind) ? behaviourFields(choice) : {}),
  };
}
export function move(name: string, at: MapPoint, yaw: number): AgentAction {
  return { type: "agent", action: "move", name, x: round(at.x), y: round(at.y), z: 0, yaw: round(yaw, 4) };
}
export const behave = (name: string, choice: BehaviourChoice): AgentAction =>
  ({ type: "agent", action: "behave", name, ...behaviourFields(choice) });
export const remove = (name: string): AgentAction => ({ type: "agent", action: "remove", name });
export const removeAll = (): AgentAction => ({ type: "agent", action: "remove_all" });
/** `name` empty: all. */
export const freeze = (frozen: boolean, name = ""): AgentAction =>
  ({ type: "agent", action: frozen ? "freeze" : "unfreeze", ...(name ? { name } : {}) });
/** `open`: rad from the closed position; undefined: from the sensors. */
export const door = (name: string, open: number | undefined): AgentAction =>
  open === undefined ? { type: "agent", action: "door_unknown", name } : { type: "agent", action: "door", name, opening: round(open, 4) };
